#include "passes/inverse_warp/reference_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "chain/pass/work_list.h"

namespace postchain::inverse_warp::reference {
namespace {

constexpr std::array<int, 6> kDistances = {1, 2, 3, 5, 9, 16};
constexpr std::array<std::array<int, 2>, 4> kLines = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};

std::array<int, 2> along(std::array<int, 2> cell, std::array<int, 2> line, int distance) {
    return {cell[0] + distance * line[0], cell[1] + distance * line[1]};
}

int block_count(int pixels) {
    return (pixels + kBlockPx - 1) / kBlockPx;
}

}  // namespace

// Quarters that are much brighter than the second darkest of those that show the farthest surface
// have less weight.
void Background::dim_lamps(std::array<Cell, 4>& quarters) {
    double farthest = std::numeric_limits<double>::infinity();
    for (const Cell& quarter : quarters)
        if (quarter.part > 0) farthest = std::min(farthest, quarter.inverse_depth);
    std::vector<double> brightness;
    for (const Cell& quarter : quarters)
        if (quarter.part > 0 && one_depth(quarter.inverse_depth, farthest))
            brightness.push_back(quarter.brightness);
    if (brightness.size() < 2) return;
    std::sort(brightness.begin(), brightness.end());
    const double limit = kLamp * brightness[1];
    for (Cell& quarter : quarters)
        if (quarter.brightness > limit)
            quarter.part *= std::max(std::pow(limit / quarter.brightness, 2), kLeastLampPart);
}

// Quarter by quarter: a farther surface replaces the one so far, the same one is averaged with it.
Background::Cell Background::merge(const std::array<Cell, 4>& quarters) {
    Cell whole;
    for (const Cell& quarter : quarters) {
        if (quarter.part == 0) continue;
        const bool same = whole.part > 0 && one_depth(whole.inverse_depth, quarter.inverse_depth);
        if (whole.part > 0 && !same && whole.inverse_depth < quarter.inverse_depth) continue;
        if (!same) {
            whole = quarter;
            continue;
        }
        const double part = whole.part + quarter.part;
        for (size_t c = 0; c < whole.color.size(); ++c)
            whole.color[c] = (whole.part * whole.color[c] + quarter.part * quarter.color[c]) / part;
        whole.brightness =
            (whole.part * whole.brightness + quarter.part * quarter.brightness) / part;
        whole.inverse_depth = std::min(whole.inverse_depth, quarter.inverse_depth);
        whole.part = part;
    }
    whole.part /= 4;
    return whole;
}

Background::Background(const ImageD& color, const std::vector<Surface>& surfaces) {
    Level pixels{1, kBlockPx * block_count(color.width), kBlockPx * block_count(color.height), {}};
    pixels.cells.resize(size_t(pixels.columns) * size_t(pixels.rows));
    for (int y = 0; y < color.height; ++y)
        for (int x = 0; x < color.width; ++x) {
            const Surface& s = surfaces[size_t(y) * size_t(color.width) + size_t(x)];
            const Vec from = s.front_part > 0 ? s.color_from.value_or(Vec{}) : Vec{};
            const double* c = color.pixel(x + int(from.x), y + int(from.y));
            Cell& cell = pixels.cells[size_t(y) * size_t(pixels.columns) + size_t(x)];
            cell.color.assign(c, c + color.channels);
            cell.brightness = std::max({c[0], c[1], c[2], 0.0});
            cell.inverse_depth = s.inverse_depth;
            const bool own_color = s.color_from && dot(*s.color_from, *s.color_from) == 0;
            cell.part = s.edge && !own_color ? kEdgeWeight : 1;
        }
    levels_.push_back(std::move(pixels));
    while (levels_.back().edge_px < kBlockPx) {
        const Level& fine = levels_.back();
        Level coarse{2 * fine.edge_px, fine.columns / 2, fine.rows / 2, {}};
        for (int y = 0; y < coarse.rows; ++y)
            for (int x = 0; x < coarse.columns; ++x) {
                const auto quarter = [&](int i, int j) {
                    return fine.cells[size_t(2 * y + j) * size_t(fine.columns) + size_t(2 * x + i)];
                };
                std::array<Cell, 4> quarters = {quarter(0, 0), quarter(1, 0), quarter(0, 1),
                                                quarter(1, 1)};
                if (fine.edge_px > 1) dim_lamps(quarters);
                coarse.cells.push_back(merge(quarters));
            }
        levels_.push_back(std::move(coarse));
    }
    levels_.erase(levels_.begin());
    columns_ = (color.width + 1) / 2;
    rows_ = (color.height + 1) / 2;
}

const Background::Cell& Background::smallest(std::array<int, 2> cell) const {
    return levels_[0].cells[size_t(cell[1]) * size_t(levels_[0].columns) + size_t(cell[0])];
}

int Background::distance_behind(std::array<int, 2> cell, std::array<int, 2> line, double q) const {
    double behind = -1;
    for (const int distance : kDistances) {
        const auto [x, y] = along(cell, line, distance);
        if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return 0;
        const Cell& shown = smallest({x, y});
        if (shown.part == 0) return 0;
        if (behind < 0 && shown.inverse_depth * kOneDepth < q) behind = shown.inverse_depth;
        if (behind < 0) continue;
        if (!one_depth(shown.inverse_depth, behind)) return 0;
        if (shown.part > kShows) return distance;
    }
    return 0;
}

double Background::level_around(std::array<int, 2> cell) const {
    const Level& blocks = levels_.back();
    const int column = 2 * cell[0] / kBlockPx, row = 2 * cell[1] / kBlockPx;
    std::vector<const double*> around;
    for (int j = row - 1; j <= row + 1; ++j)
        for (int i = column - 1; i <= column + 1; ++i) {
            const int x = std::clamp(i, 0, blocks.columns - 1);
            const int y = std::clamp(j, 0, blocks.rows - 1);
            around.push_back(
                blocks.cells[size_t(y) * size_t(blocks.columns) + size_t(x)].color.data());
        }
    return level_of(around, kContinuedLevel);
}

Background::Line Background::line_between(const Sides& sides, double span, double level) const {
    const Cell &a = smallest(sides.first), &b = smallest(sides.second);
    Line line = {sides, span};
    line.one_depth = one_depth(a.inverse_depth, b.inverse_depth);
    line.one_surface = line.one_depth;
    for (size_t c = 0; c < line.brighter.size(); ++c) {
        const double one = as_part_of(a.color[c], level), other = as_part_of(b.color[c], level);
        line.brighter[c] = std::max(one, other);
        if (std::abs(one - other) >= kOneColor) line.one_surface = false;
    }
    return line;
}

std::optional<Background::Sides> Background::sides_of(Vec x, double q) const {
    const std::array<int, 2> cell = {int(x.x) / 2, int(x.y) / 2};
    const double own = smallest(cell).inverse_depth;
    if (own * kOneDepth < q) return Sides{cell, cell};
    std::optional<Line> shortest, found;
    for (const auto& way : kLines) {
        const int a = distance_behind(cell, way, own);
        const int b = distance_behind(cell, {-way[0], -way[1]}, own);
        if (a == 0 || b == 0) continue;
        const Line line = line_between({along(cell, way, a), along(cell, way, -b)},
                                       (a + b) * std::hypot(way[0], way[1]), level_around(cell));
        if (!shortest || line.span < shortest->span) shortest = line;
        if (line.one_surface && (!found || line.span < found->span)) found = line;
    }
    if (!found || found->span > kMuchLonger * shortest->span) return std::nullopt;
    for (size_t c = 0; c < found->brighter.size(); ++c)
        if (shortest->one_depth && shortest->brighter[c] - found->brighter[c] > kLost)
            return std::nullopt;
    return found->sides;
}

Color Background::continued_color(const Sides& sides, Vec at) const {
    const Vec a = {double(sides.first[0]), double(sides.first[1])};
    const Vec way = Vec{double(sides.second[0]), double(sides.second[1])} - a;
    const double share =
        std::clamp(dot(0.5 * at - a, way) / std::max(dot(way, way), 1.0), 0.0, 1.0);
    Color color = smallest(sides.first).color;
    const Color& other = smallest(sides.second).color;
    for (size_t c = 0; c < color.size(); ++c) color[c] += share * (other[c] - color[c]);
    return color;
}

std::vector<std::pair<const Background::Cell*, double>> Background::around(const Level& level,
                                                                           Vec at,
                                                                           double inverse_depth) {
    const double x = (at.x + 0.5) / level.edge_px - 0.5, y = (at.y + 0.5) / level.edge_px - 0.5;
    std::vector<std::pair<const Cell*, double>> cells;
    for (int j = int(std::floor(y)); j <= int(std::floor(y)) + 1; ++j)
        for (int i = int(std::floor(x)); i <= int(std::floor(x)) + 1; ++i) {
            const Cell& cell =
                level.cells[size_t(std::clamp(j, 0, level.rows - 1)) * size_t(level.columns) +
                            size_t(std::clamp(i, 0, level.columns - 1))];
            const double weight = (1 - std::abs(x - i)) * (1 - std::abs(y - j)) * cell.part;
            if (weight > 0 && cell.inverse_depth <= kOneDepth * inverse_depth)
                cells.emplace_back(&cell, weight);
        }
    return cells;
}

Color Background::at(Vec at, double inverse_depth, const Color& otherwise) const {
    for (const Level& level : levels_) {
        Color sum(otherwise.size());
        double total = 0;
        for (const auto& [cell, weight] : around(level, at, inverse_depth)) {
            for (size_t c = 0; c < sum.size(); ++c) sum[c] += weight * cell->color[c];
            total += weight;
        }
        if (total == 0) continue;
        for (double& c : sum) c /= total;
        return sum;
    }
    return otherwise;
}

bool Background::is_filled(Vec at, double inverse_depth, double q) const {
    for (const Level& level : levels_) {
        double near = 0, total = 0;
        for (const auto& [cell, weight] : around(level, at, inverse_depth)) {
            if (cell->inverse_depth * kBehind > q) near += weight;
            total += weight;
        }
        if (total > 0) return near >= kFilled * total;
    }
    return false;
}

bool Background::shows(Vec at, double inverse_depth) const {
    return !around(levels_[0], at, inverse_depth).empty();
}

namespace {

bool nearer(double q, double r, const Sample& now) {
    return q > r * now.depth_ratio;
}

double longer_axis(Vec v) {
    return std::max(std::abs(v.x), std::abs(v.y));
}

Vec rounded(Vec v) {
    return {std::floor(v.x + 0.5), std::floor(v.y + 0.5)};
}

// One step: the pixel X that it visits, and whether the surface there is the sample's.
struct Visit {
    Vec x;
    bool beyond = false;  // X lies beyond the frame, whose border pixels go on
    const Surface* surface = nullptr;
    Vec d;             // D(X)
    double error = 0;  // |X + D(X) - p|, the longer axis
    bool accepted = false;
};

Visit visit(const Frames& frames, Vec p, Vec d, const Sample& now) {
    const Vec x = rounded(p - d);
    Visit v;
    v.x = frames.here.inside(x);
    v.beyond = v.x.x != x.x || v.x.y != x.y;
    v.surface = &frames.here.surface(v.x);
    v.d = v.surface->displacement(now, frames.half_open);
    v.error = longer_axis(x - (p - v.d));
    // A neighbor may have seen what lies beyond this frame.
    v.accepted = v.error <= kAcceptPx && (!v.beyond || frames.neighbors.empty());
    return v;
}

// Where the color of the surface visited is read. An edge pixel mixes two surfaces: it is
// interpolated only along the axes on which the adjacent pixel is displaced alike. The mixture
// moves along with the nearer surface, so that a nearer pixel must have the same path.
Vec read_at(const Frames& frames, const Visit& v, Vec p, const Sample& now) {
    const Frame& here = frames.here;
    const Vec at = here.inside(p - v.d), from = v.surface->color_from.value_or(Vec{});
    if (!v.surface->edge) return at;
    if (from.x != 0 || from.y != 0) return v.x + from;
    const auto moves_along = [&](Vec x) {
        const Surface& s = here.surface(here.inside(x));
        const Vec e = s.displacement(now, frames.half_open) - (p - at), f = s.a - v.surface->a;
        return dot(e, e) <= frames.together_px * frames.together_px &&
               (s.inverse_depth <= v.surface->inverse_depth * kOneDepth ||
                dot(f, f) <= frames.same_path_px * frames.same_path_px);
    };
    const Vec beside = {v.x.x + (at.x < v.x.x ? -1 : 1), v.x.y + (at.y < v.x.y ? -1 : 1)};
    return {moves_along({beside.x, v.x.y}) ? at.x : v.x.x,
            moves_along({v.x.x, beside.y}) ? at.y : v.x.y};
}

void keep_nearest(Search& s, const Visit& v, Vec p, const Frames& frames, const Sample& now) {
    const double q = v.surface->inverse_depth, nearest = s.nearest.inverse_depth;
    if (!v.accepted ||
        !(nearer(q, nearest, now) || (!nearer(nearest, q, now) && v.error < s.residual)))
        return;
    s.nearest = {&frames.here, read_at(frames, v, p, now), q, v.surface->a, v.beyond};
    s.residual = v.error;
}

void keep_farthest(Search& s, const Visit& v, const Sample& now) {
    const double q = v.surface->inverse_depth, far = s.far.inverse_depth;
    if (!(nearer(far, q, now) || (!nearer(q, far, now) && v.error < s.far_residual))) return;
    s.far = *v.surface;
    s.far_residual = v.error;
    s.far_at = v.x;
}

// The steps from one surface, until one is accepted. Returns that. With `occluded`, which is set if
// a step visited a nearer surface or left the frame, or if the last one visited a surface that is
// not farther, `begin` is a start surface: its search also ends at a surface that is not nearer
// than the one found.
const Surface* search_from(Search& s, const Frames& frames, Vec p, const Sample& now,
                           const Surface& begin, int steps, bool* occluded) {
    Vec d = begin.displacement(now, frames.half_open);
    for (int step = 0; step < steps; ++step) {
        const Visit v = visit(frames, p, d, now);
        keep_nearest(s, v, p, frames, now);
        keep_farthest(s, v, now);
        if (s.first_depth < 0) s.first_depth = v.surface->inverse_depth;
        if (v.accepted) return v.surface;
        const double q = v.surface->inverse_depth;
        if (occluded && (v.beyond || nearer(q, begin.inverse_depth, now) ||
                         (step == steps - 1 && !nearer(begin.inverse_depth, q, now))))
            *occluded = true;
        if (occluded && s.nearest.inverse_depth >= 0 && !nearer(q, s.nearest.inverse_depth, now))
            break;
        d = v.d;
    }
    return nullptr;
}

// Does this frame show no farther surface than s at the place that s has in it? x: its pixel in the
// neighbor
bool may_be_occluded(const Frames& frames, const Frame& neighbor, const Surface& s, Vec x) {
    Sample here;  // at the center of the lens
    here.u = -neighbor.offset / frames.half_open;
    const Vec at = rounded(x + s.displacement(here, frames.half_open));
    const Vec inside = frames.here.inside(at);
    if (inside.x != at.x || inside.y != at.y) return true;
    return s.inverse_depth <= kFarther * frames.here.surface(at).inverse_depth;
}

// Searches one neighbor for a surface nearer than `nearest`, and no farther than `farthest`. Edge
// pixels, which mix two surfaces, count only if nothing else is found. Ends at what is not nearer.
void search_neighbor(const Frames& frames, const Frame& neighbor, Surface begin, Vec p,
                     const Sample& now, double farthest, Found& nearest) {
    // The same surface replaces one in another light.
    const auto leads_on = [&](double q, bool other_light) {
        return nearest.other_light && !other_light ? q * kOneDepth > nearest.inverse_depth
                                                   : nearer(q, nearest.inverse_depth, now);
    };
    if (!leads_on(begin.inverse_depth, false)) return;
    Sample then = now;
    then.u -= neighbor.offset / frames.half_open;
    begin.b = {};  // a parabola about this frame is not one about the neighbor
    Vec d = begin.displacement(then, frames.half_open);
    for (int step = 0; step < kNeighborSteps; ++step) {
        const Vec x = neighbor.inside(rounded(p - d));
        const Surface& s = neighbor.surface(x);
        // No search may find it, or it leads to nothing nearer.
        if (s.inverse_depth < 0 || !leads_on(s.inverse_depth, s.other_light)) return;
        d = s.displacement(then, frames.half_open);
        if (longer_axis(x - p + d) > kAcceptPx || (s.edge && nearest.inverse_depth >= 0) ||
            s.inverse_depth * now.depth_ratio < farthest ||
            !may_be_occluded(frames, neighbor, s, x))
            continue;
        nearest = {
            &neighbor,    s.edge ? x : neighbor.inside(p - d), s.inverse_depth, s.a, false, s.edge,
            s.other_light};
    }
}

// Searches the layer behind for a surface nearer than `nearest`, and no farther than `farthest`.
// Its pixels that are nearer than what the frame shows there do not count.
void search_second_layer(const Frames& frames, const Surface& begin, Vec p, const Sample& now,
                         double farthest, Found& nearest) {
    const Frame& layer = *frames.second_layer;
    if (!nearer(begin.inverse_depth, nearest.inverse_depth, now)) return;
    Vec d = begin.displacement(now, frames.half_open);
    for (int step = 0; step < kSecondSteps; ++step) {
        const Vec x = layer.inside(rounded(p - d));
        const Surface& s = layer.surface(x);
        if (s.inverse_depth < 0) return;  // nothing is known there
        d = s.displacement(now, frames.half_open);
        if (longer_axis(x - p + d) > kAcceptPx ||
            !nearer(s.inverse_depth, nearest.inverse_depth, now) ||
            s.inverse_depth * now.depth_ratio < farthest ||
            nearer(s.inverse_depth, frames.here.surface(x).inverse_depth, now))
            continue;
        nearest = {&layer, s.edge ? x : layer.inside(p - d), s.inverse_depth, s.a};
    }
}

// Is the surface that this frame shows nearer than all that it may hide?
bool is_settled(const Pixel& pixel, const Sample& now, const Search& here) {
    const std::vector<Surface>& starts = pixel.block->starts;
    for (size_t i = 0; i < starts.size(); ++i)
        if (here.occluded_starts[i] &&
            nearer(starts[i].inverse_depth, here.nearest.inverse_depth, now))
            return false;
    return here.nearest.inverse_depth >= 0;
}

// Unless this frame settles it: from what the pixel itself hides, from the farthest surface visited
// if this frame shows nothing, and from the start surfaces that this frame may hide. If the
// farthest surface is behind the first, or comes from beyond the border, nothing behind it counts.
Found resolve_second_layer(const Frames& frames, const Pixel& pixel, const Sample& now,
                           const Search& here) {
    Found nearest = here.nearest;
    if (!frames.second_layer || is_settled(pixel, now, here)) return nearest;
    const bool shows_behind = nearer(here.first_depth, here.far.inverse_depth, now);
    double farthest = shows_behind ? here.far.inverse_depth : 0;
    if (nearest.inverse_depth < 0) {
        const Vec at = rounded(pixel.p - here.far.displacement(now, frames.half_open));
        const Vec inside = frames.here.inside(at);
        if (at.x != inside.x || at.y != inside.y) farthest = here.far.inverse_depth;
    }
    const auto search_layer = [&](const Surface& begin) {
        search_second_layer(frames, begin, pixel.p, now, farthest, nearest);
    };
    const Surface& own = frames.second_layer->surface(pixel.p);
    if (own.inverse_depth >= 0) search_layer(own);
    if (nearest.inverse_depth < 0) search_layer(here.far);
    const std::vector<Surface>& starts = pixel.block->starts;
    for (size_t i = 0; i < starts.size(); ++i)
        if (here.occluded_starts[i]) search_layer(starts[i]);
    return nearest;
}

// Is this surface, which the sample sees, beyond the border of a neighbor?
bool is_beyond(const Frames& frames, const Frame& neighbor, Surface s, Vec p, const Sample& now) {
    Sample then = now;
    then.u -= neighbor.offset / frames.half_open;
    s.b = {};
    const Vec at = rounded(p - s.displacement(then, frames.half_open));
    const Vec inside = neighbor.inside(at);
    return at.x != inside.x || at.y != inside.y;
}

// Does the farthest surface visited come almost to p?
bool comes_close(const Frames& frames, const Search& here, Vec p, const Sample& now) {
    const Vec to = p - here.far.displacement(now, frames.half_open);
    const Vec inside = frames.here.inside(to);
    return inside.x == to.x && inside.y == to.y && longer_axis(here.far_at - to) <= kClosePx;
}

}  // namespace

Vec Frame::inside(Vec at) const {
    return {std::clamp(at.x, 0.0, color.width - 1.0), std::clamp(at.y, 0.0, color.height - 1.0)};
}

Search search(const Frames& frames, const Pixel& pixel, const Sample& now, Surface& begin,
              bool advance) {
    const std::vector<Surface>& starts = pixel.block->starts;
    Search s;
    s.residual = kAcceptPx;
    s.far.inverse_depth = s.far_residual = 3.4e38;
    s.occluded_starts.resize(starts.size());
    const Surface* own = search_from(s, frames, pixel.p, now, begin, frames.own_steps, nullptr);
    if (own && advance) begin = *own;
    // A surface found from the pixel itself occludes all that are not nearer; one found from a
    // start surface only those that are farther.
    double occluded_from = s.nearest.inverse_depth * now.depth_ratio;
    for (size_t i = 0; i < starts.size() && starts[i].inverse_depth > occluded_from; ++i) {
        bool occluded = false;
        search_from(s, frames, pixel.p, now, starts[i], kSteps, &occluded);
        s.occluded_starts[i] = occluded;
        occluded_from = std::max(occluded_from, s.nearest.inverse_depth / now.depth_ratio);
    }
    return s;
}

// After the layer behind: if this frame shows nothing, from the farthest surface visited, in each
// neighbor, the nearer in time first; then in that one from the start surfaces that this frame may
// hide. If the farthest surface visited is behind the first or comes almost to the pixel, no
// farther one counts, nor in a neighbor whose border it is beyond.
Found resolve_occluded(const Frames& frames, const Background& background, const Pixel& pixel,
                       const Sample& now, const Search& here) {
    const std::vector<Surface>& starts = pixel.block->starts;
    std::vector<const Frame*> neighbors;
    for (const Frame& neighbor : frames.neighbors) neighbors.push_back(&neighbor);
    if (neighbors.size() == 2 && now.u >= 0) std::swap(neighbors[0], neighbors[1]);
    const bool shows_behind = nearer(here.first_depth, here.far.inverse_depth, now);
    const bool covered =
        shows_behind || (here.nearest.inverse_depth < 0 && comes_close(frames, here, pixel.p, now));
    const double farthest = covered ? here.far.inverse_depth : 0;
    Found nearest = resolve_second_layer(frames, pixel, now, here);
    const auto search_in = [&](const Frame& neighbor, const Surface& begin) {
        const bool beyond =
            here.nearest.inverse_depth < 0 && is_beyond(frames, neighbor, here.far, pixel.p, now);
        search_neighbor(frames, neighbor, begin, pixel.p, now,
                        beyond ? here.far.inverse_depth : farthest, nearest);
    };
    if (here.nearest.inverse_depth < 0)
        for (const Frame* neighbor : neighbors) search_in(*neighbor, here.far);
    for (size_t i = 0; i < starts.size() && !neighbors.empty(); ++i)
        if (here.occluded_starts[i]) search_in(*neighbors[0], starts[i]);
    const Vec far_at = frames.here.inside(pixel.p - here.far.displacement(now, frames.half_open));
    // In another light, a fill that shows the surface errs less.
    if (nearest.other_light && here.nearest.inverse_depth < 0 &&
        background.is_filled(far_at, here.far.inverse_depth, nearest.inverse_depth))
        return {};
    // A neighbor's edge shows no more of a surface than this frame does beside it, if both it and
    // what hides it stay in place.
    if (frames.lens && nearest.edge && one_depth(nearest.inverse_depth, here.far.inverse_depth) &&
        here.far.path() <= kStillPx && frames.here.surface(rounded(far_at)).path() <= kStillPx &&
        background.shows(far_at, here.far.inverse_depth))
        return {};
    return nearest;
}

Continuation find_continuation(const Frames& frames, const Background& background,
                               const Pixel& pixel, const Sample& now, const Search& here,
                               double found) {
    const std::vector<Surface>& starts = pixel.block->starts;
    for (size_t i = 0; i < starts.size(); ++i) {
        const double q = starts[i].inverse_depth;
        const Vec d = starts[i].displacement(now, frames.half_open);
        if (!here.occluded_starts[i] || q <= kOneDepth * found) continue;
        const Visit first = visit(frames, pixel.p, d, now);
        const double shown = first.surface->inverse_depth;
        if (first.beyond || first.accepted || !nearer(shown, q, now)) continue;
        const auto sides = background.sides_of(first.x, shown);
        if (sides && one_depth(background.inverse_depth(sides->first), q))
            return {q, *sides, starts[i].a, frames.here.inside(pixel.p - d)};
    }
    return {};
}

}  // namespace postchain::inverse_warp::reference

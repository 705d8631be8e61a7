// The gather (gather.comp, samples.glsl), the sums over a pixel's samples (accumulate.glsl) and
// denoising (denoise.comp), one pixel at a time, written from the rules, which docs/inverse_warp.md
// has in short. The functions are named as in GLSL; the two share only constants, the random
// numbers and the rounding of storage.
#include "passes/inverse_warp/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "chain/frame/behind.h"
#include "chain/pass/work_list.h"
#include "passes/common/lens_samples.h"
#include "passes/common/wide_color.h"
#include "passes/inverse_warp/reference_search.h"
#include "shaders/shared/small_circles.h"

namespace postchain::inverse_warp {
namespace reference {
namespace {

// accumulate.glsl
constexpr double kMaxSpread = 65536;

// A sample's color, and the surface that it sees.
struct Hit {
    Color color;
    double inverse_depth = 0;
    Vec path;  // a
    Vec at;    // where this frame shows or hides it, px
};

// Samples of blurred surfaces.
struct Soft {
    Color color;
    double weight = 0;
    std::array<double, 3> spread = {};  // sum of covariances: xx, xy, yy, px^2
};

// Colors are differences to the pixel's own.
struct Sums {
    Color color;
    double weight = 0;
    double moment = 0;        // of the displacements, px^2
    double longest_path = 0;  // squared, px^2
    Soft soft;
    double shown = 0;          // brightness as shown ...
    double shown_squared = 0;  // ... and its square
};

// sum + weight color
void add(Color& sum, double weight, const Color& color) {
    for (size_t c = 0; c < sum.size(); ++c) sum[c] += weight * color[c];
}

std::array<double, 3> covariance_of(const Hit& hit, const Settings& settings) {
    std::array<double, 3> covariance = {};
    if (settings.lens) {
        const double radius = settings.lens->coc.radius_px(hit.inverse_depth);
        const auto [x, y] = settings.lens->coc.axes;
        covariance[0] += x * x * radius * radius / 4;
        covariance[2] += y * y * radius * radius / 4;
    }
    if (settings.shutter) {
        const Vec moved = settings.shutter->time_scale * hit.path;
        covariance[0] += moved.x * moved.x / 3;
        covariance[1] += moved.x * moved.y / 3;
        covariance[2] += moved.y * moved.y / 3;
    }
    return covariance;
}

void add_soft(Soft& soft, const Hit& hit, const Color& difference, double weight,
              const Settings& settings) {
    const auto covariance = covariance_of(hit, settings);
    const double variance = covariance[0] + covariance[2];
    if (variance < kSoftSpread) return;
    const double kept = std::min(kMaxSpread / variance, 1.0);
    add(soft.color, weight, difference);
    soft.weight += weight;
    for (size_t c = 0; c < 3; ++c) soft.spread[c] += weight * kept * covariance[c];
}

Sums no_samples(int channels) {
    Sums sums;
    sums.color = sums.soft.color = Color(size_t(channels));
    return sums;
}

void accumulate(Sums& sums, const Pixel& pixel, const Sample& now, const Hit& hit,
                const Settings& settings) {
    Color difference = hit.color;
    for (size_t c = 0; c < difference.size(); ++c) difference[c] -= pixel.color[c];
    const Vec moved_px = hit.at - pixel.p;
    add(sums.color, now.weight, difference);
    sums.weight += now.weight;
    sums.moment += now.weight * dot(moved_px, moved_px);
    if (settings.shutter) sums.longest_path = std::max(sums.longest_path, dot(hit.path, hit.path));
    double light = 0;
    for (size_t c = 0; c < 3; ++c) light += std::max(hit.color[c], 0.0) / 3;
    sums.shown += now.weight * std::sqrt(light / (1 + light));
    sums.shown_squared += now.weight * light / (1 + light);
    add_soft(sums.soft, hit, difference, now.weight, settings);
}

// The hint's pixel gate: noise, as shown, of a mean of such samples; radius of the even disc with
// their second moment.
double noise_gate(const Sums& sums) {
    if (sums.weight == 0) return 0;
    const double mean = sums.shown / sums.weight;
    const double variance = std::max(sums.shown_squared / sums.weight - mean * mean, 0.0);
    const double noise = std::sqrt(variance / sums.weight);
    const double radius_px = std::sqrt(2 * sums.moment / sums.weight);
    return std::clamp((noise - kLeastNoise) / kMoreNoise, 0.0, 1.0) *
           std::clamp((radius_px - kLeastBlurPx) / kMoreBlurPx, 0.0, 1.0);
}

// denoise.comp
constexpr double kPixelVariance = 1.0 / 12;  // px^2, along x and y, added to each covariance
constexpr int kReachPx = 2;

// Replaces, in each pixel of `color`, the part that blurred samples have by their mean over the
// pixels around. soft: their mean color, as wide as `color`; shares: their share; spread: their
// covariance, xx, xy, yy.
void denoise(const Settings& settings, const ImageD& soft, const ImageD& shares,
             const ImageD& spread, ImageD& color) {
    const double window =
        (settings.shutter ? kWindowWithShutter : kWindow) * std::sqrt(settings.parameters.samples);
    const ImageD gathered = color;
    for (int y = 0; y < color.height; ++y) {
        for (int x = 0; x < color.width; ++x) {
            const double share = shares.at(x, y);
            if (!(share > 0)) continue;
            const double xx = spread.at(x, y, 0) + kPixelVariance, xy = spread.at(x, y, 1);
            const double yy = spread.at(x, y, 2) + kPixelVariance;
            std::vector<double> sums(size_t(color.channels), 0.0);
            double total = 0;
            for (int j = std::max(y - kReachPx, 0); j <= std::min(y + kReachPx, color.height - 1);
                 ++j) {
                for (int i = std::max(x - kReachPx, 0);
                     i <= std::min(x + kReachPx, color.width - 1); ++i) {
                    const double dx = i - x, dy = j - y;
                    // d^T covariance^-1 d
                    const double form =
                        (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
                    const double weight =
                        shares.at(i, j) * std::max(std::exp(-window * form) - kLeastWeight, 0.0);
                    if (weight == 0) continue;
                    for (size_t c = 0; c < sums.size(); ++c)
                        sums[c] += weight * (soft.at(i, j, int(c)) - soft.at(x, y, int(c)));
                    total += weight;
                }
            }
            for (int c = 0; c < color.channels; ++c)
                color.at(x, y, c) = gathered.at(x, y, c) + share / total * sums[size_t(c)];
        }
    }
}

// gather.comp, samples.glsl
constexpr int kMinTimes = 5;

// Channels of the fill mask.
constexpr size_t kFromNeighbor = 1, kEstimated = 2;

// Color at a position between pixels: bilinear, with weights sharpened about their center.
Color color_at(const ImageD& color, Vec at) {
    const auto sharpened = [](double f) {
        return std::clamp(kSharpening * (f - 0.5) + 0.5, 0.0, 1.0);
    };
    const double fx = sharpened(at.x - std::floor(at.x)), fy = sharpened(at.y - std::floor(at.y));
    const int x0 = int(std::floor(at.x)), y0 = int(std::floor(at.y));
    const int x1 = std::min(x0 + 1, color.width - 1), y1 = std::min(y0 + 1, color.height - 1);
    Color c(size_t(color.channels));
    for (int i = 0; i < color.channels; ++i) {
        const double upper = std::lerp(color.at(x0, y0, i), color.at(x1, y0, i), fx);
        const double lower = std::lerp(color.at(x0, y1, i), color.at(x1, y1, i), fx);
        c[size_t(i)] = std::lerp(upper, lower, fy);
    }
    return c;
}

// The layer behind, from its stack (chain/frame/behind.h).
Frame second_layer_of(const ImageD& stack, int height, bool motion, const Settings& settings) {
    const auto rows = [&](int first, int end) {
        ImageD planes(stack.width, (end - first) * height, 4);
        std::copy_n(stack.pixel(0, first * height), planes.data.size(), planes.data.data());
        return planes;
    };
    const auto channels = [&](int plane, int first, int count) {
        ImageD some(stack.width, height, count);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < stack.width; ++x)
                for (int c = 0; c < count; ++c)
                    some.at(x, y, c) = stack.at(x, y + plane * height, first + c);
        return some;
    };
    ReferenceFrame planes;
    planes.planes[Role::color] = rows(0, 1);
    if (stack.height > kBehindPlanes * height)
        planes.planes[Role::layers] = rows(kBehindPlanes, stack.height / height);
    const ImageD depth = channels(1, 0, 1), forward = channels(2, 0, 2), back = channels(2, 2, 2);
    return {0, wide_color(planes),
            surfaces_of_planes(
                {&depth, motion ? &forward : nullptr, motion ? &back : nullptr, true}, settings)};
}

Frames frames_of(const PlanContext& context, const Settings& settings,
                 const ReferenceFrame& frame) {
    const auto neighbors = searched_neighbors(settings, context.available);
    const auto plane = [&](Role role, bool used = true) {
        return used && context.available.has(role) ? &frame.planes.at(role) : nullptr;
    };
    const bool motion = settings.shutter || !neighbors.empty();
    Frames frames;
    frames.half_open = half_open_of(settings);
    frames.lens = settings.lens.has_value();
    frames.own_steps = settings.shutter ? kSteps : 1;
    frames.together_px = settings.lens ? kTogetherLensPx : kTogetherPx;
    if (!settings.shutter) frames.same_path_px = std::numeric_limits<double>::infinity();
    const ImageD& color = frame.planes.at(Role::color);
    const auto turns = [&](Neighbor neighbor) {
        if (std::find(neighbors.begin(), neighbors.end(), neighbor) == neighbors.end())
            return Planes::Turns();
        return Planes::Turns{plane(role_of(neighbor, Role::motion)),
                             plane(role_of(neighbor, Role::motion_back))};
    };
    frames.here = {
        0, wide_color(frame),
        shown_surfaces(color, plane(Role::motion, motion),
                       surfaces_of_planes({plane(Role::inverse_depth), plane(Role::motion, motion),
                                           plane(Role::motion_back, motion), false,
                                           turns(Neighbor::before), turns(Neighbor::after)},
                                          settings),
                       settings, motion ? Split::all : Split::in_front)};
    for (const Neighbor neighbor : neighbors) {
        const auto of = [&](Role role) { return plane(role_of(neighbor, role)); };
        const double offset = neighbor == Neighbor::before ? -1.0 : 1.0;
        const ImageD& other = *of(Role::color);
        const std::vector<Surface> of_planes = surfaces_of_planes(
            {of(Role::inverse_depth), of(Role::motion), of(Role::motion_back), true}, settings);
        std::vector<Surface> shown =
            shown_surfaces(other, nullptr, of_planes, settings, Split::none);
        mark_other_light({color, frames.here.surfaces}, {other, of_planes}, offset, settings,
                         shown);
        frames.neighbors.push_back(
            {offset,
             wide_color(frame, role_of(neighbor, Role::color), role_of(neighbor, Role::layers)),
             std::move(shown)});
    }
    if (uses_second_layer(settings, context))
        frames.second_layer =
            second_layer_of(frame.planes.at(Role::behind), color.height, motion, settings);
    return frames;
}

std::vector<OtherSurfaces> other_surfaces(const Frames& frames) {
    std::vector<OtherSurfaces> others;
    for (const Frame& neighbor : frames.neighbors)
        others.push_back({neighbor.offset, &neighbor.surfaces});
    if (frames.second_layer) others.push_back({0, &frames.second_layer->surfaces});
    return others;
}

class Gather {
  public:
    Gather(const PlanContext& context, const Settings& settings, ReferenceFrame& frame)
        : s_(settings),
          description_(context.frame),
          frame_(frame),
          hint_wanted_(context.wanted.has(Role::hint)),
          width_(context.frame.width),
          height_(context.frame.height),
          frames_(frames_of(context, settings, frame)),
          blocks_(
              blocks_of(frames_.here.surfaces, width_, height_, other_surfaces(frames_), settings)),
          background_(frames_.here.color, frames_.here.surfaces),
          noise_(noise::table(settings.noise(), context.frame.frame_number)),
          color_(width_, height_, frames_.here.color.channels),
          soft_(width_, height_, color_.channels),
          share_(width_, height_, 1),
          spread_(width_, height_, 3),
          hint_(width_, height_, 2) {
        if (settings.lens) disc_scale_ = lens::disc_radius(settings.lens->aperture);
        if (settings.lens)
            points_ = lens::lens_samples(settings.lens->aperture, settings.parameters.samples);
    }

    void run() {
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const Pixel pixel = pixel_at(x, y);
                if (is_still(pixel))
                    store_unchanged(pixel);
                else if (is_filled_by_one(pixel))
                    store_circle(pixel);
                else
                    store_mean(pixel, gather(pixel));
            }
        if (s_.parameters.denoise) {
            show_soft_stages();
            denoise(s_, soft_, share_, spread_, color_);
        }
        set_wide_color(frame_, color_);
        frame_.stages["color"] = frame_.planes.at(Role::color);
        if (hint_wanted_ && (s_.shutter || frame_.planes.contains(Role::hint))) {
            frame_.stages["hint"] = hint_;
            frame_.planes[Role::hint] = std::move(hint_);
        }
    }

  private:
    size_t block_index(int x, int y) const {
        const int columns = (width_ + kBlockPx - 1) / kBlockPx;
        return size_t(y / kBlockPx * columns + x / kBlockPx);
    }

    Pixel pixel_at(int x, int y) const {
        Pixel pixel;
        pixel.x = x;
        pixel.y = y;
        pixel.p = {double(x), double(y)};
        pixel.color = frames_.here.color.pixel(x, y);
        pixel.surface = &frames_.here.surface(pixel.p);
        if (!noise_.data.empty()) {
            const double* random = noise_.pixel(x % noise_.width, y % noise_.height);
            pixel.random = {random[0], random[1]};
        }
        pixel.block = &blocks_[block_index(x, y)];
        return pixel;
    }

    bool is_still(const Pixel& pixel) const { return pixel.block->longest_px <= s_.still_limit_px; }

    double samples_of(const Pixel& pixel) const {
        if (s_.lens) return s_.parameters.samples;
        const double path_px = 2 * s_.shutter->time_scale * pixel.block->longest_px;
        return std::clamp(path_px / s_.parameters.path_px_per_time, double(kMinTimes),
                          double(std::max(s_.parameters.samples, kMinTimes)));
    }

    // Time of sample k. The lens samples go outward, so the times beside them go by mirrored
    // digits, from the center on.
    double time_of(int k, double n, double part, double random) const {
        // n intervals of one length, the last cut off at the end of the shutter.
        if (!s_.lens)
            return 2 * (k + 0.5 * part + 0.5 * part * s_.parameters.time_jitter * random) / n - 1;
        const auto mirrored = [](int number) {
            double digits = 0, place = 0.5;
            for (int rest = number; rest > 0; rest /= 2, place /= 2) digits += place * (rest % 2);
            return digits;
        };
        int before = 0;
        for (int i = 0; i < int(n); ++i) before += mirrored(i) < mirrored(k);
        const double turns = (before + 0.5 + std::floor(n / 2)) / n + 0.5 * random;
        return 2 * (turns - std::floor(turns)) - 1;
    }

    Sample sample_at(int k, double n, const Pixel& pixel) const {
        const Vec random = pixel.random;
        const double part = std::min(1.0, n - k);
        Sample sample;
        sample.weight = part;
        if (s_.shutter)
            sample.u =
                s_.shutter->time_shift + s_.shutter->time_scale * time_of(k, n, part, random.y);
        if (s_.lens) {
            const bool turned =
                s_.shutter && n >= kFewestTurned && n <= kMostTurned && k < int(n) / 2;
            const double turn = random.x + (turned ? 0.5 * random.y : 0);
            const int table =
                std::min(int((turn - std::floor(turn)) * points_.sets), points_.sets - 1);
            const auto point = points_.at(k, table);
            sample.lens = {point[0], point[1]};
        }
        const double golden = random.x + 0.618034 * k;
        sample.depth_ratio =
            kMinDepthRatio + (kMaxDepthRatio - kMinDepthRatio) * (golden - std::floor(golden));
        return sample;
    }

    // A ray through this lens sample comes from the place where the pixel sees infinity. The
    // barrel's circle is moved against it, by cats_eye if the place is a corner of the frame.
    bool passes_barrel(const Pixel& pixel, const Sample& now) const {
        if (!s_.lens || s_.lens->aperture.cats_eye == 0) return true;
        // On the display, in shorter sides of a pixel.
        const auto& axes = s_.lens->coc.axes;
        const auto on_display = [&](Vec px) { return Vec{px.x / axes[0], px.y / axes[1]}; };
        const Vec size = {double(description_.display_width), double(description_.display_height)};
        const Vec origin = {double(description_.origin_x), double(description_.origin_y)};
        const Vec from = pixel.p - s_.lens->coc.radius_px(0) * now.lens;
        const Vec place = on_display(from + origin + Vec{0.5, 0.5} - 0.5 * size);
        const Vec display = on_display(size);
        const double half_diagonal = 0.5 * std::sqrt(dot(display, display));
        const Vec passed =
            on_display(now.lens) + s_.lens->aperture.cats_eye / half_diagonal * place;
        return dot(passed, passed) <= 1;
    }

    Hit resolve(const Pixel& pixel, const Sample& now, const Search& here) const {
        const Vec far =
            frames_.here.inside(pixel.p - here.far.displacement(now, frames_.half_open));
        const Vec at = here.nearest.inverse_depth >= 0 ? here.nearest.at : far;
        const Found found = resolve_occluded(frames_, background_, pixel, now, here);
        const Continuation continued =
            find_continuation(frames_, background_, pixel, now, here, found.inverse_depth);
        if (continued.inverse_depth >= 0)
            return {from(kEstimated, background_.continued_color(continued.sides, continued.at)),
                    continued.inverse_depth, continued.path, continued.at};
        if (found.inverse_depth >= 0)
            return {shown_color(found), found.inverse_depth, found.path, at};
        const Color far_color = color_at(frames_.here.color, here.far_at);
        return {from(kEstimated, background_.at(far, here.far.inverse_depth, far_color)),
                here.far.inverse_depth, here.far.a, at};
    }

    Color shown_color(const Found& found) const {
        const Color color = color_at(found.frame->color, found.at);
        if (found.frame != &frames_.here) return from(kFromNeighbor, color);
        return found.beyond ? from(kEstimated, color) : color;
    }

    // The color, with all shares of the fill mask moved to this channel of it.
    Color from(size_t source, Color color) const {
        if (description_.fill_layer < 0) return color;
        const auto mask = color.begin() + 4 * (1 + description_.fill_layer);
        const double whole = std::accumulate(mask, mask + 3, 0.0);
        std::fill_n(mask, 4, 0.0);
        mask[std::ptrdiff_t(source)] = whole;
        return color;
    }

    // With the shutter alone, a search begins at the surface that the search of the previous time
    // sample has found.
    Sums gather(const Pixel& pixel) const {
        Sums sums = no_samples(color_.channels);
        Surface begin = *pixel.surface;
        const double n = samples_of(pixel);
        for (int k = 0; k < n; ++k) {
            const Sample now = sample_at(k, n, pixel);
            if (!passes_barrel(pixel, now)) continue;
            const Search found = search(frames_, pixel, now, begin, !s_.lens);
            accumulate(sums, pixel, now, resolve(pixel, now, found), s_);
        }
        return sums;
    }

    void store_hint(const Pixel& pixel, std::array<double, 2> of_shutter, double of_given) {
        const auto given = frame_.planes.find(Role::hint);
        for (int c = 0; c < 2; ++c)
            if (s_.shutter)
                hint_.at(pixel.x, pixel.y, c) = of_shutter[size_t(c)];
            else if (given != frame_.planes.end())
                hint_.at(pixel.x, pixel.y, c) = of_given * given->second.at(pixel.x, pixel.y, c);
    }

    void store_unchanged(const Pixel& pixel) {
        std::copy_n(pixel.color, color_.channels, color_.pixel(pixel.x, pixel.y));
        std::copy_n(pixel.color, color_.channels, soft_.pixel(pixel.x, pixel.y));
        store_hint(pixel, {0, 0}, 1);
    }

    // small_circles.glsl. Radius of the disc that blurs like the pixel's circle, px.
    double disc_radius(const Pixel& pixel) const {
        return std::abs(pixel.surface->radius) * float(disc_scale_.value_or(0));
    }

    // The radius of the table's row from which the pixel's weights are taken, and the next one.
    std::array<int, 2> rows_of(const Pixel& pixel) const {
        const int row =
            std::min(int(disc_radius(pixel) / SMALL_CIRCLES_STEP), SMALL_CIRCLES_RADII - 2);
        return {row, row + 1};
    }

    int reach_of(const Pixel& pixel) const {
        const double most = SMALL_CIRCLES_STEP * rows_of(pixel)[1];
        return std::min(int(std::ceil(most)) + 2, SMALL_CIRCLES_REACH_PX);
    }

    // Is the circle of confusion small, and do the pixels around show one still surface?
    bool is_filled_by_one(const Pixel& pixel) const {
        if (!disc_scale_ || pixel.block->starts.size() != 1 ||
            disc_radius(pixel) > SMALL_CIRCLES_STEP * (SMALL_CIRCLES_RADII - 1))
            return false;
        const int reach = reach_of(pixel);
        for (int j = -reach; j <= reach; ++j)
            for (int i = -reach; i <= reach; ++i) {
                const Surface& s =
                    frames_.here.surface(frames_.here.inside(pixel.p + Vec{double(i), double(j)}));
                if (s.edge || (s_.shutter && s.path() > kFilledStillPx) ||
                    std::abs(s.radius - pixel.surface->radius) > kOneRadiusPx)
                    return false;
            }
        return true;
    }

    // The sum over the pixels around, without negative weights if it leaves the colors of those
    // that the circle reaches.
    void store_circle(const Pixel& pixel) {
        static constexpr float kWeights[] = {SMALL_CIRCLES_WEIGHTS};
        const auto variance = [](int row) { return std::pow(SMALL_CIRCLES_STEP * row, 2); };
        const auto [row, next] = rows_of(pixel);
        const double part =
            (std::pow(disc_radius(pixel), 2) - variance(row)) / (variance(next) - variance(row));
        const double onset =
            s_.still_limit_px > 0
                ? std::clamp(2 * (std::abs(pixel.surface->radius) / s_.still_limit_px - 1), 0.0,
                             1.0)
                : 1;
        const int reach = reach_of(pixel);
        struct Sum {
            double mean, least, most;  // the last two: of the values that the circle reaches
        };
        const auto sum_of = [&, row = row, next = next](int c, double least_weight) {
            const double own = pixel.color[c];
            Sum found = {0, own, own};
            double total = 0;
            for (int j = -reach; j <= reach; ++j)
                for (int i = -reach; i <= reach; ++i) {
                    const int x = std::max(std::abs(i), std::abs(j));
                    const int place = x * (x + 1) / 2 + std::min(std::abs(i), std::abs(j));
                    const double weight = std::max(
                        std::lerp(double(kWeights[row * SMALL_CIRCLES_PLACES + place]),
                                  double(kWeights[next * SMALL_CIRCLES_PLACES + place]), part),
                        least_weight);
                    const Vec at = frames_.here.inside(pixel.p + Vec{double(i), double(j)});
                    const double value = frames_.here.color.at(int(at.x), int(at.y), c);
                    found.mean += weight * (value - own);
                    total += weight;
                    if (std::hypot(i, j) > std::abs(pixel.surface->radius) + 1) continue;
                    found.least = std::min(found.least, value);
                    found.most = std::max(found.most, value);
                }
            found.mean = own + found.mean / total;
            return found;
        };
        double least_weight = -1;
        for (int c = 0; c < 4; ++c) {
            const Sum sum = sum_of(c, -1);
            if (sum.mean < sum.least || sum.mean > sum.most) least_weight = 0;
        }
        for (int c = 0; c < color_.channels; ++c) {
            const double own = pixel.color[c];
            color_.at(pixel.x, pixel.y, c) = own + onset * (sum_of(c, least_weight).mean - own);
            soft_.at(pixel.x, pixel.y, c) = own;
        }
        store_hint(pixel, {1, 0}, std::clamp(1 - std::abs(pixel.surface->radius), 0.0, 1.0));
    }

    // The longest displacement of the pixel's own surface and of what its samples saw. An even disc
    // has half of the squared radius as its second moment.
    double longest_seen_px(const Pixel& pixel, const Sums& sums) const {
        const double moment = sums.weight > 0 ? sums.moment / sums.weight : 0;
        const double seen = std::sqrt(std::max(sums.longest_path, 2 * moment));
        return std::min(std::max(longest(*pixel.surface, s_), seen), pixel.block->longest_px);
    }

    // The mean, and over it, by its part, the surface that stays in front: the pixel's color with
    // the front's in place of the other part.
    Color with_front_over(const Pixel& pixel, const Sums& sums) const {
        const Surface& s = *pixel.surface;
        const auto at = [&](Vec offset) {
            return color_at(frames_.here.color, frames_.here.inside(pixel.p + offset));
        };
        const Color front = at(s.front_from), back = at(s.color_from.value_or(Vec{}));
        Color both(size_t(color_.channels));
        for (size_t c = 0; c < both.size(); ++c) {
            const double own = pixel.color[c];
            const double mean = own + (sums.weight > 0 ? sums.color[c] / sums.weight : 0);
            const double held = own + (1 - s.front_part) * (front[c] - back[c]);
            both[c] = mean + s.front_part * (held - mean);
        }
        return both;
    }

    void store_mean(const Pixel& pixel, const Sums& sums) {
        const int x = pixel.x, y = pixel.y;
        // From 0 at the limit to 1 at twice that.
        const double onset =
            s_.still_limit_px > 0
                ? std::clamp(longest_seen_px(pixel, sums) / s_.still_limit_px - 1, 0.0, 1.0)
                : 1;
        const double mean_of = sums.weight > 0 ? onset / sums.weight : 0;
        const double mean_of_soft = 1 / std::max(sums.soft.weight, 1e-6);
        const Color shown = with_front_over(pixel, sums);
        for (int c = 0; c < color_.channels; ++c) {
            color_.at(x, y, c) = std::lerp(pixel.color[c], shown[size_t(c)], onset);
            soft_.at(x, y, c) = pixel.color[c] + mean_of_soft * sums.soft.color[size_t(c)];
        }
        share_.at(x, y) = (1 - pixel.surface->front_part) * mean_of * sums.soft.weight;
        for (int c = 0; c < 3; ++c)
            spread_.at(x, y, c) = mean_of_soft * sums.soft.spread[size_t(c)];
        const double in_focus = std::clamp(1 - std::abs(pixel.surface->radius), 0.0, 1.0);
        store_hint(pixel, {1, noise_gate(sums)}, in_focus);
    }

    // The stages of denoising, packed as their textures are: the share beside the red, green and
    // blue of blurred samples, their alpha beside the covariance's Cholesky factor.
    void show_soft_stages() {
        ImageD soft = color_of_wide(soft_), with_alpha(width_, height_, 4);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const double l11 = std::sqrt(spread_.at(x, y, 0) + kPixelVariance);
                const double l21 = spread_.at(x, y, 1) / l11;
                with_alpha.at(x, y, 0) = l11;
                with_alpha.at(x, y, 1) = l21;
                with_alpha.at(x, y, 2) =
                    std::sqrt(spread_.at(x, y, 2) + kPixelVariance - l21 * l21);
                with_alpha.at(x, y, 3) = soft.at(x, y, 3);
                soft.at(x, y, 3) = share_.at(x, y);
            }
        frame_.stages["soft"] = std::move(soft);
        frame_.stages["spread"] = std::move(with_alpha);
    }

    const Settings& s_;
    const FrameDescription& description_;
    ReferenceFrame& frame_;
    const bool hint_wanted_;
    const int width_, height_;
    const Frames frames_;
    const std::vector<Block> blocks_;
    const Background background_;
    const ImageD noise_;
    lens::Points points_;
    std::optional<double> disc_scale_;  // lens::disc_radius()
    // As the textures hold them, colors wide.
    ImageD color_, soft_, share_, spread_, hint_;
};

}  // namespace
}  // namespace reference

void warp_reference(const PlanContext& context, const Settings& settings, ReferenceFrame& frame) {
    Settings held = settings;
    // As a float, like the depths: what is in focus has a radius of 0.
    if (held.lens) held.lens->coc.focus_inverse = float(held.lens->coc.focus_inverse);
    reference::Gather(context, held, frame).run();
}

}  // namespace postchain::inverse_warp

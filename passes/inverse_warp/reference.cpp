// Written from the definitions of docs/inverse_warp.md, one pixel at a time; the GLSL shares
// nothing with it but the random numbers and what storage rounds.
#include "passes/inverse_warp/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "chain/work_list.h"
#include "passes/common/lens_points.h"
#include "passes/common/wide_color.h"
#include "passes/inverse_warp/reference_adaptive.h"
#include "passes/inverse_warp/reference_background.h"
#include "passes/inverse_warp/reference_bright_edges.h"
#include "passes/inverse_warp/reference_denoise.h"
#include "passes/inverse_warp/reference_tiles.h"

namespace postchain::inverse_warp {
namespace {

using reference::Halves;
using reference::Sample;
using reference::Soft;
using reference::Surface;
using reference::Tile;
using reference::Vec;

constexpr double kAcceptPx = 0.75;
constexpr double kOneDepthLeast = 1.01, kOneDepthMost = 1.03;  // of samples
constexpr int kSteps = 2, kNeighborSteps = 3;
constexpr double kSharpening = 2;
constexpr int kLeastTimes = 5;

// Of a pixel: RGBA, and of the layers after it (wide_color.h).
using Color = std::vector<double>;

double norm(Vec v) {
    return std::sqrt(dot(v, v));
}

// A frame before or after.
struct OtherFrame {
    double offset = 0;  // frames
    ImageD color;       // wide
    std::vector<Surface> surfaces;
};

class Warp {
  public:
    Warp(const PlanContext& context, const Settings& settings, ReferenceFrame& frame)
        : s_(settings),
          description_(context.frame),
          frame_(frame),
          color_(wide_color(frame)),
          width_(context.frame.width),
          height_(context.frame.height),
          columns_((width_ + kBlockPx - 1) / kBlockPx),
          half_open_(reference::half_open_of(settings)),
          noise_(noise::table(settings.noise, context.frame.frame_number)),
          hint_wanted_(context.wanted.has(Role::hint)) {
        if (settings.lens)
            points_ =
                lens::lens_points(settings.lens->aperture, settings.samples, settings.more_samples);
        const auto neighbors = searched_neighbors(settings, context.available);
        const bool motion = settings.shutter || !neighbors.empty();
        const auto plane = [&](Role role, bool used) {
            return used && context.available.has(role) ? &frame.planes.at(role) : nullptr;
        };
        surfaces_ = reference::with_bright_edges(
            frame.planes.at(Role::color),
            reference::surfaces_of({&frame.planes.at(Role::inverse_depth),
                                    plane(Role::motion, motion), plane(Role::motion_back, motion)},
                                   settings),
            settings);
        for (const Neighbor neighbor : neighbors) {
            const auto of = [&](Role role) { return plane(role_of(neighbor, role), true); };
            others_.push_back(
                {neighbor == Neighbor::before ? -1.0 : 1.0,
                 wide_color(frame, role_of(neighbor, Role::color), role_of(neighbor, Role::layers)),
                 reference::with_bright_edges(
                     *of(Role::color),
                     reference::surfaces_of(
                         {of(Role::inverse_depth), of(Role::motion), of(Role::motion_back), true},
                         settings),
                     settings)});
        }
    }

    void run() {
        tiles_ = reference::tiles_of(surfaces_, width_, height_, s_);
        background_.emplace(color_, surfaces_);
        moments_.resize(surfaces_.size());
        find_shares_of_more();
        const int channels = color_.channels;
        ImageD color(width_, height_, channels), seen(width_, height_, channels);
        ImageD share(width_, height_, 1), spread(width_, height_, 3);
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                Soft blurred;
                const double more = shares_of_more_[tile_index(x, y)];
                const double of_mean = expose(x, y, more, blurred, color.pixel(x, y));
                const double of_soft = 1 / std::max(blurred.weight, 1e-6);
                blurred.sum.resize(size_t(channels));
                for (int c = 0; c < channels; ++c)
                    seen.at(x, y, c) = color_.at(x, y, c) + of_soft * blurred.sum[size_t(c)];
                share.at(x, y) = reference::finite(seen.pixel(x, y)) ? of_mean * blurred.weight : 0;
                // The window narrows with the root of the samples.
                const double narrower =
                    std::sqrt(s_.samples / (s_.samples + more * s_.more_samples));
                for (size_t c = 0; c < 3; ++c)
                    spread.at(x, y, int(c)) = narrower * of_soft * blurred.spread[c];
            }
        }
        if (s_.denoise) {
            show_soft(color, seen, share, spread);
            reference::denoise(s_, seen, share, spread, color);
        }
        set_wide_color(frame_, color);
        frame_.stages["color"] = frame_.planes.at(Role::color);
        make_hint();
    }

  private:
    // The stages of the denoising, packed as their textures are: the share beside red, green and
    // blue of what is seen, its alpha beside the covariance.
    void show_soft(const ImageD& gathered, const ImageD& seen, const ImageD& share,
                   const ImageD& spread) {
        ImageD soft = color_of_wide(seen), with_alpha(width_, height_, 4);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                std::copy_n(spread.pixel(x, y), 3, with_alpha.pixel(x, y));
                with_alpha.at(x, y, 3) = soft.at(x, y, 3);
                soft.at(x, y, 3) = share.at(x, y);
            }
        frame_.stages["gathered"] = color_of_wide(gathered);
        frame_.stages["soft"] = std::move(soft);
        frame_.stages["spread"] = std::move(with_alpha);
    }

    size_t index(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    size_t tile_index(int x, int y) const { return size_t(y / kBlockPx * columns_ + x / kBlockPx); }

    // Linear weights steepened about their middle.
    Color color_at(const ImageD& color, Vec at) const {
        const auto steep = [](double f) {
            return std::clamp(kSharpening * (f - 0.5) + 0.5, 0.0, 1.0);
        };
        const double fx = steep(at.x - std::floor(at.x)), fy = steep(at.y - std::floor(at.y));
        const int x0 = int(std::floor(at.x)), y0 = int(std::floor(at.y));
        const int x1 = std::min(x0 + 1, width_ - 1), y1 = std::min(y0 + 1, height_ - 1);
        Color c(size_t(color.channels));
        for (int i = 0; i < color.channels; ++i)
            c[size_t(i)] = (1 - fy) * ((1 - fx) * color.at(x0, y0, i) + fx * color.at(x1, y0, i)) +
                           fy * ((1 - fx) * color.at(x0, y1, i) + fx * color.at(x1, y1, i));
        if (reference::finite(c.data())) return c;
        // A weight of 0 times what is not finite is NaN: then the nearest pixel alone counts.
        const double* nearest = color.pixel(int(at.x + 0.5), int(at.y + 0.5));
        std::copy(nearest, nearest + color.channels, c.begin());
        return c;
    }

    // Sample k of a set of n, whose points of the lens follow `before` others. They go outward, so
    // the times beside them go by digits mirrored at the point.
    Sample sample(int x, int y, int k, double n, int before) const {
        const bool random = !noise_.data.empty();
        const double turn = random ? noise_.at(x % noise_.width, y % noise_.height, 0) : 0;
        const double shift = random ? noise_.at(x % noise_.width, y % noise_.height, 1) : 0;
        Sample sample;
        sample.number = k;
        if (s_.lens) {
            const int set = std::min(int(turn * points_.sets), points_.sets - 1);
            const auto point = points_.at(before + k, set);
            sample.lens = {point[0], point[1]};
        }
        const double golden = turn + 0.618034 * k;
        sample.one_depth =
            kOneDepthLeast + (kOneDepthMost - kOneDepthLeast) * (golden - std::floor(golden));
        if (!s_.shutter) return sample;
        if (!s_.lens) {
            // n intervals of one length, the last cut off at the end of the shutter.
            sample.weight = std::min(1.0, n - k);
            const double middle = k + 0.5 * sample.weight;
            const double aside = 0.5 * sample.weight * s_.shutter->time_jitter * shift;
            sample.u = 2 * (middle + aside) / n - 1;
            return sample;
        }
        double mirrored = 0, place = 0.5;
        for (int rest = k; rest > 0; rest /= 2, place /= 2) mirrored += place * (rest % 2);
        const double turns = mirrored + 0.5 / n + 0.5 + 0.5 * shift;
        sample.u = 2 * (turns - std::floor(turns)) - 1;
        return sample;
    }

    // A ray through this point of the lens comes from the place where the pixel sees infinity. The
    // barrel's circle is moved against it, by cats_eye where it is a corner of the picture.
    bool passes_barrel(Vec p, Vec point) const {
        if (!s_.lens || s_.lens->aperture.cats_eye == 0) return true;
        const Vec display = {double(description_.display_width),
                             double(description_.display_height)};
        const Vec origin = {double(description_.origin_x), double(description_.origin_y)};
        const Vec from = p - s_.lens->coc.radius_px(0) * point;
        const Vec place = from + origin + Vec{0.5, 0.5} - 0.5 * display;
        return norm(point + s_.lens->aperture.cats_eye / (0.5 * norm(display)) * place) <= 1;
    }

    // Which tiles take more samples, by the halves of all their pixels.
    void find_shares_of_more() {
        shares_of_more_.assign(tiles_.size(), 0);
        if (s_.more_samples == 0) return;
        std::vector<double> noise(tiles_.size()), pixels(tiles_.size());
        Color unused(size_t(color_.channels));
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                Soft blurred;
                Halves halves;
                expose(x, y, 0, blurred, unused.data(), &halves);
                noise[tile_index(x, y)] += halves.noise(color_.pixel(x, y));
                pixels[tile_index(x, y)] += 1;
            }
        }
        for (size_t i = 0; i < tiles_.size(); ++i) {
            shares_of_more_[i] = reference::share_of_more(noise[i] / pixels[i], s_.samples);
        }
    }

    // The pixel's color, and what part of its mean a sample is. more: the weight of the samples
    // beyond the first set; 0: they are not taken.
    double expose(int x, int y, double more, Soft& blurred, double* out, Halves* halves = nullptr) {
        const Tile& t = tiles_[tile_index(x, y)];
        const auto channels = size_t(color_.channels);
        const double* own = color_.pixel(x, y);
        std::copy(own, own + channels, out);
        double& moment = moments_[index(x, y)];
        moment = 0;
        if (t.longest <= s_.still_limit_px) return 0;
        double n = s_.samples;
        if (!s_.lens)
            n = std::clamp(2 * t.longest / s_.shutter->path_px_per_time, double(kLeastTimes),
                           std::max(n, double(kLeastTimes)));
        Surface begin = surfaces_[index(x, y)];
        const Vec p = {double(x), double(y)};
        Color sum(channels);  // of the differences to the pixel's own color
        const auto add = [&](const Seen& seen, const Sample& now) {
            const double weight = now.weight;
            Color difference(channels);
            for (size_t c = 0; c < channels; ++c) {
                difference[c] = seen.color[c] - own[c];
                sum[c] += weight * difference[c];
            }
            blurred.add(s_, difference, seen.inverse_depth, seen.path, weight);
            if (halves) halves->add(now.number, difference, weight);
        };
        double counted = 0;
        const auto take = [&](double count, int before) {
            for (int k = 0; k < count; ++k) {
                Sample now = sample(x, y, k, count, before);
                if (before > 0) now.weight = more;
                if (!passes_barrel(p, now.lens)) continue;
                counted += now.weight;
                const Met met = search(p, now, t, begin);
                moment += now.weight * dot(met.at - p, met.at - p);
                const Seen elsewhere = seen_by_others(p, now, t, met);
                if (elsewhere.inverse_depth >= 0)
                    add(elsewhere, now);
                else if (met.found)
                    add({color_at(color_, met.at), met.inverse_depth, met.path}, now);
                else
                    add({background_->at(met.at, met.inverse_depth, color_at(color_, met.far_at)),
                         met.inverse_depth, met.path},
                        now);
            }
        };
        take(n, 0);
        if (more > 0) take(s_.more_samples, s_.samples);
        if (counted == 0) return 0;
        moment /= counted;
        // From nothing at the limit to all of it at twice that.
        const double onset =
            s_.still_limit_px > 0 ? std::min(t.longest / s_.still_limit_px - 1, 1.0) : 1;
        const double of_mean = onset / counted;
        for (size_t c = 0; c < channels; ++c) out[c] = own[c] + of_mean * sum[c];
        return of_mean;
    }

    // Of a shutter: 1, and whether the streak's half-length is above 0.5 px. Of the lens alone the
    // hint that there is, less where the pixel itself is out of focus.
    void make_hint() {
        const auto given = frame_.planes.find(Role::hint);
        if (!hint_wanted_ || (!s_.shutter && given == frame_.planes.end())) return;
        ImageD hint(width_, height_, 2);
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                const bool still = tiles_[tile_index(x, y)].longest <= s_.still_limit_px;
                double* out = hint.pixel(x, y);
                if (!s_.shutter) {
                    const double radius = std::abs(surfaces_[index(x, y)].radius);
                    const double kept = still ? 1 : std::clamp(1 - radius, 0.0, 1.0);
                    for (int c = 0; c < 2; ++c) out[c] = kept * given->second.at(x, y, c);
                } else if (!still) {
                    out[0] = 1;
                    out[1] = std::sqrt(3 * moments_[index(x, y)]) > 0.5 ? 1 : 0;
                }
            }
        }
        frame_.stages["hint"] = hint;
        frame_.planes[Role::hint] = std::move(hint);
    }

    // What a sample meets in this frame.
    struct Met {
        bool found = false;
        Vec at;  // the place that it sees; where nothing is found, of what is hidden there
        double inverse_depth = 0;
        Vec path;                   // of that surface, a
        Surface far;                // the farthest surface met
        Vec far_at;                 // its pixel
        bool shows_behind = false;  // the farthest is behind what the first step has come to
        std::vector<bool> hidden;   // of each start: what is not farther stands in its way, or
                                    // it lies beyond the picture
    };

    // A color, and of its surface the inverse depth, -1 where there is none, and the path, a.
    struct Seen {
        Color color;
        double inverse_depth = -1;
        Vec path;
    };

    // Of the shutter alone `begin` becomes what the search from it has found.
    Met search(Vec p, const Sample& now, const Tile& t, Surface& begin) const {
        double nearest = -1, residual = kAcceptPx, far_residual = 3.4e38, first = -1;
        Vec found, far_at, path;
        Surface far;
        far.inverse_depth = 3.4e38;
        const auto nearer = [&](double a, double b) { return a > b * now.one_depth; };
        std::vector<bool> hidden_starts(t.starts.size());
        const auto from = [&](Vec d, int steps, Surface* accepted_surface, size_t start) {
            for (int step = 0; step < steps; ++step) {
                const double x = std::floor(p.x - d.x + 0.5), y = std::floor(p.y - d.y + 0.5);
                const Vec inside = clamped({x, y});
                const bool beyond = inside.x != x || inside.y != y;
                const Surface& s = surfaces_[index(int(inside.x), int(inside.y))];
                d = s.at(now, half_open_);
                if (first < 0) first = s.inverse_depth;
                const Vec to = p - d;
                const double error = std::max(std::abs(x - to.x), std::abs(y - to.y));
                if (nearer(far.inverse_depth, s.inverse_depth) ||
                    (!nearer(s.inverse_depth, far.inverse_depth) && error < far_residual)) {
                    far = s;
                    far_residual = error;
                    far_at = inside;
                }
                // What lies beyond the picture a neighbor may have seen.
                if (error > kAcceptPx || (beyond && !others_.empty())) {
                    if (start < t.starts.size() &&
                        (beyond || !nearer(t.starts[start].inverse_depth, s.inverse_depth)))
                        hidden_starts[start] = true;
                    continue;
                }
                if (nearer(s.inverse_depth, nearest) ||
                    (!nearer(nearest, s.inverse_depth) && error < residual)) {
                    nearest = s.inverse_depth;
                    residual = error;
                    found = s.edge ? inside : clamped(to);
                    path = s.a;
                }
                if (accepted_surface) *accepted_surface = s;
                return;
            }
        };
        from(begin.at(now, half_open_), s_.shutter ? kSteps : 1, s_.lens ? nullptr : &begin,
             t.starts.size());
        // What the search from p has found hides what is not nearer; what a start has found hides
        // what is farther.
        double hidden = nearest * now.one_depth;
        for (size_t i = 0; i < t.starts.size(); ++i) {
            if (t.starts[i].inverse_depth <= hidden) break;
            from(t.starts[i].at(now, half_open_), kSteps, nullptr, i);
            hidden = std::max(hidden, nearest / now.one_depth);
        }
        const bool behind_first = nearer(first, far.inverse_depth);
        if (nearest >= 0)
            return {true, found, nearest, path, far, far_at, behind_first, hidden_starts};
        const Vec behind = clamped(p - far.at(now, half_open_));
        return {false, behind, far.inverse_depth, far.a, far, far_at, behind_first, hidden_starts};
    }

    // What other frames saw there nearer than this one. In each frame, the nearer in time first:
    // from the farthest surface met where this frame has found nothing, and from the starts that
    // are hidden in it. Nothing counts that is farther than the farthest surface met, where that
    // is behind another. Pixels at edges, which show two surfaces, count where nothing else is
    // found.
    Seen seen_by_others(Vec p, const Sample& now, const Tile& t, const Met& met) const {
        std::vector<const OtherFrame*> frames;
        for (const OtherFrame& other : others_) frames.push_back(&other);
        if (frames.size() == 2 && now.u >= 0) std::swap(frames[0], frames[1]);
        double nearest = met.found ? met.inverse_depth : -1;
        const double farthest = met.shows_behind ? met.far.inverse_depth : 0;
        const auto nearer = [&](double depth) { return depth > nearest * now.one_depth; };
        Seen seen;
        const auto search = [&](const OtherFrame& other, Surface begin) {
            if (!nearer(begin.inverse_depth)) return;
            Sample then = now;
            then.u -= other.offset / half_open_;
            begin.b = {};  // a parabola about this frame is none about that one
            Vec d = begin.at(then, half_open_);
            for (int step = 0; step < kNeighborSteps; ++step) {
                const Vec x = clamped({std::floor(p.x - d.x + 0.5), std::floor(p.y - d.y + 0.5)});
                const Surface& s = other.surfaces[index(int(x.x), int(x.y))];
                d = s.at(then, half_open_);
                const Vec off = x - p + d;
                if (std::max(std::abs(off.x), std::abs(off.y)) > kAcceptPx ||
                    (s.edge && nearest >= 0) || !nearer(s.inverse_depth) ||
                    s.inverse_depth * now.one_depth < farthest || shows_farther(s, x, other, now))
                    continue;
                nearest = s.inverse_depth;
                const Vec where = s.edge ? x : clamped(p - d);
                seen = {color_at(other.color, where), s.inverse_depth, s.a};
            }
        };
        if (!met.found)
            for (const OtherFrame* other : frames) search(*other, met.far);
        for (size_t i = 0; i < t.starts.size(); ++i)
            for (const OtherFrame* other : frames)
                if (met.hidden[i]) search(*other, t.starts[i]);
        return seen;
    }

    // Does this frame show what is farther than surface s where s would stand in it? x: its pixel
    // in the other frame
    bool shows_farther(const Surface& s, Vec x, const OtherFrame& other, const Sample& now) const {
        Sample here;  // at the middle of the lens
        here.u = -other.offset / half_open_;
        const Vec at = x + s.at(here, half_open_);
        const double px = std::floor(at.x + 0.5), py = std::floor(at.y + 0.5);
        if (px < 0 || py < 0 || px >= width_ || py >= height_) return false;
        return surfaces_[index(int(px), int(py))].inverse_depth * now.one_depth < s.inverse_depth;
    }

    Vec clamped(Vec at) const {
        return {std::clamp(at.x, 0.0, width_ - 1.0), std::clamp(at.y, 0.0, height_ - 1.0)};
    }

    const Settings& s_;
    const FrameDescription& description_;
    ReferenceFrame& frame_;
    const ImageD color_;  // wide
    int width_, height_, columns_;
    double half_open_;
    ImageD noise_;
    lens::Points points_;
    bool hint_wanted_;
    std::vector<Surface> surfaces_;
    std::vector<OtherFrame> others_;
    std::vector<Tile> tiles_;
    std::optional<reference::Background> background_;
    std::vector<double> shares_of_more_;  // of each tile: weight of the samples beyond the first
    std::vector<double> moments_;         // of each pixel: mean of the squared displacements, px^2
};

}  // namespace

void warp_reference(const PlanContext& context, const Settings& settings, ReferenceFrame& frame) {
    Warp(context, settings, frame).run();
}

}  // namespace postchain::inverse_warp

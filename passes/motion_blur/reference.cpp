// Written from the definitions of docs/motion_blur.md, stage by stage, one pixel at a time; the
// GLSL shares only the random numbers (noise.h) and the still limit. One long file, because six
// stages pass on their planes.
#include "passes/motion_blur/reference.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "passes/common/noise.h"
#include "passes/common/wide_color.h"
#include "passes/motion_blur/guertin.h"

namespace postchain::motion_blur {
namespace {

struct Vec {
    double x = 0, y = 0;
};
Vec operator*(double s, Vec v) {
    return {s * v.x, s * v.y};
}
Vec operator+(Vec a, Vec b) {
    return {a.x + b.x, a.y + b.y};
}
double dot(Vec a, Vec b) {
    return a.x * b.x + a.y * b.y;
}
double length(Vec v) {
    return std::sqrt(dot(v, v));
}
Vec unit(Vec v) {
    return 1 / length(v) * v;
}
double rho(Vec v) {
    return std::max(length(v), 0.5);
}
double clamp01(double x) {
    return std::clamp(x, 0.0, 1.0);
}

double cone(double distance, double inverse_radius) {
    return clamp01(1 - distance * inverse_radius);
}
double cylinder(double distance, double radius) {
    const double x = clamp01((distance - 0.95 * radius) / (1.05 * radius - 0.95 * radius));
    return 1 - x * x * (3 - 2 * x);
}

// A tile's vector: v as stored, its squared length before the clamp, the smallest |v|.
struct Tile {
    Vec v;
    double squared = -1;
    double smallest = 0;
};

// Nearest number of 11 significant bits.
double to_half(double x) {
    int exponent = 0;
    std::frexp(x, &exponent);
    const double quantum = std::ldexp(1.0, std::max(exponent - 11, -24));
    return std::nearbyint(x / quantum) * quantum;
}

class Reference {
  public:
    Reference(const Parameters& parameters, const PlanContext& context, ReferenceFrame& frame)
        : p_(parameters),
          frame_(frame),
          storage_(parameters.velocity_storage),
          edge_(tile_px(parameters, context.frame)),
          width_(context.frame.width),
          height_(context.frame.height),
          columns_((width_ + edge_ - 1) / edge_),
          rows_((height_ + edge_ - 1) / edge_),
          half_shutter_(0.5 * shutter::open_frames(parameters.shutter, context.frame.camera)),
          still_limit_(still_limit_px(parameters, edge_)),
          hint_(context.wanted.has(Role::hint)) {
        if (jitters_tiles(p_) || jitters_taps(p_))
            noise_ = noise::table(p_.noise, context.frame.frame_number);
    }

    void run() {
        half_velocities();
        tile_max();
        neighbor_max();
        if (p_.sample_split == SampleSplit::variance && p_.mode == Mode::guertin) tile_variance();
        if (!noise_.empty()) frame_.stages["noise"] = noise_;
        gather();
    }

  private:
    bool single() const { return p_.mode == Mode::single; }

    void half_velocities() {
        const ImageD& motion = frame_.planes.at(Role::motion);
        ImageD stored(width_, height_, 2);
        velocity_.resize(motion.pixels());
        squared_.resize(motion.pixels());
        for (int y = 0; y < height_; ++y) {
            for (int x = 0; x < width_; ++x) {
                Vec m{motion.at(x, y, 0), motion.at(x, y, 1)};
                if (!std::isfinite(m.x) || !std::isfinite(m.y)) m = {};
                m = 1 / std::max({std::abs(m.x) / 1e15, std::abs(m.y) / 1e15, 1.0}) * m;
                Vec v = half_shutter_ * m;
                const size_t i = index(x, y);
                squared_[i] = dot(v, v);
                if (length(v) > edge_) v = edge_ / length(v) * v;
                stored.at(x, y, 0) = store(v.x);
                stored.at(x, y, 1) = store(v.y);
                velocity_[i] = {load(stored.at(x, y, 0)), load(stored.at(x, y, 1))};
            }
        }
        if (storage_ != VelocityStorage::automatic)
            frame_.stages["half_velocity"] = std::move(stored);
    }

    double store(double x) const {
        if (storage_ == VelocityStorage::fp16) return to_half(x);
        if (storage_ == VelocityStorage::unorm8)
            return (128 + std::nearbyint(127 * x / edge_)) / 255;
        return x;
    }
    double load(double x) const {
        if (storage_ == VelocityStorage::unorm8)
            return (std::nearbyint(255 * x) - 128) * edge_ / 127;
        return x;
    }

    // The longest vector of the pixels [x0, x1) x [y0, y1); on a tie the first in row order.
    Tile longest(int x0, int y0, int x1, int y1) const {
        Tile tile;
        tile.smallest = edge_;
        for (int y = y0; y < std::min(y1, height_); ++y) {
            for (int x = x0; x < std::min(x1, width_); ++x) {
                const size_t i = index(x, y);
                if (squared_[i] > tile.squared) {
                    tile.v = velocity_[i];
                    tile.squared = squared_[i];
                }
                tile.smallest = std::min(tile.smallest, length(velocity_[i]));
            }
        }
        return tile;
    }

    void tile_max() {
        ImageD stage(columns_, rows_, 4);
        tiles_.resize(stage.pixels());
        for (int j = 0; j < rows_; ++j) {
            for (int i = 0; i < columns_; ++i) {
                tile(i, j) = longest(i * edge_, j * edge_, (i + 1) * edge_, (j + 1) * edge_);
                put(stage, i, j, tile(i, j));
            }
        }
        frame_.stages["tile_max"] = std::move(stage);
    }

    void neighbor_max() {
        ImageD stage(columns_, rows_, 4);
        neighbors_.resize(tiles_.size());
        for (int j = 0; j < rows_; ++j) {
            for (int i = 0; i < columns_; ++i) {
                Tile best = tile(i, j);
                for (int oy : {-1, 0, 1}) {
                    for (int ox : {-1, 0, 1}) {
                        if (!in_grid(i + ox, j + oy)) continue;
                        const Tile& other = tile(i + ox, j + oy);
                        best.smallest = std::min(best.smallest, other.smallest);
                        // Two-sided: the blur reaches along +v and -v.
                        const double along_x = ox * other.v.x, along_y = oy * other.v.y;
                        const bool diagonal = ox != 0 && oy != 0;
                        const bool same =
                            (along_x > 0 && along_y > 0) || (along_x < 0 && along_y < 0);
                        if (diagonal && !same && !single()) continue;
                        if (other.squared > best.squared) {
                            best.v = other.v;
                            best.squared = other.squared;
                        }
                    }
                }
                neighbors_[size_t(j * columns_ + i)] = best;
                put(stage, i, j, best);
            }
        }
        frame_.stages["neighbor_max"] = std::move(stage);
    }

    void tile_variance() {
        variance_ = ImageD(columns_, rows_, 1);
        for (int j = 0; j < rows_; ++j) {
            for (int i = 0; i < columns_; ++i) {
                const Vec own = tile(i, j).v;
                if (length(own) < 0.5) continue;
                double sum = 0, count = 0;
                for (int y = j - 1; y <= j + 1; ++y) {
                    for (int x = i - 1; x <= i + 1; ++x) {
                        if (!in_grid(x, y) || length(tile(x, y).v) < 0.5) continue;
                        sum += std::abs(dot(unit(own), unit(tile(x, y).v)));
                        count += 1;
                    }
                }
                variance_.at(i, j) = clamp01(1 - sum / count);
            }
        }
        frame_.stages["tile_variance"] = variance_;
    }

    // Bilinear at (p + 0.5)/r - 0.5, border tiles repeated.
    double variance_at(int x, int y) const {
        const double tx = (x + 0.5) / edge_ - 0.5, ty = (y + 0.5) / edge_ - 0.5;
        double sum = 0;
        for (int j = int(std::floor(ty)); j <= int(std::floor(ty)) + 1; ++j)
            for (int i = int(std::floor(tx)); i <= int(std::floor(tx)) + 1; ++i)
                sum += (1 - std::abs(tx - i)) * (1 - std::abs(ty - j)) *
                       variance_.at(std::clamp(i, 0, columns_ - 1), std::clamp(j, 0, rows_ - 1));
        return sum;
    }

    // v_max at a pixel, of the tile chosen with jitter.
    Vec dominant_at(int x, int y) const {
        int i = x / edge_, j = y / edge_;
        if (jitters_tiles(p_)) {
            // Distances from the tile's borders in pixels: exact.
            const double lx = x - i * edge_ + 0.5, ly = y - j * edge_ + 0.5;
            const double ex = std::min(lx, edge_ - lx), ey = std::min(ly, edge_ - ly);
            const double e = std::min(ex, ey) / edge_;
            const double probability = std::max(0.0, 0.5 - p_.tile_jitter_slope * e);
            if (noise_.at(x % noise::kSize, y % noise::kSize, 0) < probability) {
                int ni = i, nj = j;
                if (ex <= ey)
                    ni += 2 * lx < edge_ ? -1 : 1;
                else
                    nj += 2 * ly < edge_ ? -1 : 1;
                if (in_grid(ni, nj)) {
                    i = ni;
                    j = nj;
                }
            }
        }
        // "If |v_max| < |v_c|, use v_c" cannot happen: the tile across a border takes the longest
        // vector of a neighborhood that has the pixel's own tile on its axis.
        return neighbors_[size_t(j * columns_ + i)].v;
    }

    void gather() {
        const ImageD color = wide_color(frame_);
        ImageD blurred(width_, height_, color.channels), hint(width_, height_, 2);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x)
                gather_pixel(color, x, y, blurred.pixel(x, y), hint.pixel(x, y));
        set_wide_color(frame_, blurred);
        frame_.stages["color"] = frame_.planes.at(Role::color);
        if (!hint_) return;
        frame_.stages["hint"] = hint;
        frame_.planes[Role::hint] = std::move(hint);
    }

    // f for the sample at S against p; with the two exchanged it is b.
    double in_front(double q_p, double q_s) const {
        if (p_.depth_softness == 0 || (q_p == 0 && q_s == 0)) return 1;
        return clamp01(1 - p_.depth_softness * (q_p / q_s - 1));
    }

    // Sums over the samples of a pixel.
    struct Sums {
        std::vector<double> color;  // weight times (sample - pixel)
        double weight = 0;          // the pixel's own included
        double moment = 0;          // weight times squared distance
    };

    void gather_pixel(const ImageD& color, int x, int y, double* out, double* hint) const {
        const double* own = color.pixel(x, y);
        std::copy(own, own + color.channels, out);
        const Vec v_max = dominant_at(x, y);
        if (length(v_max) <= still_limit_) return;

        const Vec v_c = velocity_[index(x, y)];
        const double speed = length(v_c);
        const bool dominant = p_.static_direction == StaticDirection::dominant;
        const Vec still = dominant ? unit(v_max) : unit({-v_max.y, v_max.x});
        const double share = clamp01((speed - 0.5) / p_.variance_threshold_px);
        const auto w_c = [&](Vec of_still) {
            return speed > 0 ? unit((1 - share) * of_still + share * unit(v_c)) : of_still;
        };
        // The side on which v_c lies, from the unscaled vectors: exactly 0 where v_c is v_max. On
        // neither side, both sides' samples count.
        const double side = dot(dominant ? v_max : Vec{-v_max.y, v_max.x}, v_c);
        Sums sums;
        sums.color.assign(size_t(color.channels), 0.0);
        gather_along(color, x, y, v_max, w_c(side < 0 ? -1 * still : still), sums);
        if (side == 0 && share > 0 && share < 1)
            gather_along(color, x, y, v_max, w_c(-1 * still), sums);
        for (int c = 0; c < color.channels; ++c)
            out[c] = own[c] + sums.color[size_t(c)] / sums.weight;
        hint[0] = 1;
        hint[1] = std::sqrt(3 * sums.moment / sums.weight) > 0.5 ? 1 : 0;
    }

    // Adds the samples along v_max and w_c, and the pixel itself.
    void gather_along(const ImageD& color, int x, int y, Vec v_max, Vec w_c, Sums& sums) const {
        const double* own = color.pixel(x, y);
        const Vec v_c = velocity_[index(x, y)];
        const Vec w_max = unit(v_max);
        const double reach = length(v_max);
        const bool by_variance = !variance_.empty();
        const double u = by_variance ? variance_at(x, y) : 0;
        const double j =
            jitters_taps(p_) ? noise_.at(x % noise::kSize, y % noise::kSize, 1) * p_.jitter : 0;
        const ImageD* depth =
            p_.depth_softness > 0 ? &frame_.planes.at(Role::inverse_depth) : nullptr;

        const int taps = p_.samples;
        sums.weight += taps / (p_.center_weight * rho(v_c));
        for (int i = 0; i < taps; ++i) {
            const double t = -1 + 2 * (i + 1 + j) / (taps + 1);
            const bool to_own = single()      ? false
                                : by_variance ? std::floor((i + 1) * u) > std::floor(i * u)
                                              : i % 2 == 1;
            const Vec d = to_own ? w_c : w_max;
            const double distance = std::abs(t) * reach;
            int sx = x + int(std::floor(t * reach * d.x + 0.5));
            int sy = y + int(std::floor(t * reach * d.y + 0.5));
            if (p_.border == Border::clamp) {
                sx = std::clamp(sx, 0, width_ - 1);
                sy = std::clamp(sy, 0, height_ - 1);
            } else if (!color.inside(sx, sy)) {
                continue;
            }
            const Vec v_s = velocity_[index(sx, sy)];
            double w_a = 1, w_b = 1;
            if (!single()) {
                w_a = std::abs(dot(w_c, d));
                w_b = length(v_s) > 0 ? std::abs(dot(v_s, d)) / length(v_s) : 0;
            }
            const double f = depth ? in_front(depth->at(x, y), depth->at(sx, sy)) : 1;
            const double b = depth ? in_front(depth->at(sx, sy), depth->at(x, y)) : 1;
            const double weight =
                f * cone(distance, 1 / rho(v_s)) * w_b + b * cone(distance, 1 / rho(v_c)) * w_a +
                2 * cylinder(distance, std::min(rho(v_s), rho(v_c))) * std::max(w_a, w_b);
            for (int c = 0; c < color.channels; ++c)
                sums.color[size_t(c)] += weight * (color.at(sx, sy, c) - own[c]);
            sums.weight += weight;
            sums.moment += weight * distance * distance;
        }
    }

    static void put(ImageD& stage, int x, int y, const Tile& tile) {
        double* out = stage.pixel(x, y);
        out[0] = tile.v.x;
        out[1] = tile.v.y;
        out[2] = tile.squared;
        out[3] = tile.smallest;
    }
    size_t index(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }
    bool in_grid(int i, int j) const { return i >= 0 && j >= 0 && i < columns_ && j < rows_; }
    Tile& tile(int i, int j) { return tiles_[size_t(j * columns_ + i)]; }

    const Parameters& p_;
    ReferenceFrame& frame_;
    VelocityStorage storage_;
    int edge_, width_, height_, columns_, rows_;
    double half_shutter_, still_limit_;
    bool hint_;
    ImageD noise_;                 // empty = no jitter
    std::vector<Vec> velocity_;    // half-velocities as stored
    std::vector<double> squared_;  // |v|^2 before the clamp
    std::vector<Tile> tiles_, neighbors_;
    ImageD variance_;  // empty = even split
};

}  // namespace

void run_reference(const Parameters& parameters, const PlanContext& context,
                   ReferenceFrame& frame) {
    Reference(parameters, context, frame).run();
}

}  // namespace postchain::motion_blur

#include "tools/stress/check.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "chain/convert.h"
#include "chain/planner.h"

namespace postchain::stress {
namespace {

// Bounds at one precision. fp16 stores a velocity to 2^-11 of itself, which moves taps, and a color
// too: a larger tolerance, and a change of the input that stands out of that.
struct Bounds {
    double range = 1e-6;     // of the largest |color| of the channel
    double tolerance;        // of mirror and reference, relative
    double fraction = 0.01;  // of pixels above it: taps and steps that round the other way, ties
    double eps;              // change of an input, relative
    double color = 4;        // factors
    double motion;           // of r px: a streak of that length crosses many edges
    double depth = 4;
};

Bounds bounds_of(Precision precision, int tile) {
    const bool half = precision == Precision::fp16;
    return {.tolerance = half ? 2e-2 : 1e-3, .eps = half ? 1e-2 : 1e-4, .motion = 0.25 * tile};
}

// A pixel jumps when it changes by more than this many times eps of the largest color.
constexpr double kJump = 20;
constexpr double kRelativeFloor = 1e-4;  // errors are relative to at least this part of the largest

bool equal_pixel(const ImageF& a, const ImageF& b, size_t pixel) {
    const size_t at = pixel * size_t(a.channels);
    return std::memcmp(&a.data[at], &b.data[at], size_t(a.channels) * sizeof(float)) == 0;
}

double largest(const ImageF& image) {
    double most = 0;
    for (float value : image.data) most = std::max(most, std::abs(double(value)));
    return most;
}

std::string place(const ImageF& image, size_t pixel) {
    return concat("at ", pixel % size_t(image.width), ",", pixel / size_t(image.width));
}

ImageF mirrored(const ImageF& image) {
    ImageF turned = image;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            std::copy_n(image.pixel(x, y), image.channels, turned.pixel(image.width - 1 - x, y));
    return turned;
}

FramePlanes mirrored(const FramePlanes& planes) {
    FramePlanes turned;
    for (const auto& [role, plane] : planes) {
        turned[role] = mirrored(plane);
        if (role == Role::motion || role == Role::motion_back)
            for (size_t i = 0; i < turned[role].data.size(); i += 2)
                turned[role].data[i] = -turned[role].data[i];
    }
    return turned;
}

// Uniform in [-1, 1], the same for the same index.
double noise(size_t index) {
    uint64_t state = (uint64_t(index) + 1) * 0x9e3779b97f4a7c15ull;
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9ull;
    state = (state ^ (state >> 27)) * 0x94d049bb133111ebull;
    return 2 * double((state ^ (state >> 31)) >> 11) / double(1ull << 53) - 1;
}

// The nearest half, ties to even; beyond the largest half the value stays as it is.
float as_half(float value) {
    if (std::abs(value) > 65504) return value;
    int exponent = 0;
    std::frexp(value, &exponent);
    // 11 significant bits, fewer below 2^-14: the smallest step is 2^-24.
    const int step = std::max(exponent - 11, -24);
    return float(std::ldexp(std::nearbyint(std::ldexp(double(value), -step)), step));
}

// With fp16 the color comes as a half file brings it, so that what is exact has to be exact there
// too. Colors that no half holds stay: what becomes of them is a limit.
Cell at_precision(const Cell& cell, Precision precision) {
    Cell stored = cell;
    if (precision == Precision::fp16)
        for (float& value : stored.planes.at(Role::color).data) value = as_half(value);
    return stored;
}

// The frame with its facts found anew.
FrameDescription facts_of(FrameDescription frame, FramePlanes& planes) {
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    // Sizes and encoding are those of a frame that was converted before.
    if (!convert_frame(planes, frame, options).ok()) frame.width = 0;
    return frame;
}

class Measurement {
  public:
    Measurement(Executor& executor, const Subject& subject, const Cell& cell, Precision precision)
        : executor_(executor),
          subject_(subject),
          cell_(cell),
          precision_(precision),
          bounds_(bounds_of(precision, tile_px(subject.chain))) {}

    Result<std::vector<Measured>> all() {
        auto out = filter(subject_.chain, cell_.frame, cell_.planes, false);
        if (!out.ok()) return out.status();
        out_ = std::move(*out);
        finite();
        range();
        for (auto check : {&Measurement::constant, &Measurement::lean, &Measurement::mirror,
                           &Measurement::reference, &Measurement::continuity})
            if (Status status = (this->*check)(); !status.ok()) return status;
        identity();
        if (cell_.row == "nonfinite")
            add("counted",
                std::abs(double(cell_.nonfinite_placed) - double(cell_.nonfinite_counted)), 0,
                concat(cell_.nonfinite_placed, " put in"));
        return std::move(measured_);
    }

  private:
    const ImageF& color() const { return cell_.planes.at(Role::color); }

    Result<ImageF> filter(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, bool elide) {
        PlanOptions options;
        options.precision = precision_;
        options.elide = elide;
        auto plan = make_plan(chain, frame, options);
        if (!plan.ok()) return plan.status();
        auto out = executor_.filter(*plan, planes);
        if (!out.ok()) return out.status();
        return std::move(out->at(Role::color));
    }

    // NaN is never inside a bound.
    void add(const char* check, double value, double bound, std::string note) {
        Measured one{check, value <= bound ? Verdict::ok : Verdict::failed, value, bound, {}};
        if (one.verdict != Verdict::ok) one.note = std::move(note);
        measured_.push_back(std::move(one));
    }

    // Pixels of `a` that are not those of `b`, bit for bit.
    void add_equal(const char* check, const ImageF& a, const ImageF& b) {
        size_t different = 0, first = 0;
        for (size_t i = a.pixels(); i-- > 0;) {
            if (equal_pixel(a, b, i)) continue;
            ++different;
            first = i;
        }
        double worst = 0;
        for (size_t i = 0; i < a.data.size(); ++i)
            worst = std::max(worst, std::abs(double(a.data[i]) - double(b.data[i])));
        add(check, double(different) / double(a.pixels()), 0,
            concat("of all pixels differ, first ", place(a, first),
                   ", largest change relative to the largest color ", worst / largest(b)));
    }

    void finite() {
        size_t bad = 0, first = 0;
        for (size_t i = out_.data.size(); i-- > 0;) {
            if (std::isfinite(out_.data[i])) continue;
            ++bad;
            first = i;
        }
        add("finite", double(bad), 0, place(out_, first / 4));
    }

    void range() {
        double worst = 0;
        size_t at = 0;
        for (size_t c = 0; c < 4; ++c) {
            double low = INFINITY, high = -INFINITY;
            for (size_t i = c; i < color().data.size(); i += 4) {
                low = std::min(low, double(color().data[i]));
                high = std::max(high, double(color().data[i]));
            }
            const double scale = std::max({std::abs(low), std::abs(high), 1e-30});
            for (size_t i = c; i < out_.data.size(); i += 4) {
                const double value = out_.data[i];
                const double off = std::max(value - high, low - value) / scale;
                if (off <= worst) continue;  // also skips NaN, which `finite` counts
                worst = off;
                at = i / 4;
            }
        }
        add("range", worst, bounds_.range, place(out_, at));
    }

    // The cell's depth, motion and lens under one color: in each channel its largest.
    Status constant() {
        FramePlanes planes = cell_.planes;
        ImageF& flat = planes[Role::color];
        float most[4] = {0, 0, 0, 0};
        for (size_t i = 0; i < flat.data.size(); ++i)
            if (std::abs(flat.data[i]) > std::abs(most[i % 4])) most[i % 4] = flat.data[i];
        for (size_t i = 0; i < flat.data.size(); ++i) flat.data[i] = most[i % 4];
        auto out = filter(subject_.chain, cell_.frame, planes, false);
        if (!out.ok()) return out.status();
        add_equal("constant", *out, flat);
        return Status();
    }

    Status lean() {
        auto out = filter(subject_.chain, cell_.frame, cell_.planes, true);
        if (!out.ok()) return out.status();
        add_equal("lean", *out, out_);
        return Status();
    }

    // What drives a pass is read from the planes it asks for: motion; else depth; else color.
    void identity() {
        for (const auto& link : subject_.chain.links) {
            const RoleUse use = link.pass->roles();
            const RoleSet reads = use.required | use.optional;
            const bool nothing = reads.has(Role::motion)          ? cell_.still
                                 : reads.has(Role::inverse_depth) ? cell_.in_focus
                                                                  : cell_.soft;
            if (!nothing) return;
        }
        add_equal("identity", out_, color());
    }

    // Under the conditions of the specs: jitter 0, tile jitter off, sides multiples of r.
    Status mirror() {
        const int tile = tile_px(subject_.chain);
        if (color().width % tile || color().height % tile) return Status();
        Chain chain = subject_.chain.clone();
        for (auto& link : chain.links) {
            for (const auto& row : link.type->parameters->rows()) {
                if (row.key == "jitter") row.set(link.pass->parameters(), 0.0);
                if (row.key == "tile_jitter") row.set(link.pass->parameters(), false);
            }
        }
        auto straight = filter(chain, cell_.frame, cell_.planes, false);
        if (!straight.ok()) return straight.status();
        auto turned = filter(chain, cell_.frame, mirrored(cell_.planes), false);
        if (!turned.ok()) return turned.status();
        add_fraction("mirror", mirrored(*turned), *straight, bounds_.fraction);
        return Status();
    }

    Status reference() {
        PlanOptions options;
        options.precision = precision_;
        options.elide = false;
        auto expected = run_reference(subject_.chain, cell_.frame, cell_.planes, options);
        if (!expected.ok()) return expected.status();
        add_fraction("reference", out_, expected->planes.at(Role::color), bounds_.fraction);
        return Status();
    }

    // Pixels of `a` with a channel off `b` by more than the tolerance.
    template <class T>
    void add_fraction(const char* check, const ImageF& a, const Image<T>& b, double bound) {
        const double floor = kRelativeFloor * std::max(largest(color()), 1e-30);
        double worst = 0;
        size_t above = 0, at = 0;
        for (size_t pixel = 0; pixel < a.pixels(); ++pixel) {
            double error = 0;
            for (size_t i = 4 * pixel; i < 4 * pixel + 4; ++i) {
                const double vb = double(b.data[i]);
                const double e = std::abs(double(a.data[i]) - vb) / std::max(std::abs(vb), floor);
                error = std::max(error, std::isnan(e) ? double(INFINITY) : e);
            }
            if (error > bounds_.tolerance) ++above;
            if (error > worst) {
                worst = error;
                at = pixel;
            }
        }
        add(check, double(above) / double(a.pixels()), bound,
            concat("of all pixels are off by more than ", bounds_.tolerance, ", the worst ",
                   place(a, at), " by ", worst));
    }

    // Color and depth change pixel by pixel, motion as a whole: equal speeds stay equal.
    Status continuity() {
        const auto changed = [&](Role role) {
            FramePlanes planes = cell_.planes;
            ImageF& plane = planes[role];
            for (size_t i = 0; i < plane.data.size(); ++i)
                plane.data[i] *= float(1 + bounds_.eps * (role == Role::motion ? 1 : noise(i)));
            return planes;
        };
        double mean = 0;
        for (float value : color().data) mean += std::abs(double(value));
        const double most = std::max(largest(color()), 1e-30);
        const std::pair<Role, double> rows[] = {{Role::color, bounds_.color},
                                                {Role::motion, bounds_.motion},
                                                {Role::inverse_depth, bounds_.depth}};
        for (const auto& [role, bound] : rows) {
            FramePlanes planes = changed(role);
            const FrameDescription frame = facts_of(cell_.frame, planes);
            auto out = filter(subject_.chain, frame, planes, false);
            if (!out.ok()) return out.status();
            // Pixels that jump are set aside, if they are few; many count as the change they are.
            double change = 0, jumped = 0, jump = 0;
            size_t jumps = 0;
            for (size_t pixel = 0; pixel < out_.pixels(); ++pixel) {
                double sum = 0, worst = 0;
                for (size_t i = 4 * pixel; i < 4 * pixel + 4; ++i) {
                    const double d = std::abs(double(out->data[i]) - double(out_.data[i]));
                    sum += d;
                    worst = std::max(worst, d);
                }
                const bool jumps_here = worst > kJump * bounds_.eps * most;
                (jumps_here ? jumped : change) += sum;
                jumps += jumps_here;
                jump = std::max(jump, worst);
            }
            if (double(jumps) > bounds_.fraction * double(out_.pixels())) change += jumped;
            add(role == Role::inverse_depth ? "depth" : postchain::name_of(role),
                mean > 0 ? change / (bounds_.eps * mean) : change, bound,
                concat("times the input's change of ", bounds_.eps, ", largest jump ", jump / most,
                       " of the largest color"));
        }
        return Status();
    }

    Executor& executor_;
    const Subject& subject_;
    const Cell& cell_;
    Precision precision_;
    Bounds bounds_;
    ImageF out_;
    std::vector<Measured> measured_;
};

}  // namespace

const char* name_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::ok:
            return "ok";
        case Verdict::limit:
            return "limit";
        case Verdict::failed:
            return "FAIL";
    }
    return "";
}

const std::vector<std::string>& check_names() {
    static const std::vector<std::string> names = {"finite", "range",  "constant",  "identity",
                                                   "lean",   "mirror", "reference", "color",
                                                   "motion", "depth",  "counted"};
    return names;
}

int tile_px(const Chain& chain) {
    int64_t tile = 0;
    for (const auto& link : chain.links)
        if (const Parameter* row = link.type->parameters->find("max_blur_px"))
            if (row->type == ParameterType::integer)
                tile = std::max(tile, std::get<int64_t>(row->get(link.pass->parameters())));
    return tile > 0 ? int(tile) : 40;
}

Subject with_cells_camera(Subject subject) {
    subject.chain.camera = Camera();
    for (auto& link : subject.chain.links) {
        for (const auto& row : link.type->parameters->rows()) {
            const bool of_camera =
                camera_parameters().find(row.key) ||
                (!row.excludes.empty() && camera_parameters().find(row.excludes));
            if (row.optional && of_camera)
                row.set(link.pass->parameters(), ParameterValue(std::monostate()));
        }
    }
    return subject;
}

Result<std::vector<Measured>> measure(Executor& executor, const Subject& subject, const Cell& cell,
                                      Precision precision) {
    const Cell stored = at_precision(cell, precision);
    return Measurement(executor, subject, stored, precision).all();
}

}  // namespace postchain::stress

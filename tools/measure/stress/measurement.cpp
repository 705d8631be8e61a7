#include "tools/measure/stress/measurement.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "chain/convert.h"

namespace postchain::stress {
namespace {

bool equal_pixel(const ImageF& a, const ImageF& b, size_t pixel) {
    const size_t at = pixel * size_t(a.channels);
    return std::memcmp(&a.data[at], &b.data[at], size_t(a.channels) * sizeof(float)) == 0;
}

// Uniform in [-1, 1], a function of the index.
double noise(size_t index) {
    uint64_t state = (uint64_t(index) + 1) * 0x9e3779b97f4a7c15ull;
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9ull;
    state = (state ^ (state >> 27)) * 0x94d049bb133111ebull;
    return 2 * double((state ^ (state >> 31)) >> 11) / double(1ull << 53) - 1;
}

// Per pixel, the largest |a - b| of its channels in units of `unit`.
ImageF changes_of(const ImageF& a, const ImageF& b, double unit) {
    ImageF map(a.width, a.height, 1);
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double change = std::abs(double(a.data[i]) - double(b.data[i])) / unit;
        float& worst = map.data[i / 4];
        if (!(change <= double(worst))) worst = std::isnan(change) ? INFINITY : float(change);
    }
    return map;
}

bool has_lens(const Chain& chain) {
    return std::any_of(chain.links.begin(), chain.links.end(), [](const auto& link) {
        return link.type->parameters->find("f_stop") != nullptr;
    });
}

// Change of the circle of confusion's radius per change of ln depth, px, at the focus distance s:
// f_px A/(2 s), with f_px the focal length in pixels and A the aperture's diameter.
double lens_slope_px(const FrameDescription& frame) {
    const Camera& camera = frame.camera;
    const double focal_mm = camera.focal_length_mm.value_or(0);
    const double focal_px = focal_mm / camera.sensor_width_mm.value_or(1) * frame.display_width;
    const double aperture_m = 1e-3 * focal_mm / camera.f_stop.value_or(1);
    return focal_px * aperture_m / (2 * camera.focus_distance.value_or(1));
}

uint64_t hash_of(const ImageF& image) {
    return hash_text(
        {reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)});
}

}  // namespace

double largest_of(const ImageF& image) {
    double most = 0;
    for (float value : image.data) most = std::max(most, std::abs(double(value)));
    return most;
}

double mean_of(const ImageF& image) {
    double sum = 0;
    for (float value : image.data) sum += std::abs(double(value));
    return image.data.empty() ? 0 : sum / double(image.data.size());
}

std::string place_of(const ImageF& image, size_t pixel) {
    return concat("at ", pixel % size_t(image.width), ",", pixel / size_t(image.width));
}

Bounds bounds_of(Precision precision, int tile) {
    const bool half = precision == Precision::fp16;
    Bounds bounds;
    bounds.tolerance = half ? 2e-2 : 1e-3;
    bounds.mean = half ? 5e-3 : 1e-4;
    bounds.dot = half ? 5e-3 : 1e-4;
    bounds.eps = half ? 1e-2 : 1e-4;
    bounds.motion = 0.25 * tile;
    return bounds;
}

Measurement::Measurement(Executor& executor, const Subject& subject, const Cell& cell,
                         Precision precision, std::vector<Exhibit>* exhibits,
                         std::set<std::string> only)
    : executor_(executor),
      subject_(subject),
      cell_(cell),
      precision_(precision),
      bounds_(bounds_of(precision, tile_px(subject.chain))),
      exhibits_(exhibits),
      only_(std::move(only)) {}

Result<CellMeasures> Measurement::all() {
    ASSIGN_OR_RETURN(auto complete, plan(subject_.chain, cell_.frame, false));
    ASSIGN_OR_RETURN(auto out, run(complete, cell_.planes));
    plan_ = std::move(complete);
    out_ = std::move(out);
    measures_.bits = hash_of(out_);
    if (wants("finite")) finite();
    for (auto check :
         {&Measurement::hold, &Measurement::range, &Measurement::constant, &Measurement::elided,
          &Measurement::repeat, &Measurement::turns, &Measurement::shift, &Measurement::dot,
          &Measurement::reference, &Measurement::continuity})
        RETURN_IF_ERROR((this->*check)());
    if (wants("identity")) identity();
    if (cell_.checks_counts && wants("counted"))
        add("counted", std::abs(double(cell_.nonfinite_placed) - double(cell_.nonfinite_counted)),
            0, concat(cell_.nonfinite_placed, " put in"));
    return std::move(measures_);
}

Result<Plan> Measurement::plan(const Chain& chain, const FrameDescription& frame,
                               bool elide) const {
    PlanOptions options;
    options.precision = precision_;
    options.elide = elide;
    return make_plan(chain, frame, options);
}

Result<ImageF> Measurement::run(const Plan& plan, const FramePlanes& planes) {
    ASSIGN_OR_RETURN(auto out, executor_.filter(plan, planes));
    return std::move(out.at(Role::color));
}

Result<ImageF> Measurement::filter(const Chain& chain, const FrameDescription& frame,
                                   const FramePlanes& planes, bool elide) {
    ASSIGN_OR_RETURN(auto wanted, plan(chain, frame, elide));
    if (wanted == plan_ && planes == cell_.planes) return out_;
    return run(wanted, planes);
}

Result<FrameDescription> Measurement::described(FramePlanes& planes) const {
    FrameDescription frame = cell_.frame;
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    RETURN_IF_ERROR(convert_frame(planes, frame, options).status());
    return frame;
}

Result<ImageF> Measurement::filter_anew(const Chain& chain, FramePlanes planes) {
    ASSIGN_OR_RETURN(auto frame, described(planes));
    return filter(chain, frame, planes);
}

double Measurement::held(double value) const {
    return precision_ == Precision::fp16 ? std::clamp(value, -double(kMaxHalf), double(kMaxHalf))
                                         : value;
}

void Measurement::add(const char* check, double value, double bound, std::string note) {
    Measured one;
    one.check = check;
    one.verdict = value <= bound ? Verdict::ok : Verdict::failed;
    one.value = value;
    one.bound = bound;
    if (one.verdict != Verdict::ok) one.note = std::move(note);
    measures_.checks.push_back(std::move(one));
}

void Measurement::exhibit(const ImageF& input, const ImageF& result, const ImageF& compared,
                          ImageF error, const char* compared_is, const char* error_is) {
    if (exhibits_)
        exhibits_->push_back({measures_.checks.back().check, input, result, compared,
                              std::move(error), compared_is, error_is});
}

void Measurement::add_equal(const char* check, const ImageF& input, const ImageF& a,
                            const ImageF& b, const char* compared_is) {
    size_t different = 0, first = 0;
    for (size_t i = a.pixels(); i-- > 0;) {
        if (equal_pixel(a, b, i)) continue;
        ++different;
        first = i;
    }
    ImageF map = changes_of(a, b, std::max(largest_of(b), 1e-30));
    const float worst = *std::max_element(map.data.begin(), map.data.end());
    add(check, double(different) / double(a.pixels()), 0,
        concat("of all pixels differ, the first ", place_of(a, first),
               ", largest change relative to the largest color ", worst));
    exhibit(input, a, b, std::move(map), compared_is, "change relative to the largest color");
}

ImageF errors_of(const ImageF& input, const ImageF& a, const ImageF& b) {
    const double floor = kRelativeFloor * std::max(largest_of(input), 1e-30);
    ImageF map(a.width, a.height, 1);
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double va = a.data[i], vb = b.data[i];
        const double e = std::abs(va - vb) / std::max({std::abs(va), std::abs(vb), floor});
        float& worst = map.data[i / 4];
        if (!(e <= double(worst))) worst = std::isnan(e) ? INFINITY : float(e);
    }
    return map;
}

void Measurement::add_mean(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                           const char* compared_is) {
    ImageF map = errors_of(input, a, b);
    double near = 0, far = 0, worst = 0;
    size_t off = 0, at = 0;
    for (size_t i = 0; i < map.pixels(); ++i) {
        const double e = map.data[i];
        const bool is_off = e > bounds_.tolerance;
        (is_off ? far : near) += e;
        off += is_off;
        if (e > worst) {
            worst = e;
            at = i;
        }
    }
    const double part = double(off) / double(map.pixels());
    add(check, (near + (part > bounds_.fraction ? far : 0)) / double(map.pixels()), bounds_.mean,
        concat("mean error; ", part, " of all pixels exceed the tolerance ", bounds_.tolerance,
               ", the worst ", place_of(map, at), " by ", worst));
    exhibit(input, a, b, std::move(map), compared_is, "relative error");
}

void Measurement::finite() {
    ImageF map(out_.width, out_.height, 1);
    size_t bad = 0, first = 0;
    for (size_t i = out_.data.size(); i-- > 0;) {
        if (std::isfinite(out_.data[i])) continue;
        ++bad;
        first = i;
        map.data[i / 4] = 1;
    }
    add("finite", double(bad), 0, place_of(out_, first / 4));
    exhibit(color(), out_, color(), std::move(map), "input", "1 where a value is not finite");
}

Status Measurement::hold() {
    held_planes_ = cell_.planes;
    for (float& value : held_planes_[Role::color].data) value = float(held(value));
    ASSIGN_OR_RETURN(held_frame_, described(held_planes_));
    ASSIGN_OR_RETURN(held_out_, filter(subject_.chain, held_frame_, held_planes_));
    return Status();
}

Status Measurement::range() {
    if (!wants("range")) return Status();
    const auto convex = subject_.chain.that_guarantees(
        [](const Guarantees& one) { return one.convex.has_value(); });
    if (!convex) return Status();
    ASSIGN_OR_RETURN(auto of_convex, filter(*convex, held_frame_, held_planes_));
    const ImageF& in = held_planes_[Role::color];
    ImageF map(in.width, in.height, 1);
    double worst = 0;
    size_t at = 0;
    for (size_t c = 0; c < 4; ++c) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = c; i < in.data.size(); i += 4) {
            low = std::min(low, double(in.data[i]));
            high = std::max(high, double(in.data[i]));
        }
        const double scale = std::max({std::abs(low), std::abs(high), 1e-30});
        for (size_t i = c; i < in.data.size(); i += 4) {
            const double value = of_convex.data[i];
            const double off = std::max(value - high, low - value) / scale;
            // Skips NaN, which `finite` counts.
            if (off > double(map.data[i / 4])) map.data[i / 4] = float(off);
            if (!(off > worst)) continue;
            worst = off;
            at = i / 4;
        }
    }
    add("range", worst, *convex->guarantees().convex, place_of(in, at));
    exhibit(in, of_convex, in, std::move(map), "input",
            "distance from the channel's input range, relative to its largest");
    return Status();
}

// The cell's depth, motion and lens with constant color: each channel's maximum.
Status Measurement::constant() {
    if (!wants("constant") || !subject_.chain.guarantees().keeps_constants) return Status();
    FramePlanes planes = held_planes_;
    ImageF& flat = planes[Role::color];
    float most[4] = {0, 0, 0, 0};
    for (size_t i = 0; i < flat.data.size(); ++i)
        if (std::abs(flat.data[i]) > std::abs(most[i % 4])) most[i % 4] = flat.data[i];
    for (size_t i = 0; i < flat.data.size(); ++i) flat.data[i] = most[i % 4];
    ASSIGN_OR_RETURN(auto out, filter_anew(subject_.chain, planes));
    add_equal("constant", flat, out, flat, "the constant");
    return Status();
}

Status Measurement::elided() {
    if (!wants("elided")) return Status();
    ASSIGN_OR_RETURN(auto out, filter(subject_.chain, cell_.frame, cell_.planes, true));
    add_equal("elided", color(), out, out_, "result of the complete run");
    return Status();
}

Status Measurement::repeat() {
    if (!wants("repeat")) return Status();
    ASSIGN_OR_RETURN(auto second, plan(subject_.chain, cell_.frame, false));
    ASSIGN_OR_RETURN(auto out, run(second, cell_.planes));
    add_equal("repeat", color(), out, out_, "result of the first run");
    return Status();
}

void Measurement::identity() {
    const RoleSet driven_by = subject_.chain.guarantees().driven_by;
    if (driven_by.empty() || !cell_.is_quiet(driven_by)) return;
    add_equal("identity", color(), out_, color(), "input");
}

Status Measurement::reference() {
    if (!wants("reference")) return Status();
    PlanOptions options;
    options.precision = precision_;
    options.elide = false;
    ASSIGN_OR_RETURN(auto run, run_reference(subject_.chain, held_frame_, held_planes_, options));
    add_mean("reference", held_planes_.at(Role::color), held_out_,
             image_cast<float>(run.planes.at(Role::color)), "double-precision reference");
    return Status();
}

// Color and depth change per pixel, motion as a whole: equal speeds stay equal.
Status Measurement::continuity() {
    const auto changed = [&](Role role, double eps) {
        FramePlanes planes = cell_.planes;
        ImageF& plane = planes[role];
        for (size_t i = 0; i < plane.data.size(); ++i)
            plane.data[i] *= float(1 + eps * (role == Role::motion ? 1 : noise(i)));
        return planes;
    };
    const double mean = mean_of(color());
    const double most = std::max(largest_of(color()), 1e-30);
    double eps_of_depth = bounds_.eps;
    if (has_lens(subject_.chain))
        eps_of_depth = std::min(eps_of_depth,
                                kMaxRadiusChangePx / std::max(lens_slope_px(cell_.frame), 1e-30));
    struct Row {
        Role role;
        const char* check;
        double bound;
        const char* compared_is;
    };
    const Row rows[] = {
        {Role::color, "color", bounds_.color, "result with the color changed by eps"},
        {Role::motion, "motion", bounds_.motion, "result with the motion changed by eps"},
        {Role::inverse_depth, "depth", bounds_.depth, "result with the depth changed by eps"}};
    for (const auto& [role, check, bound, compared_is] : rows) {
        if (!wants(check)) continue;
        const double eps = role == Role::inverse_depth ? eps_of_depth : bounds_.eps;
        ASSIGN_OR_RETURN(auto out, filter_anew(subject_.chain, changed(role, eps)));
        // Pixels that jump are excluded if they are few; otherwise they count as change.
        double change = 0, jumped = 0, jump = 0;
        size_t jumps = 0;
        for (size_t pixel = 0; pixel < out_.pixels(); ++pixel) {
            double sum = 0, worst = 0;
            for (size_t i = 4 * pixel; i < 4 * pixel + 4; ++i) {
                const double d = std::abs(double(out.data[i]) - double(out_.data[i]));
                sum += d;
                worst = std::max(worst, d);
            }
            const bool jumps_here = worst > kJump * eps * most;
            (jumps_here ? jumped : change) += sum;
            jumps += jumps_here;
            jump = std::max(jump, worst);
        }
        if (double(jumps) > bounds_.fraction * double(out_.pixels())) change += jumped;
        change /= double(out_.data.size());
        add(check, mean > 0 ? change / (eps * mean) : change, bound,
            concat("times the input's change of ", eps, ", largest jump ", jump / most,
                   " of the largest color"));
        exhibit(color(), out_, out, changes_of(out_, out, most), compared_is,
                "change relative to the largest color");
    }
    return Status();
}

}  // namespace postchain::stress

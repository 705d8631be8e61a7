#include "tools/stress/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include "chain/frame/convert.h"
#include "chain/pass/planner.h"
#include "shaders/shared/color_limits.h"
#include "tools/stress/transform.h"

namespace postchain::stress {
namespace {

using shared::kMaxHalf;

// Bounds at one precision. fp16 stores velocities, which move taps, and colors with a relative
// error of 2^-11: it needs a larger tolerance, and input changes well above it.
struct Bounds {
    double tolerance = 0;    // relative, of one pixel
    double fraction = 0.01;  // share of pixels above it: taps, steps, ties that round differently
    double mean = 0;         // mean error of the other pixels
    double grid = 0.05;
    double dot = 0;
    double eps = 0;     // relative change of an input
    double color = 4;   // factors
    double motion = 0;  // share of r px: a streak of that length crosses many edges
    double depth = 4;
};
// A pixel jumps if it changes by more than this multiple of eps times the largest color.
constexpr double kJump = 20;
// A change of depth is small only if it changes the circle of confusion of a surface in focus by at
// most this.
constexpr double kMaxRadiusChangePx = 0.25;
// Lower limit of the divisor of relative errors, as a fraction of the largest value.
constexpr double kRelativeFloor = 1e-4;

// The nearest half, ties to even; values beyond the largest half are unchanged.
float as_half(float value) {
    if (std::abs(value) > kMaxHalf) return value;
    int exponent = 0;
    std::frexp(value, &exponent);
    // 11 significant bits, fewer below 2^-14: the smallest step is 2^-24.
    const int step = std::max(exponent - 11, -24);
    return float(std::ldexp(std::nearbyint(std::ldexp(double(value), -step)), step));
}

// With fp16, rounds color to half as a half file would, so that results expected to be exact can
// be. Colors outside the range of half stay; they come from a float file.
Result<MatrixCell> at_precision(const MatrixCell& cell, Precision precision) {
    MatrixCell stored = cell;
    if (precision == Precision::fp32) return stored;
    for (float& value : stored.planes.at(Role::color).data) value = as_half(value);
    ConvertOptions options;  // for the bounds of these colors
    options.depth = DepthEncoding::inverse;
    RETURN_IF_ERROR(convert_frame(stored.planes, stored.frame, options).status());
    return stored;
}

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
    return std::ranges::any_of(chain.links, [](const auto& link) {
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

// |value|.
double largest_of(const ImageF& image) {
    double most = 0;
    for (float value : image.data) most = std::max(most, std::abs(double(value)));
    return most;
}

// |value|.
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

// Per pixel the maximum over channels of |a - b| / max(|a|, |b|, floor), with the floor relative to
// the largest value of `input`; infinite if not finite.
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

ImageF cut(const ImageF& image, int x, int y, int width, int height) {
    ImageF out(width, height, image.channels);
    for (int row = 0; row < height; ++row)
        std::copy_n(image.pixel(x, y + row), width * image.channels, out.pixel(0, row));
    return out;
}

// Keeps NaN once found.
bool is_worse(double value, double worst) {
    return !(value <= worst) && !std::isnan(worst);
}

// Measures one cell with one chain at one precision.
class Measurement {
  public:
    Measurement(Executor& executor, const Subject& subject, const MatrixCell& cell,
                Precision precision, std::vector<CheckImages>* images, std::set<std::string> only);
    Result<CellMeasures> all();  // or those in `only`, if it is not empty

  private:
    const ImageF& color() const { return cell_.planes.at(Role::color); }
    bool wants(const char* check) const { return only_.empty() || only_.contains(check); }
    Result<Plan> plan(const Chain& chain, const FrameDescription& frame, bool elide) const;
    Result<ImageF> run(const Plan& plan, const FramePlanes& planes);
    // Plans and runs. The plan and the planes of `out_` are not run again.
    Result<ImageF> filter(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, bool elide = false);
    // The frame's description with the bounds of these planes.
    Result<FrameDescription> described(FramePlanes& planes) const;
    // Filters these planes without elision.
    Result<ImageF> filter_anew(const Chain& chain, FramePlanes planes);
    // The expected value as the storage of color can hold it.
    double stored(double value) const;

    // NaN is never within a bound.
    void add(const char* check, double value, double bound, std::string note);
    void add_images(const ImageF& input, const ImageF& result, const ImageF& compared, ImageF error,
                    const char* compared_is, const char* error_is);
    // Adds the number of pixels of `a` that differ from `b` in any bit.
    void add_equal(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                   const char* compared_is);
    // Adds the mean relative error of `a` against `b`, without the pixels above the tolerance if
    // they are few.
    void add_mean(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                  const char* compared_is);

    Status store_planes();  // fills the stored planes, frame and result
    void finite();
    Status range();
    Status constant();
    Status elided();
    Status repeat();
    void identity();
    Status reference();
    Status continuity();

    // Turns, moves and the dot: operations that filters commute with, and light that they keep.
    //   turns  turned(filter(frame)) against filter(turned(frame)): mirror, flip, quarter turn
    //   moves  two windows on the extended frame, one moved by s px: their overlap must be equal if
    //          s is a whole number of tiles and boxes (shift), and is measured otherwise (grid)
    //   dot    one bright pixel on black, with the center pixel's depth and motion everywhere
    Status turns();
    Status shift();
    Status dot();
    bool fits_tiles() const;  // sides are multiples of r
    // The chain under test, or one with variants of its passes, that has this symmetry.
    std::optional<Chain> chain_with(Symmetry symmetry) const;
    // Remaining fraction of the dot's light in each channel; `out` gets the image.
    Result<std::array<double, 4>> light_left(const Chain& chain, const FramePlanes& dot,
                                             float value, ImageF& out);

    Executor& executor_;
    const Subject& subject_;
    const MatrixCell& cell_;
    Precision precision_;
    Bounds bounds_;
    Plan plan_;  // complete plan of the cell, and its result
    ImageF out_;
    // The planes with color as its storage holds it, as a half file would.
    FramePlanes stored_planes_;
    FrameDescription stored_frame_;
    ImageF stored_out_;
    CellMeasures measures_;
    std::vector<CheckImages>* images_;
    std::set<std::string> only_;
};

Measurement::Measurement(Executor& executor, const Subject& subject, const MatrixCell& cell,
                         Precision precision, std::vector<CheckImages>* images,
                         std::set<std::string> only)
    : executor_(executor),
      subject_(subject),
      cell_(cell),
      precision_(precision),
      bounds_(bounds_of(precision, tile_px(subject.chain))),
      images_(images),
      only_(std::move(only)) {}

Result<CellMeasures> Measurement::all() {
    ASSIGN_OR_RETURN(auto complete, plan(subject_.chain, cell_.frame, false));
    ASSIGN_OR_RETURN(auto out, run(complete, cell_.planes));
    plan_ = std::move(complete);
    out_ = std::move(out);
    measures_.bits = hash_of(out_);
    if (wants("finite")) finite();
    for (auto check :
         {&Measurement::store_planes, &Measurement::range, &Measurement::constant,
          &Measurement::elided, &Measurement::repeat, &Measurement::turns, &Measurement::shift,
          &Measurement::dot, &Measurement::reference, &Measurement::continuity})
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
    options.device = executor_.device_class();
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

double Measurement::stored(double value) const {
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

void Measurement::add_images(const ImageF& input, const ImageF& result, const ImageF& compared,
                             ImageF error, const char* compared_is, const char* error_is) {
    if (images_)
        images_->push_back({measures_.checks.back().check, input, result, compared,
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
    const float worst = *std::ranges::max_element(map.data);
    add(check, double(different) / double(a.pixels()), 0,
        concat("of all pixels differ, the first ", place_of(a, first),
               ", largest change relative to the largest color ", worst));
    add_images(input, a, b, std::move(map), compared_is, "change relative to the largest color");
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
    add_images(input, a, b, std::move(map), compared_is, "relative error");
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
    add_images(color(), out_, color(), std::move(map), "input", "1 where a value is not finite");
}

Status Measurement::store_planes() {
    stored_planes_ = cell_.planes;
    for (float& value : stored_planes_[Role::color].data) value = float(stored(value));
    ASSIGN_OR_RETURN(stored_frame_, described(stored_planes_));
    ASSIGN_OR_RETURN(stored_out_, filter(subject_.chain, stored_frame_, stored_planes_));
    return Status();
}

Status Measurement::range() {
    if (!wants("range")) return Status();
    const auto convex = subject_.chain.that_guarantees(
        [](const Guarantees& one) { return one.convex.has_value(); });
    if (!convex) return Status();
    ASSIGN_OR_RETURN(auto of_convex, filter(*convex, stored_frame_, stored_planes_));
    const ImageF& in = stored_planes_[Role::color];
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
    add_images(in, of_convex, in, std::move(map), "input",
               "distance from the channel's input range, relative to its largest");
    return Status();
}

// The cell's depth, motion and lens with constant color: each channel's maximum.
Status Measurement::constant() {
    if (!wants("constant") || !subject_.chain.guarantees().keeps_constants) return Status();
    FramePlanes planes = stored_planes_;
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
    ASSIGN_OR_RETURN(auto run,
                     run_reference(subject_.chain, stored_frame_, stored_planes_, options));
    add_mean("reference", stored_planes_.at(Role::color), stored_out_,
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
        // Pixels that jump are excluded if they are few; otherwise they are part of the change.
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
        add_images(color(), out_, out, changes_of(out_, out, most), compared_is,
                   "change relative to the largest color");
    }
    return Status();
}

bool Measurement::fits_tiles() const {
    const int tile = tile_px(subject_.chain);
    return color().width % tile == 0 && color().height % tile == 0;
}

std::optional<Chain> Measurement::chain_with(Symmetry symmetry) const {
    return subject_.chain.that_guarantees(
        [&](const Guarantees& one) { return one.symmetries.count(symmetry) > 0; });
}

Status Measurement::turns() {
    if (!fits_tiles()) return Status();
    const std::pair<Symmetry, const char*> rows[] = {
        {Symmetry::mirror, "mirror"}, {Symmetry::flip, "flip"}, {Symmetry::turn, "turn"}};
    for (const auto& [symmetry, check] : rows) {
        const auto chain = wants(check) ? chain_with(symmetry) : std::nullopt;
        if (!chain) continue;
        ASSIGN_OR_RETURN(auto straight, filter(*chain, cell_.frame, cell_.planes));
        ASSIGN_OR_RETURN(auto filtered, filter_anew(*chain, turned(cell_.planes, symmetry)));
        add_mean(check, color(), turned_back(filtered, symmetry), straight,
                 "result of the unchanged frame");
    }
    return Status();
}

Status Measurement::shift() {
    if (!wants("shift") && !wants("grid")) return Status();
    const auto chain = chain_with(Symmetry::shift);
    if (!fits_tiles() || !chain) return Status();
    const double reach = chain->reach(cell_.frame).depends_px;
    if (std::isinf(reach)) return Status();
    const int tile = tile_px(*chain);
    const int width = color().width, height = color().height;
    // Whole tiles on each side, so that the first window has the same alignment as the frame.
    const int margin = (int(std::ceil(reach)) + 2 * tile - 1) / tile * tile;

    // The result seen through a window that starts `s` px further left (or up), so that the cell is
    // s px further right (or down) relative to the tiles. Windows are wider along the move only;
    // across it, both have the same border.
    const auto filtered = [&](bool along_x, int s) -> Result<ImageF> {
        const int mx = along_x ? margin : 0, my = along_x ? 0 : margin;
        const int sx = along_x ? s : 0, sy = along_x ? 0 : s;
        const Window window = {-mx - sx, -my - sy, width + 2 * mx, height + 2 * my};
        ASSIGN_OR_RETURN(auto out, filter_anew(*chain, seen_through(cell_.planes, window)));
        return cut(out, mx + sx, my + sy, width, height);
    };

    // The moves by parts of a tile (1 px, a quarter, a half, all but 1), and the one with the
    // largest change.
    struct Move {
        bool along_x;
        int s;
    };
    const Move moves[] = {{true, 1}, {false, tile / 4}, {true, tile / 2}, {false, tile - 1}};
    std::pair<ImageF, ImageF> whole[2];  // moved and not moved
    Measured grid;
    std::pair<ImageF, ImageF> shown;
    for (bool along_x : {true, false}) {
        ASSIGN_OR_RETURN(auto still, filtered(along_x, 0));
        ASSIGN_OR_RETURN(auto moved, filtered(along_x, tile));
        const double mean = mean_of(still);
        for (const Move& move : moves) {
            if (move.along_x != along_x || move.s < 1 || move.s >= tile) continue;
            ASSIGN_OR_RETURN(auto part, filtered(along_x, move.s));
            double sum = 0;
            for (size_t i = 0; i < part.data.size(); ++i)
                sum += std::abs(double(part.data[i]) - double(still.data[i]));
            const double most = std::max(mean, mean_of(part)) * double(part.data.size());
            const double value = most > 0 ? sum / most : sum;
            if (shown.first.empty() || !(value <= grid.value)) {
                grid.value = value;
                grid.note = concat("of the colors, after a move by ", move.s, " px ",
                                   along_x ? "to the right" : "down");
                shown = {std::move(part), still};
            }
        }
        whole[along_x ? 0 : 1] = {std::move(moved), std::move(still)};
    }
    // Both directions in one image, stacked.
    const auto stacked = [](const ImageF& a, const ImageF& b) {
        ImageF both(a.width, 2 * a.height, a.channels);
        std::copy(a.data.begin(), a.data.end(), both.data.begin());
        std::copy(b.data.begin(), b.data.end(), both.data.begin() + std::ptrdiff_t(a.data.size()));
        return both;
    };
    add_equal("shift", stacked(color(), color()), stacked(whole[0].first, whole[1].first),
              stacked(whole[0].second, whole[1].second),
              "result of the frame not moved; above: moved right, below: down");
    if (shown.first.empty()) return Status();  // tiles of one pixel have no parts
    add("grid", grid.value, bounds_.grid, grid.note);
    ImageF map = errors_of(color(), shown.first, shown.second);
    add_images(color(), shown.first, shown.second, std::move(map), "result of the frame not moved",
               "relative error");
    return Status();
}

Result<std::array<double, 4>> Measurement::light_left(const Chain& chain, const FramePlanes& dot,
                                                      float value, ImageF& out) {
    ASSIGN_OR_RETURN(out, filter_anew(chain, dot));
    std::array<double, 4> left = {};
    for (size_t i = 0; i < out.data.size(); ++i) left[i % 4] += out.data[i] / double(value);
    return left;
}

Status Measurement::dot() {
    if (!wants("dot") || !fits_tiles()) return Status();
    // The passes that keep light; and all passes if none gains light.
    Chain keeping, chain;
    for (const auto& link : subject_.chain.links) {
        if (auto one =
                link.that_guarantees([](const Guarantees& p) { return p.light == Light::kept; }))
            keeping.links.push_back(std::move(*one));
        if (auto one =
                link.that_guarantees([](const Guarantees& p) { return p.light != Light::any; }))
            chain.links.push_back(std::move(*one));
    }
    if (chain.links.size() < subject_.chain.links.size()) chain = keeping.clone();
    if (chain.links.empty()) return Status();
    // Reach from the dot to all pixels that contribute to pixels receiving its light.
    double largest = 0;
    for (const auto& link : chain.links)
        largest = std::max(largest, reach_of(*link.pass, cell_.frame).spreads_px);
    const double reach = chain.reach(cell_.frame).spreads_px + largest;
    if (std::isinf(reach)) return Status();
    const int side = 2 * int(std::ceil(reach)) + 1;
    const double most = stored(largest_of(color()));
    const float value = most > 0 ? float(most) : 1;
    const FramePlanes planes = dot_of(cell_.planes, side, value);

    ImageF out;
    double worst = 0, kept = 1;
    if (!keeping.links.empty()) {
        ASSIGN_OR_RETURN(const auto left, light_left(keeping, planes, value, out));
        for (double part : left) {
            if (!is_worse(std::abs(part - 1), worst)) continue;
            worst = std::abs(part - 1);
            kept = part;
        }
    }
    if (keeping.links.size() < chain.links.size()) {
        ASSIGN_OR_RETURN(const auto left, light_left(chain, planes, value, out));
        for (double part : left) {
            if (!is_worse(part - 1, worst)) continue;
            worst = part - 1;
            kept = part;
        }
    }
    add("dot", worst, bounds_.dot, concat("of a dot of ", value, "; ", kept, " of it remains"));
    ImageF map(side, side, 1);
    for (size_t i = 0; i < map.pixels(); ++i)
        map.data[i] = float(std::abs(double(out.data[4 * i])) / value);
    add_images(planes.at(Role::color), out, planes.at(Role::color), std::move(map), "the dot",
               "light of the first channel, relative to the dot");
    return Status();
}

}  // namespace

const char* name_of(Verdict verdict) {
    constexpr const char* kNames[] = {"ok", "limit", "FAIL"};
    return kNames[size_t(verdict)];
}

const std::vector<CheckRow>& check_rows() {
    static const std::vector<CheckRow> rows = {
        {"finite", "Output values that are NaN or infinite."},
        {"range",
         "Distance of an output from the range of its channel's input, relative to the "
         "largest value there."},
        {"constant", "Fraction of the pixels of a constant image that changed."},
        {"identity", "Fraction of the pixels that changed although the pass has nothing to do."},
        {"elided",
         "Fraction of the pixels that differ between the run with elision and "
         "the full run."},
        {"repeat", "Fraction of the pixels in which a second run differs from the first."},
        {"mirror",
         "Mean relative error between the mirrored result and the result of the "
         "mirrored frame."},
        {"flip", "As mirror, upside down."},
        {"turn", "As mirror, after a quarter turn."},
        {"shift",
         "Fraction of the pixels that differ after the image moves by whole "
         "tiles."},
        {"grid",
         "Mean change when the image moves by parts of a tile, relative to the "
         "colors."},
        {"dot", "Fraction of the light of a dot on black that is lost or gained."},
        {"reference", "Mean relative error against the double-precision reference."},
        {"color", "Mean relative change of the output per relative change of the color."},
        {"motion", "As color, per change of the motion."},
        {"depth", "As color, per change of the depth."},
        {"counted", "Non-finite input pixels that were not counted."}};
    return rows;
}

const std::vector<std::string>& check_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const auto& row : check_rows()) all.push_back(row.name);
        return all;
    }();
    return names;
}

int tile_px(const Chain& chain) {
    constexpr int kFine = 16, kUsual = 40;
    const int lattice = std::max(chain.guarantees().lattice_px, 1);
    return lattice >= kFine ? lattice : (kUsual + lattice - 1) / lattice * lattice;
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

Result<CellMeasures> measure(Executor& executor, const Subject& subject, const MatrixCell& cell,
                             Precision precision, std::vector<CheckImages>* images,
                             const std::set<std::string>& only) {
    ASSIGN_OR_RETURN(const auto stored, at_precision(cell, precision));
    return Measurement(executor, subject, stored, precision, images, only).all();
}

}  // namespace postchain::stress

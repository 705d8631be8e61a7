#include "tools/stress/measurement.h"

#include <algorithm>
#include <cmath>

#include "chain/base/text.h"
#include "chain/frame/convert.h"
#include "chain/pass/planner.h"
#include "shaders/shared/color_limits.h"
#include "tools/stress/image_change.h"

namespace postchain::stress {
namespace {

using shared::kMaxHalf;

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

uint64_t hash_of(const ImageF& image) {
    return hash_text(
        {reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)});
}

}  // namespace

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

Status Measurement::start() {
    ASSIGN_OR_RETURN(auto complete, plan(subject_.chain, cell_.frame, false));
    ASSIGN_OR_RETURN(auto out, run(complete, cell_.planes));
    plan_ = std::move(complete);
    out_ = std::move(out);
    measures_.bits = hash_of(out_);
    stored_planes_ = cell_.planes;
    for (float& value : stored_planes_[Role::color].data) value = float(stored(value));
    ASSIGN_OR_RETURN(stored_frame_, described(stored_planes_));
    ASSIGN_OR_RETURN(stored_out_, filter(subject_.chain, stored_frame_, stored_planes_));
    return Status();
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

Result<ImageF> Measurement::filter_again() {
    ASSIGN_OR_RETURN(const auto second, plan(subject_.chain, cell_.frame, false));
    return run(second, cell_.planes);
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

}  // namespace postchain::stress

#include "tools/stress/continuity_check.h"

#include <algorithm>
#include <cmath>

#include "chain/base/text.h"
#include "tools/stress/image_change.h"

namespace postchain::stress {
namespace {

// A pixel jumps if it changes by more than this multiple of eps times the largest color.
constexpr double kJump = 20;
// A change of depth is small only if it changes the circle of confusion of a surface in focus by at
// most this.
constexpr double kMaxRadiusChangePx = 0.25;
constexpr double kNoisePx = 1e-3;  // on vectors that are 0
// Uniform in [-1, 1], a function of the index.
double noise(size_t index) {
    uint64_t state = (uint64_t(index) + 1) * 0x9e3779b97f4a7c15ull;
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9ull;
    state = (state ^ (state >> 27)) * 0x94d049bb133111ebull;
    return 2 * double((state ^ (state >> 31)) >> 11) / double(1ull << 53) - 1;
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

// Puts uniform noise of up to kNoisePx on vectors that are 0. Returns whether there are any.
bool add_noise(FramePlanes& planes) {
    bool any = false;
    for (Role role : {Role::motion, Role::motion_back}) {
        const auto found = planes.find(role);
        if (found == planes.end()) continue;
        std::vector<float>& data = found->second.data;
        for (size_t i = 0; i < data.size(); i += 2) {
            if (data[i] != 0 || data[i + 1] != 0) continue;
            any = true;
            for (size_t k = i; k < i + 2; ++k) data[k] = float(kNoisePx * noise(k));
        }
    }
    return any;
}

struct Change {
    double mean;  // of all values, without the pixels that jump if they are few
    double jump;  // largest of a pixel
};

// A pixel jumps if it changes by more than `limit`.
Change change_of(const ImageF& before, const ImageF& after, double limit, double fraction) {
    double change = 0, jumped = 0, jump = 0;
    size_t jumps = 0;
    for (size_t pixel = 0; pixel < before.pixels(); ++pixel) {
        double sum = 0, worst = 0;
        for (size_t i = 4 * pixel; i < 4 * pixel + 4; ++i) {
            const double d = std::abs(double(after.data[i]) - double(before.data[i]));
            sum += d;
            worst = std::max(worst, d);
        }
        const bool jumps_here = worst > limit;
        (jumps_here ? jumped : change) += sum;
        jumps += jumps_here;
        jump = std::max(jump, worst);
    }
    if (double(jumps) > fraction * double(before.pixels())) change += jumped;
    return {change / double(before.data.size()), jump};
}

}  // namespace

// Color and depth change per pixel, motion as a whole: equal speeds stay equal.
Status check_continuity(Measurement& measured) {
    const auto changed = [&](Role role, double eps) {
        FramePlanes planes = measured.cell().planes;
        ImageF& plane = planes[role];
        for (size_t i = 0; i < plane.data.size(); ++i)
            plane.data[i] *= float(1 + eps * (role == Role::motion ? 1 : noise(i)));
        return planes;
    };
    const double mean = mean_of(measured.color());
    const double most = std::max(largest_of(measured.color()), 1e-30);
    double eps_of_depth = measured.bounds().eps;
    if (has_lens(measured.chain()))
        eps_of_depth =
            std::min(eps_of_depth,
                     kMaxRadiusChangePx / std::max(lens_slope_px(measured.cell().frame), 1e-30));
    const Bounds& bounds = measured.bounds();
    const auto compare = [&](const char* check, FramePlanes planes, double eps, double bound,
                             const char* compared_is) -> Status {
        ASSIGN_OR_RETURN(auto out, measured.filter_anew(measured.chain(), std::move(planes)));
        const Change change =
            change_of(measured.result(), out, kJump * eps * most, bounds.fraction);
        measured.add(check, mean > 0 ? change.mean / (eps * mean) : change.mean, bound,
                     concat("times the input's change of ", eps, ", largest jump ",
                            change.jump / most, " of the largest color"));
        measured.add_images(measured.color(), measured.result(), out,
                            changes_of(measured.result(), out, most), compared_is,
                            "change relative to the largest color");
        return Status();
    };
    if (measured.wants("color"))
        RETURN_IF_ERROR(compare("color", changed(Role::color, bounds.eps), bounds.eps, bounds.color,
                                "result with the color changed by eps"));
    if (measured.wants("motion"))
        RETURN_IF_ERROR(compare("motion", changed(Role::motion, bounds.eps), bounds.eps,
                                bounds.motion, "result with the motion changed by eps"));
    if (measured.wants("depth"))
        RETURN_IF_ERROR(compare("depth", changed(Role::inverse_depth, eps_of_depth), eps_of_depth,
                                bounds.depth, "result with the depth changed by eps"));
    if (!measured.wants("noise")) return Status();
    FramePlanes noisy = measured.cell().planes;
    if (!add_noise(noisy)) return Status();
    return compare("noise", std::move(noisy), kNoisePx, bounds.noise,
                   "result with noise on vectors that are 0");
}

}  // namespace postchain::stress

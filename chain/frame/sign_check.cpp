#include "chain/frame/sign_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "chain/base/status.h"

namespace postchain {
namespace {

constexpr double kCap = 0.25;   // surfaces occluded in one of the frames must not decide
constexpr double kApart = 0.5;  // pixels between two ends of a vector that differ

double compressed(double value) {
    value = std::max(value, 0.0);
    return value / (1 + value);
}

// Mean over RGB of the capped difference between color(x, y) and next at (px, py), bilinear.
double difference(const ImageF& color, int x, int y, const ImageF& next, double px, double py) {
    const int x0 = int(std::floor(px)), y0 = int(std::floor(py));
    const double fx = px - x0, fy = py - y0;
    const int x1 = std::min(x0 + 1, next.width - 1), y1 = std::min(y0 + 1, next.height - 1);
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double top = (1 - fx) * next.at(x0, y0, c) + fx * next.at(x1, y0, c);
        const double bottom = (1 - fx) * next.at(x0, y1, c) + fx * next.at(x1, y1, c);
        const double warped = (1 - fy) * top + fy * bottom;
        sum += std::abs(compressed(warped) - compressed(color.at(x, y, c)));
    }
    return std::min(sum / 3, kCap);
}

}  // namespace

std::string SignCandidate::text() const {
    return concat(name_of(plane), " (", sign_x > 0 ? "+" : "-", "x, ", sign_y > 0 ? "+" : "-",
                  "y)");
}

const char* name_of(SignVerdict verdict) {
    switch (verdict) {
        case SignVerdict::confirmed:
            return "confirmed";
        case SignVerdict::undecided:
            return "undecided";
        case SignVerdict::contradicted:
            return "contradicted";
    }
    return "unknown";
}

double SignCheck::margin() const {
    double smallest = std::numeric_limits<double>::infinity();
    for (const auto& candidate : candidates)
        if (told_apart(candidate)) smallest = std::min(smallest, candidate.margin);
    return std::isfinite(smallest) ? smallest : 1;
}

SignVerdict SignCheck::verdict() const {
    if (margin() > kSignMargin) return SignVerdict::confirmed;
    return margin() < 1 / kSignMargin ? SignVerdict::contradicted : SignVerdict::undecided;
}

std::string SignCheck::remedy() const {
    if (verdict() != SignVerdict::contradicted) return "";
    const auto best = std::find_if(candidates.begin(), candidates.end(), [&](const auto& one) {
        return told_apart(one) && one.margin == margin();
    });
    const std::string factors = concat("(", best->sign_x, ", ", best->sign_y, ")");
    return best->plane == Role::motion
               ? concat("use a profile whose `motion` has its `scale` multiplied by ", factors)
               : concat(
                     "use a profile whose `motion` has the channels of this one's `motion_back`, "
                     "with their `scale` multiplied by ",
                     factors);
}

SignCheck check_signs(PlaneView planes, const ImageF& next) {
    SignCheck check;
    const ImageF* color = planes.find(Role::color);
    if (!color || !planes.find(Role::motion) || next.channels < 3) {
        check.why_not = "there are no vectors, or no color";
        return check;
    }
    if (next.width != color->width || next.height != color->height) {
        check.why_not = concat("this frame is ", color->width, "x", color->height,
                               " pixels, the next one ", next.width, "x", next.height);
        return check;
    }
    struct Sums {
        SignCandidate is;
        double error = 0, apart = 0, converted_apart = 0;
    };
    std::vector<Sums> candidates;
    for (Role role : {Role::motion, Role::motion_back})
        for (int sign_x : {1, -1})
            for (int sign_y : {1, -1})
                if (planes.find(role)) candidates.push_back({{role, sign_x, sign_y}});
    const ImageF& now = *color;
    const ImageF& motion = planes.at(Role::motion);
    const int last_column = now.width - 1, last_row = now.height - 1;
    const auto error_of = [&](int x, int y, double vx, double vy) {
        const double px = x + vx, py = y + vy;
        const bool inside = px >= 0 && py >= 0 && px <= last_column && py <= last_row;
        return inside ? difference(now, x, y, next, px, py) : kCap;
    };
    size_t leaving = 0;
    for (int y = 0; y < now.height; ++y) {
        for (int x = 0; x < now.width; ++x) {
            const float* v = motion.pixel(x, y);
            const double vx = std::abs(v[0]), vy = std::abs(v[1]);
            if (vx * vx + vy * vy < 1) continue;
            // Every candidate is measured over the pixels that stay inside under each sign.
            if (x - vx < 0 || x + vx > last_column || y - vy < 0 || y + vy > last_row) {
                ++leaving;
                continue;
            }
            ++check.pixels;
            check.still_error += difference(now, x, y, next, x, y);
            // The error of the conversion as it is.
            const double converted = error_of(x, y, v[0], v[1]);
            for (auto& candidate : candidates) {
                const float* w = planes.at(candidate.is.plane).pixel(x, y);
                const double wx = candidate.is.sign_x * double(w[0]);
                const double wy = candidate.is.sign_y * double(w[1]);
                const double error = error_of(x, y, wx, wy);
                candidate.error += error;
                const double dx = wx - double(v[0]), dy = wy - double(v[1]);
                if (dx * dx + dy * dy < kApart * kApart) continue;
                ++candidate.is.pixels_apart;
                candidate.apart += error;
                candidate.converted_apart += converted;
            }
        }
    }
    if (check.pixels == 0) {
        check.why_not = leaving == 0
                            ? "nothing moves by a pixel"
                            : concat("each of the ", leaving, " moving pixels leaves the picture");
        return check;
    }
    check.still_error /= double(check.pixels);
    for (auto& [candidate, error, apart, converted_apart] : candidates) {
        candidate.error = error / double(check.pixels);
        // A mean of 1e-6 is no difference: it keeps 0/0 at 1.
        const double none = 1e-6 * double(candidate.pixels_apart);
        if (candidate.pixels_apart > 0)
            candidate.margin = (apart + none) / (converted_apart + none);
        check.candidates.push_back(candidate);
    }
    std::stable_sort(check.candidates.begin(), check.candidates.end(),
                     [](const auto& a, const auto& b) { return a.error < b.error; });
    return check;
}

}  // namespace postchain

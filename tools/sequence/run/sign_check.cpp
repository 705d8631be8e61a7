#include "tools/sequence/run/sign_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "chain/status.h"

namespace postchain::sequence {
namespace {

constexpr double kCap = 0.25;   // what was hidden in one of the frames must not decide
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

SignCheck check_signs(PlaneView planes, const ImageF& next) {
    SignCheck check;
    const ImageF* color = planes.find(Role::color);
    const ImageF* motion = planes.find(Role::motion);
    if (!color || !motion || next.channels < 3) {
        check.why_not = "there are no vectors, or no color";
        return check;
    }
    if (next.width != color->width || next.height != color->height) {
        check.why_not = concat("this frame is ", color->width, "x", color->height,
                               " pixels, the next one ", next.width, "x", next.height);
        return check;
    }
    const ImageF& now = *color;
    // The same pixels for every candidate: those that stay inside under each sign.
    std::vector<std::array<int, 2>> pixels;
    size_t leaving = 0;
    for (int y = 0; y < now.height; ++y) {
        for (int x = 0; x < now.width; ++x) {
            const double vx = std::abs(motion->at(x, y, 0));
            const double vy = std::abs(motion->at(x, y, 1));
            if (vx * vx + vy * vy < 1) continue;
            if (x - vx < 0 || x + vx > now.width - 1 || y - vy < 0 || y + vy > now.height - 1) {
                ++leaving;
                continue;
            }
            pixels.push_back({x, y});
        }
    }
    check.pixels = pixels.size();
    if (pixels.empty()) {
        check.why_not = leaving == 0
                            ? "nothing moves by a pixel"
                            : concat("each of the ", leaving, " moving pixels leaves the picture");
        return check;
    }
    for (const auto& [x, y] : pixels) check.still_error += difference(now, x, y, next, x, y);
    check.still_error /= double(pixels.size());
    const auto error_of = [&](int x, int y, double vx, double vy) {
        const double px = x + vx, py = y + vy;
        const bool inside = px >= 0 && py >= 0 && px <= now.width - 1 && py <= now.height - 1;
        return inside ? difference(now, x, y, next, px, py) : kCap;
    };
    std::vector<double> converted;  // error of the conversion as it stands, per pixel
    for (const auto& [x, y] : pixels)
        converted.push_back(error_of(x, y, motion->at(x, y, 0), motion->at(x, y, 1)));
    for (Role role : {Role::motion, Role::motion_back}) {
        const ImageF* plane = planes.find(role);
        if (!plane) continue;
        for (int sign_x : {1, -1}) {
            for (int sign_y : {1, -1}) {
                SignCandidate candidate{role, sign_x, sign_y};
                double apart = 0, converted_apart = 0;
                for (size_t i = 0; i < pixels.size(); ++i) {
                    const auto [x, y] = pixels[i];
                    const double vx = sign_x * double(plane->at(x, y, 0));
                    const double vy = sign_y * double(plane->at(x, y, 1));
                    const double error = error_of(x, y, vx, vy);
                    candidate.error += error;
                    const double dx = vx - double(motion->at(x, y, 0));
                    const double dy = vy - double(motion->at(x, y, 1));
                    if (dx * dx + dy * dy < kApart * kApart) continue;
                    ++candidate.pixels_apart;
                    apart += error;
                    converted_apart += converted[i];
                }
                candidate.error /= double(pixels.size());
                // A mean of 1e-6 is no difference: it keeps 0/0 at 1.
                const double none = 1e-6 * double(candidate.pixels_apart);
                if (candidate.pixels_apart > 0)
                    candidate.margin = (apart + none) / (converted_apart + none);
                check.candidates.push_back(candidate);
            }
        }
    }
    std::stable_sort(check.candidates.begin(), check.candidates.end(),
                     [](const auto& a, const auto& b) { return a.error < b.error; });
    return check;
}

}  // namespace postchain::sequence

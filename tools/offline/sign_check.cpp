#include "tools/offline/sign_check.h"

#include <algorithm>
#include <cmath>

#include "chain/status.h"

namespace postchain::offline {
namespace {

constexpr double kCap = 0.25;  // what was hidden in one of the frames must not decide

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

double SignCheck::margin() const {
    double right = 0, wrong = 0;
    for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate) {
        if (candidate->as_converted())
            right = candidate->error;
        else
            wrong = candidate->error;  // the last one seen is the best
    }
    return right > 0 ? wrong / right : 0;
}

SignCheck check_signs(const FramePlanes& planes, const ImageF& next) {
    SignCheck check;
    const auto color = planes.find(Role::color);
    const auto motion = planes.find(Role::motion);
    if (color == planes.end() || motion == planes.end() || next.channels < 3 ||
        next.width != color->second.width || next.height != color->second.height)
        return check;
    const ImageF& now = color->second;
    // The same pixels for every candidate: those that stay inside under each sign.
    std::vector<std::array<int, 2>> pixels;
    for (int y = 0; y < now.height; ++y) {
        for (int x = 0; x < now.width; ++x) {
            const double vx = std::abs(motion->second.at(x, y, 0));
            const double vy = std::abs(motion->second.at(x, y, 1));
            if (vx * vx + vy * vy < 1) continue;
            if (x - vx < 0 || x + vx > now.width - 1 || y - vy < 0 || y + vy > now.height - 1)
                continue;
            pixels.push_back({x, y});
        }
    }
    check.pixels = pixels.size();
    if (pixels.empty()) return check;
    for (const auto& [x, y] : pixels) check.still_error += difference(now, x, y, next, x, y);
    check.still_error /= double(pixels.size());
    for (Role role : {Role::motion, Role::motion_back}) {
        const auto plane = planes.find(role);
        if (plane == planes.end()) continue;
        for (int sign_x : {1, -1}) {
            for (int sign_y : {1, -1}) {
                SignCandidate candidate{role, sign_x, sign_y, 0};
                for (const auto& [x, y] : pixels) {
                    const double px = x + sign_x * double(plane->second.at(x, y, 0));
                    const double py = y + sign_y * double(plane->second.at(x, y, 1));
                    const bool inside =
                        px >= 0 && py >= 0 && px <= now.width - 1 && py <= now.height - 1;
                    candidate.error += inside ? difference(now, x, y, next, px, py) : kCap;
                }
                candidate.error /= double(pixels.size());
                check.candidates.push_back(candidate);
            }
        }
    }
    std::stable_sort(check.candidates.begin(), check.candidates.end(),
                     [](const auto& a, const auto& b) { return a.error < b.error; });
    return check;
}

}  // namespace postchain::offline

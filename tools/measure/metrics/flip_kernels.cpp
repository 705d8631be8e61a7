#include "tools/measure/metrics/flip_kernels.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace postchain::metrics {
namespace {

constexpr double kPi = std::numbers::pi;

// Contrast sensitivity in the spatial domain: sum of a sqrt(pi/b) exp(-pi^2 d^2 / b), with d in
// degrees of visual angle (table 1).
struct Term {
    double a, b;
};
constexpr Term kAchromatic = {1, 0.0047};
constexpr Term kRedGreen = {1, 0.0053};
constexpr Term kBlueYellow[2] = {{34.1, 0.04}, {13.5, 0.025}};
constexpr double kWidestB = 0.04;
constexpr double kFeatureWidth = 0.082;  // degrees: support of the edge and point detectors
// Outer taps below this fraction of the largest are dropped: the achromatic kernels need 13 of 21
// taps.
constexpr double kNegligibleTap = 1e-9;

using Profile = std::vector<double>;

Profile sampled(int radius, const std::function<double(double)>& f) {
    Profile values;
    for (int x = -radius; x <= radius; ++x) values.push_back(f(x));
    return values;
}

double sum(const Profile& profile) {
    double total = 0;
    for (double v : profile) total += v;
    return total;
}

Profile scaled(Profile profile, double factor) {
    for (double& v : profile) v *= factor;
    return profile;
}

// Scales so that negative taps sum to -1 and positive ones to 1: the response to a step of 1 is 1.
Profile balanced(Profile profile) {
    double positive = 0, negative = 0;
    for (double v : profile) (v > 0 ? positive : negative) += std::abs(v);
    for (double& v : profile) v /= v > 0 ? positive : negative;
    return profile;
}

Kernel kernel_of(const Profile& profile) {
    double largest = 0;
    for (double v : profile) largest = std::max(largest, std::abs(v));
    size_t cut = 0;
    while (cut < profile.size() / 2 && std::abs(profile[cut]) < kNegligibleTap * largest) ++cut;
    Kernel kernel;
    for (size_t i = cut; i < profile.size() - cut; ++i) kernel.taps.push_back(float(profile[i]));
    return kernel;
}

}  // namespace

FlipKernels flip_kernels(double pixels_per_degree) {
    FlipKernels kernels;
    // Three standard deviations of the widest kernel, for all three channels.
    const int radius =
        int(std::ceil(3 * std::sqrt(kWidestB / (2 * kPi * kPi)) * pixels_per_degree));
    const auto bell = [&](const Term& term) {
        return sampled(radius, [&](double x) {
            const double degrees = x / pixels_per_degree;
            return std::exp(-kPi * kPi * degrees * degrees / term.b);
        });
    };
    const auto normalized = [](const Profile& profile) {
        return scaled(profile, 1 / sum(profile));
    };
    kernels.achromatic = kernel_of(normalized(bell(kAchromatic)));
    kernels.red_green = kernel_of(normalized(bell(kRedGreen)));

    // The sum of both 2-D Gaussians is normalized, so each keeps its share.
    double share[2];
    for (int i = 0; i < 2; ++i) {
        const double area = sum(bell(kBlueYellow[i]));
        share[i] = kBlueYellow[i].a * std::sqrt(kPi / kBlueYellow[i].b) * area * area;
    }
    for (int i = 0; i < 2; ++i) {
        const Profile one = normalized(bell(kBlueYellow[i]));
        kernels.blue_yellow_rows[i] = kernel_of(one);
        kernels.blue_yellow_columns[i] = kernel_of(scaled(one, share[i] / (share[0] + share[1])));
    }

    const double deviation = 0.5 * kFeatureWidth * pixels_per_degree;
    const int feature_radius = int(std::ceil(3 * deviation));
    const auto gaussian = [&](double x) { return std::exp(-x * x / (2 * deviation * deviation)); };
    kernels.gaussian = kernel_of(normalized(sampled(feature_radius, gaussian)));
    kernels.first =
        kernel_of(balanced(sampled(feature_radius, [&](double x) { return -x * gaussian(x); })));
    kernels.second = kernel_of(balanced(sampled(feature_radius, [&](double x) {
        return (x * x / (deviation * deviation) - 1) * gaussian(x);
    })));
    kernels.radius = std::max(radius, feature_radius);
    return kernels;
}

}  // namespace postchain::metrics

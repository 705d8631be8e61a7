// The estimated ground of soft pixels against composites whose ground is known.
#include <algorithm>
#include <cmath>
#include <functional>

#include "chain/pass/matte.h"
#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

constexpr int kSize = 96, kFine = 5;  // pixels, and samples along each side of a pixel

// Pixels of samples: their means, or means that reach into the pixels beside.
ImageD pixels_of(const std::function<double(double, double)>& value, bool wide) {
    ImageD mean(kSize, kSize, 4);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            double sum = 0;
            for (int i = 0; i < kFine * kFine; ++i)
                sum += value(x + (i % kFine + 0.5) / kFine, y + (i / kFine + 0.5) / kFine);
            std::fill_n(mean.pixel(x, y), 4, sum / (kFine * kFine));
        }
    if (!wide) return mean;
    ImageD result = mean;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            for (int c = 0; c < 4; ++c) {
                const auto at = [&](int i, int j) {
                    return mean.at(std::clamp(i, 0, kSize - 1), std::clamp(j, 0, kSize - 1), c);
                };
                result.at(x, y, c) = 0.5 * at(x, y) + 0.125 * (at(x - 1, y) + at(x + 1, y) +
                                                               at(x, y - 1) + at(x, y + 1));
            }
    return result;
}

double disc(double x, double y) {
    return std::hypot(x - 48.3, y - 47.6) < 25 ? 1 : 0;
}
// A smaller disc with 14 hairs 0.7 px wide.
double hair(double x, double y) {
    const double u = x - 48.3, v = y - 47.6;
    if (std::hypot(u, v) < 18) return 1;
    for (int k = 0; k < 14; ++k) {
        const double a = 0.45 * k, along = u * std::cos(a) + v * std::sin(a);
        const double off = v * std::cos(a) - u * std::sin(a);
        if (along > 0 && along < 40 && std::abs(off) < 0.35) return 1;
    }
    return 0;
}
double ramp(double x, double y) {
    return std::clamp((32 - std::hypot(x - 48.3, y - 47.6)) / 10, 0.0, 1.0);
}

// Detail of 4 to 9 px in 0..1.
double texture(double x, double y) {
    return 0.5 + 0.25 * (std::sin(1.3 * x + 0.4 * y) + std::sin(0.7 * y - 0.9 * x + 1));
}

// The light that is held out of color: the first of its layers.
ImageD held_out_reference(const ImageD& color, const ImageD& mattes) {
    std::map<Role, ImageD> planes = {{Role::color, color}, {Role::mattes, mattes}};
    hold_out_reference(planes, 0);
    return planes.at(Role::layers);
}

// Mean error of what is held out over the soft pixels, as a part of that of c (1 - m).
double part_of_error(double (*shape)(double, double), double object_light, bool wide) {
    const auto object = [&](double x, double y) { return object_light + texture(y, x + 7); };
    const auto ground = [&](double x, double y) { return (1 - shape(x, y)) * texture(x, y); };
    const ImageD matte = pixels_of(shape, false);
    const ImageD truth = pixels_of(ground, wide);
    const ImageD color = pixels_of(
        [&](double x, double y) { return shape(x, y) * object(x, y) + ground(x, y); }, wide);
    ImageD mattes(kSize, kSize, 1);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const double m = matte.at(x, y);
            mattes.at(x, y) = m < 1e-9 ? 0 : m > 1 - 1e-9 ? 1 : m;
        }
    const ImageD held = held_out_reference(color, mattes);
    double error = 0, by_color = 0;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const double m = mattes.at(x, y);
            if (m == 0 || m == 1) continue;
            error += std::abs(held.at(x, y) - truth.at(x, y));
            by_color += std::abs((1 - m) * color.at(x, y) - truth.at(x, y));
        }
    return error / by_color;
}

TEST(SoftMattes, LeaveLittleOfTheObjectInTheGround) {
    const struct {
        const char* name;
        double (*shape)(double, double);
        double object_light;
        bool wide;
        double most;
    } cases[] = {{"disc", disc, 2, false, 0.35},         {"hair", hair, 2, false, 0.3},
                 {"bright disc", disc, 40, false, 0.05}, {"bright hair", hair, 40, false, 0.05},
                 {"wider disc", disc, 2, true, 0.35},    {"wider hair", hair, 2, true, 0.4},
                 {"ramp", ramp, 2, false, 0.95}};
    for (const auto& one : cases) {
        EXPECT_LT(part_of_error(one.shape, one.object_light, one.wide), one.most) << one.name;
    }
}

// Beside a bulb the pixels around a soft one are brighter than anything behind it can be. What is
// held out of it is then all of its light, and no more.
TEST(SoftMattes, HoldOutNoMoreThanThereIs) {
    ImageD color(16, 9, 4, 0.1), mattes(16, 9, 1);
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 16; ++x) {
            if (x >= 9) color.at(x, y, 0) = 30;  // the bulb
            mattes.at(x, y) = x < 8 ? 1 : 0;
        }
    for (int y = 0; y < 9; ++y) {
        mattes.at(8, y) = 0.5;
        color.at(8, y, 0) = 0.2;  // of which half is the fur's share of the pixel
        color.at(8, y, 1) = 0.3;
    }
    const ImageD held = held_out_reference(color, mattes);
    for (int y = 0; y < 9; ++y) {
        EXPECT_NEAR(held.at(8, y, 0), 0.2, 1e-12);       // (1 - m) ground would be 15
        EXPECT_NEAR(held.at(8, y, 1), 0.5 * 0.1, 0.01);  // the ground around, as without a bulb
    }
}

}  // namespace
}  // namespace postchain::test

// Images of apertures: how their light is distributed, in closed forms; what they refuse; what
// a camera does with them.
#include "chain/frame/bokeh_kernel.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "chain/pass/chain.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

constexpr int kSide = BokehKernel::kSide;
constexpr double kPi = std::numbers::pi;

std::vector<float> table_of(const std::function<double(double, double)>& light) {
    std::vector<float> values;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            values.push_back(
                float(light((x + 0.5) / (kSide / 2) - 1, (y + 0.5) / (kSide / 2) - 1)));
    return values;
}

BokehKernel image_of(const std::function<double(double, double)>& light) {
    return test::must(BokehKernel::make(table_of(light)));
}

// A coarse pattern without any symmetry, with dark and bright patches: counts in 16 x 16 squares
// against their light by area, chi-square over squares. Independent random points would give 1.
TEST(BokehKernel, PointsAreWhereTheLightIs) {
    const auto light = [](double x, double y) {
        const int i = int((x + 1) * 4), j = int((y + 1) * 4);
        const int value = (i * 37 + j * 101 + i * j * 53) % 11;
        return value < 4 ? 0.0 : double(value);
    };
    const BokehKernel image = image_of(light);
    constexpr int kSquares = 16, kFine = 64;
    std::vector<double> expected(kSquares * kSquares), counts(kSquares * kSquares);
    double all = 0;
    for (int y = 0; y < kSquares * kFine; ++y)
        for (int x = 0; x < kSquares * kFine; ++x) {
            const double u = (x + 0.5) / (kSquares * kFine) * 2 - 1;
            const double v = (y + 0.5) / (kSquares * kFine) * 2 - 1;
            if (u * u + v * v >= 1) continue;
            expected[size_t(y / kFine * kSquares + x / kFine)] += light(u, v);
            all += light(u, v);
        }
    constexpr int kPoints = 100000;
    for (int i = 0; i < kPoints; ++i) {
        const auto [x, y] = image.point((i + 0.5) / kPoints, i / std::numbers::phi);
        const auto square = [](double at) { return size_t((at + 1) / 2 * kSquares); };
        ++counts[square(y) * kSquares + square(x)];
    }
    double chi_square = 0;
    int squares = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
        const double share = expected[i] / all * kPoints;
        if (share == 0) {
            // At edges of the light points may be off by half a step of the table.
            EXPECT_LT(counts[i], 0.03 * kPoints / (kSquares * kSquares)) << i;
            continue;
        }
        ++squares;
        chi_square += (counts[i] - share) * (counts[i] - share) / share;
    }
    EXPECT_GT(squares, 100);
    EXPECT_LT(chi_square / squares, 0.1);
}

// The points of a white image are those of the disc.
TEST(BokehKernel, AWhiteOneIsADisc) {
    const BokehKernel white = image_of([](double, double) { return 1; });
    for (const double within : {0.001, 0.3, 0.77, 0.999})
        for (const double turn : {0.0, 0.2, 0.7, 0.999, 12.7, -0.3}) {
            const auto [x, y] = white.point(within, turn);
            EXPECT_NEAR(x, std::sqrt(within) * std::cos(2 * kPi * turn), 1e-5);
            EXPECT_NEAR(y, std::sqrt(within) * std::sin(2 * kPi * turn), 1e-5);
        }
}

TEST(BokehKernel, OneBrightCellHoldsAllPoints) {
    std::vector<float> values(kSide * kSide);
    values[20 * kSide + 70] = 1e-30f;
    const BokehKernel image = test::must(BokehKernel::make(values));
    for (const double share : {0.0, 0.5, 1.0}) {
        const auto [x, y] = image.point(share, share);
        EXPECT_NEAR(x, 70.5 / 64 - 1, 0.02);
        EXPECT_NEAR(y, 20.5 / 64 - 1, 0.02);
    }
}

TEST(BokehKernel, RefusesWhatIsNoAperture) {
    using testing::HasSubstr;
    const auto refused = [](std::vector<float> values) {
        const auto image = BokehKernel::make(std::move(values));
        EXPECT_EQ(image.status().code(), StatusCode::input);
        return test::error_of(image);
    };
    EXPECT_THAT(refused({}), HasSubstr("128 x 128 values, not 0"));
    std::vector<float> values(kSide * kSide, 1);
    for (const float bad : {-0.5f, NAN, INFINITY}) {
        values[3 * kSide + 7] = bad;
        EXPECT_THAT(refused(values), HasSubstr(concat("column 7, row 3 is ", bad)));
    }
    EXPECT_THAT(refused(table_of([](double, double) { return 0; })), HasSubstr("black"));
    EXPECT_THAT(refused(table_of([](double x, double y) { return std::hypot(x, y) > 1.05; })),
                HasSubstr("corners alone"));
}

TEST(BokehKernel, IsComparedByItsValues) {
    const auto values = table_of([](double x, double) { return x > 0; });
    const BokehKernel a = *BokehKernel::make(values, "a.png");
    const BokehKernel b = *BokehKernel::make(values, "b.png");
    const BokehKernel other = image_of([](double x, double) { return x < 0; });
    EXPECT_EQ(a, b);
    EXPECT_NE(a, other);
    const BokehKernel named("a.png");
    EXPECT_TRUE(a.is_read() && !named.is_read());
    EXPECT_EQ(named, BokehKernel("a.png"));
    EXPECT_NE(named, BokehKernel("b.png"));
    EXPECT_NE(named, a);
    EXPECT_FALSE(BokehKernel());
    // And so is a chain.
    Chain chain;
    const uint64_t without = chain.hash();
    const auto hash_with = [&](const BokehKernel& image) {
        chain.camera.aperture_image = image;
        return chain.hash();
    };
    EXPECT_EQ(hash_with(a), hash_with(b));
    EXPECT_NE(hash_with(a), hash_with(other));
    EXPECT_NE(hash_with(a), without);
    EXPECT_EQ(chain.clone().camera, chain.camera);
}

// The nearer camera decides the shape as a whole.
TEST(Camera, APictureAndBladesReplaceEachOther) {
    Camera blades, picture, lens;
    blades.aperture_blades = 5;
    blades.aperture_curvature = 0.5;
    blades.aperture_ratio = 2;
    picture.aperture_image = BokehKernel("a.png");
    lens.f_stop = 2;
    const Camera over = blades.overlaid_by(picture);
    EXPECT_EQ(over.aperture_image, BokehKernel("a.png"));
    EXPECT_FALSE(over.aperture_blades || over.aperture_curvature);
    EXPECT_EQ(over.aperture_ratio, 2);
    const Camera under = picture.overlaid_by(blades);
    EXPECT_FALSE(under.aperture_image);
    EXPECT_EQ(under.aperture_blades, 5);
    EXPECT_EQ(picture.overlaid_by(lens).aperture_image, BokehKernel("a.png"));
    // Two of one camera are an error.
    picture.aperture_curvature = 0.1;
    EXPECT_THAT(camera_parameters().check(&picture).message(),
                testing::HasSubstr("aperture_curvature and aperture_image are both given"));
}

}  // namespace
}  // namespace postchain

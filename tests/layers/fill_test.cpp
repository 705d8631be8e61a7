// The fill mask: which shares of a pixel came from its frame, from a neighbor, and from an
// estimate.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

enum Share { kFrame, kNeighbor, kEstimate };

// Puts the mask before the frame's layers, and those of its neighbors.
void add_fill_mask(TestFrame& frame, std::initializer_list<float> shares = {1, 0, 0, 0}) {
    const FrameDescription& d = frame.description;
    const auto add = [&](Role color, Role layers) {
        if (!frame.planes.contains(color)) return;
        std::vector<ImageF> planes = {constant_image(d.width, d.height, shares)};
        if (const auto own = frame.planes.find(layers); own != frame.planes.end())
            planes.push_back(own->second);
        frame.planes[layers] = stack_planes(planes);
        frame.description.planes.add(layers);
    };
    add(Role::color, Role::layers);
    for (const Neighbor neighbor : kNeighbors)
        add(role_of(neighbor, Role::color), role_of(neighbor, Role::layers));
    ++frame.description.layers;
    frame.description.fill_layer = 0;
}

ImageF mask_of(const FramePlanes& planes) {
    return plane_of_stack(planes.at(Role::layers), 0, planes.at(Role::color).height);
}

ImageF mask_of(const Chain& chain, TestFrame frame) {
    add_fill_mask(frame);
    return mask_of(filter(chain, frame.description, frame.planes));
}

Chain plain_motion_blur() {
    return chain_of("motion_blur", {{"path_px_per_time", 0.25}, {"noise", "none"}});
}

double largest(const ImageF& image, int channel) {
    double value = 0;
    for (size_t i = 0; i < image.pixels(); ++i)
        value = std::max(value, double(image.data[4 * i + size_t(channel)]));
    return value;
}

// A bar of 40 px that moves 32 px per frame before a ground at rest, frames `t` from the one in
// which it begins at pixel 50.
constexpr int kWidth = 144, kHeight = 32, kBar = 40, kBegin = 50;
constexpr double kSpeed = 32;
FramePlanes bar_at(int t) {
    FramePlanes planes;
    planes[Role::color] = ImageF(kWidth, kHeight, 4, 1.0f);
    planes[Role::inverse_depth] = ImageF(kWidth, kHeight, 1, 0.1f);
    planes[Role::motion] = ImageF(kWidth, kHeight, 2);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const int from = kBegin + int(kSpeed) * t;
            const bool is_bar = x >= from && x < from + kBar;
            for (int c = 0; c < 3; ++c)
                planes[Role::color].at(x, y, c) =
                    is_bar ? 0.8f : 0.3f + 0.2f * float(std::sin(0.4 * x + 0.2 * y));
            if (!is_bar) continue;
            planes[Role::inverse_depth].at(x, y) = 0.5f;
            planes[Role::motion].at(x, y, 0) = float(kSpeed);
        }
    return planes;
}

TestFrame bar_frame(const std::vector<Neighbor>& neighbors) {
    TestFrame frame;
    frame.planes = bar_at(0);
    for (const Neighbor neighbor : neighbors)
        for (auto& [role, plane] : bar_at(neighbor == Neighbor::before ? -1 : 1))
            frame.planes[role_of(neighbor, role)] = plane;
    frame.description = describe(frame.planes);
    return frame;
}

// The part of the open time in which the bar does not cover a point that it covers at the middle.
// It follows from the distance to the bar's nearer end, which has moved past the point.
double uncovered(int x) {
    const double from_end = std::min(x + 0.5 - kBegin, kBegin + kBar - x - 0.5);
    return from_end < 0 ? 0 : std::max(0.0, (kSpeed / 4 - from_end) / (kSpeed / 2));
}

TEST(FillMask, IsWhatAMovingBarUncovers) {
    const std::pair<std::vector<Neighbor>, Share> cases[] = {
        {{}, kEstimate}, {{Neighbor::before, Neighbor::after}, kNeighbor}};
    for (const auto& [neighbors, share] : cases) {
        const ImageF mask = mask_of(plain_motion_blur(), bar_frame(neighbors));
        for (int x = 30; x < 110; ++x) {
            const float* shares = mask.pixel(x, kHeight / 2);
            // The search accepts a position within 0.75 px.
            EXPECT_NEAR(shares[share], uncovered(x), 0.75 / (kSpeed / 2) + 0.02) << "column " << x;
            EXPECT_NEAR(shares[kFrame], 1 - shares[share], 0.02) << "column " << x;
        }
    }
}

// Beside an object that is held out, it stands after the layers that hold it out.
TEST(FillMask, IsFoundBesideAMatte) {
    TestFrame frame = bar_frame({});
    const ImageF plain = mask_of(plain_motion_blur(), frame);
    add_matte(frame, ImageF(kWidth, kHeight, 1), 1);
    EXPECT_LT(relative_difference(mask_of(plain_motion_blur(), frame), plain), 1e-5);
}

// The area that two circles share. https://mathworld.wolfram.com/Circle-CircleIntersection.html
double shared_area(double r, double s, double apart) {
    if (apart >= r + s) return 0;
    if (apart <= std::abs(r - s)) return std::numbers::pi * std::pow(std::min(r, s), 2);
    const auto part = [&](double a, double b) {
        return a * a * std::acos((apart * apart + a * a - b * b) / (2 * apart * a));
    };
    return part(r, s) + part(s, r) -
           0.5 * std::sqrt((-apart + r + s) * (apart + r - s) * (apart - r + s) * (apart + r + s));
}

// A disc of 24 px radius before a plain in focus, out of focus by a circle of confusion of 8 px
// radius. The rays of a pixel at a distance from its center that pass it end on the plain that the
// frame hides there.
TEST(FillMask, IsWhatTheLensSeesBehindADisc) {
    constexpr int kSide = 96;
    constexpr double kDisc = 24, kCircle = 8, kNear = 0.5, kFar = 0.1, kCenter = 47.5;
    TestFrame frame;
    frame.planes[Role::color] = ImageF(kSide, kSide, 4, 1.0f);
    frame.planes[Role::inverse_depth] = ImageF(kSide, kSide, 1, float(kFar));
    const auto from_center = [&](int x, int y) { return std::hypot(x - kCenter, y - kCenter); };
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            if (from_center(x, y) < kDisc) {
                frame.planes[Role::inverse_depth].at(x, y) = float(kNear);
                frame.planes[Role::color].at(x, y, 0) = 0.25f;
            }
    frame.description = describe(frame.planes);
    // R = f_px A/2 (1/s - w), A = f/N
    Camera& camera = frame.description.camera;
    const double focal_px = kSide * *camera.focal_length_mm / *camera.sensor_width_mm;
    camera.f_stop = *camera.focal_length_mm * 1e-3 * focal_px / 2 * (kNear - kFar) / kCircle;
    const Chain chain = chain_of("depth_of_field", {{"samples", int64_t(256)}, {"denoise", false}});
    const ImageF mask = mask_of(chain, frame);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const double apart = from_center(x, y);
            const double passing =
                1 - shared_area(kDisc, kCircle, apart) / (std::numbers::pi * kCircle * kCircle);
            const float* shares = mask.pixel(x, y);
            EXPECT_NEAR(shares[kEstimate], apart < kDisc ? passing : 0, 0.12) << x << ", " << y;
            EXPECT_EQ(shares[kNeighbor], 0);
        }
}

// A frame of one depth in which everything moves.
TestFrame moving_frame(int height, float speed_px) {
    TestFrame frame;
    frame.planes[Role::color] = textured_image(96, height, 4, 3);
    frame.planes[Role::inverse_depth] = ImageF(96, height, 1, 1.0f);
    frame.planes[Role::motion] = constant_image(96, height, {speed_px, 0});
    frame.description = describe(frame.planes);
    return frame;
}

// Color that comes in over the border is an estimate: the border's pixels, continued.
TEST(FillMask, CountsTheBorderAsAnEstimate) {
    const ImageF mask = mask_of(plain_motion_blur(), moving_frame(32, 32));
    for (int x = 0; x < 96; ++x) {
        const double from_border = std::min(x + 0.5, 95.5 - x);
        const double beyond = std::max(0.0, (8 - from_border) / 16);
        EXPECT_NEAR(mask.at(x, 16, kEstimate), beyond, 0.07) << "column " << x;
    }
}

// Variants that fill. The others treat the mask as any layer.
std::vector<Variant> filling_variants() {
    return variants_that(main_variants(), [](const Chain& chain) {
        return chain.links[0].type->name == "joint_blur";
    });
}

TEST(FillMask, AgreesWithTheReference) {
    TestFrame alone = bright_frame(45, 37);
    TestFrame neighbored = alone;
    add_neighbors(neighbored);
    add_lights(neighbored, 1);
    add_fill_mask(alone);
    add_fill_mask(neighbored);
    for (const Variant& one : filling_variants())
        for (const TestFrame* frame : {&alone, &neighbored}) {
            const FramePlanes gpu = filter(one.chain(), frame->description, frame->planes);
            const ReferenceFrame expected =
                reference(one.chain(), frame->description, frame->planes);
            const Difference difference =
                compare(gpu.at(Role::layers), expected.planes.at(Role::layers), 2e-3);
            EXPECT_LE(difference.fraction, 0.02) << one.name << ": " << difference.text;
        }
}

// Every pass hands on all of a pixel.
TEST(FillMask, SumsToOne) {
    TestFrame frame = bright_frame(67, 45);
    add_neighbors(frame);
    for (const bool matted : {false, true})
        for (const Variant& one : filling_variants()) {
            TestFrame given = frame;
            if (matted) add_matte(given, square_matte(67, 45, 3), one.links.size());
            const ImageF mask = mask_of(one.chain(), given);
            for (size_t i = 0; i < mask.pixels(); ++i) {
                const float* shares = mask.data.data() + 4 * i;
                // The ground of a soft pixel beside a bulb has weights for each of color's
                // channels.
                ASSERT_NEAR(shares[0] + shares[1] + shares[2], 1, matted ? 5e-3 : 1e-5) << one.name;
                ASSERT_GE(*std::min_element(shares, shares + 3), matted ? -5e-3 : -1e-5)
                    << one.name;
            }
            if (!matted) {
                EXPECT_GT(largest(mask, kNeighbor) + largest(mask, kEstimate), 0.1) << one.name;
            }
        }
}

// A pass that does not fill takes nothing from the frame.
TEST(FillMask, StaysWholeInOtherModes) {
    const TestFrame frame = bright_frame(67, 45);
    for (const auto& [pass, mode] : {std::pair("motion_blur", std::pair("mode", "guertin")),
                                     {"motion_blur", {"mode", "single"}},
                                     {"depth_of_field", {"method", "gilham"}},
                                     {"fxaa", {"mode", "search"}},
                                     {"fxaa", {"mode", "directional"}}}) {
        const ImageF mask = mask_of(chain_of(pass, {{mode.first, mode.second}}), frame);
        EXPECT_EQ(largest(mask, kNeighbor) + largest(mask, kEstimate), 0) << mode.second;
        EXPECT_NEAR(largest(mask, kFrame), 1, 1e-6) << mode.second;
    }
}

// A pixel that an earlier pass has filled stays filled: shares of the input come through where
// nothing hides anything.
TEST(FillMask, KeepsTheSharesOfAnEarlierPass) {
    TestFrame frame = moving_frame(64, 8);
    add_fill_mask(frame, {0.25f, 0.5f, 0.25f, 0});
    for (const Variant& one : filling_variants()) {
        const ImageF mask = mask_of(filter(one.chain(), frame.description, frame.planes));
        for (const auto& [share, part] :
             {std::pair(kFrame, 0.25), {kNeighbor, 0.5}, {kEstimate, 0.25}})
            EXPECT_NEAR(mask.at(48, 32, share), part, 1e-5) << one.name << " " << share;
    }
}

// It costs nothing if it is not asked for, and changes no bit of color or of another layer.
TEST(FillMask, ChangesNoBit) {
    TestFrame without = bright_frame(67, 45);
    add_neighbors(without);
    add_lights(without, 2);
    TestFrame with = without;
    add_fill_mask(with);
    for (const Variant& one : filling_variants()) {
        Plan plain;
        const FramePlanes a = filter(one.chain(), without.description, without.planes, {}, &plain);
        const FramePlanes b = filter(one.chain(), with.description, with.planes);
        EXPECT_TRUE(equal_bits(a.at(Role::color), b.at(Role::color))) << one.name;
        for (int i = 0; i < 2; ++i)
            EXPECT_TRUE(equal_bits(plane_of_stack(a.at(Role::layers), i, 45),
                                   plane_of_stack(b.at(Role::layers), i + 1, 45)))
                << one.name;
        for (const Step& step : plain.steps)
            EXPECT_EQ(step.program.defines.count("FILL_LAYER"), 0u) << step.name;
    }
}

}  // namespace
}  // namespace postchain::test

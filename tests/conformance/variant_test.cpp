// Requirements of every variant of every pass (tests/support/variants.h), on frames that hold all
// that it can read.
#include <cmath>
#include <limits>
#include <set>

#include "tests/support/images.h"
#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test::variant_test {
namespace {

constexpr int kWidth = 45, kHeight = 37;
constexpr int kLights = 5;  // more than one step does

// Lights that sum to color, neighbors, vectors both ways.
TestFrame rich_frame(int width, int height) {
    TestFrame frame = bright_frame(width, height);
    add_motion_back(frame);
    add_neighbors(frame);
    add_lights(frame, kLights);
    return frame;
}

TestFrame without_layers(TestFrame frame) {
    for (const Role role : {Role::layers, Role::layers_before, Role::layers_after}) {
        frame.planes.erase(role);
        frame.description.planes.remove(role);
    }
    frame.description.layers = 0;
    return frame;
}

// Every pixel has vectors of its own, some nearly still; depths in small rectangles, sky above.
// Pixels twice as wide as high.
TestFrame noisy_frame(int width, int height) {
    TestFrame frame = layered_frame(width, height, {0, 0}, {0, 0}, 11);
    frame.planes[Role::color] = textured_image(width, height, 4, 3);
    ImageF& motion = frame.planes[Role::motion] = noise_image(width, height, 2, 12, -70, 70);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if ((x + 2 * y) % 7 == 0)
                for (int c = 0; c < 2; ++c) motion.at(x, y, c) *= 0.03f;
            frame.planes[Role::inverse_depth].at(x, y) = y < 10                ? 0
                                                         : (x / 5 + y / 3) % 2 ? 0.1f
                                                                               : 0.13f;
        }
    // The surface that differs most forward does not do so both ways.
    add_motion_back(frame);
    frame.planes[Role::motion_back] = noise_image(width, height, 2, 13, -50, 50);
    add_neighbors(frame);
    frame.description.pixel_aspect = 2;
    frame.description.camera.f_stop = 0.2;
    return frame;
}

// Lamps before textured ground, also at the frame's borders, and pixels around them that mix both
// lights.
FramePlanes lamps(int width, int height, float speed, uint32_t seed) {
    FramePlanes planes = layered_frame(width, height, {speed, 9.2f}, {-14.6f, 3.3f}, seed).planes;
    const auto is_lamp = [](int x, int y) { return x >= 0 && y >= 0 && (x / 6 + y / 5) % 3 == 0; };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const bool lamp = is_lamp(x, y);
            planes[Role::inverse_depth].at(x, y) = lamp ? 0.5f : 0.1f;
            planes[Role::motion].at(x, y, 0) = lamp ? speed : -14.6f;
            planes[Role::motion].at(x, y, 1) = lamp ? 9.2f : 3.3f;
            const bool beside =
                is_lamp(x - 1, y) || is_lamp(x + 1, y) || is_lamp(x, y - 1) || is_lamp(x, y + 1);
            if (!lamp && !beside) continue;
            for (int c = 0; c < 3; ++c) planes[Role::color].at(x, y, c) = lamp ? 40.0f : 8.0f;
        }
    }
    planes[Role::motion_back] = planes[Role::motion];
    return planes;
}

TestFrame lamp_frame(int width, int height) {
    TestFrame frame;
    frame.planes = lamps(width, height, 33.4f, 8);
    for (const Neighbor neighbor : kNeighbors)
        for (const auto& [role, plane] : lamps(width, height, 30.3f, 31))
            frame.planes[role_of(neighbor, role)] = plane;
    frame.description = describe(frame.planes);
    frame.description.camera.f_stop = 0.2;
    return frame;
}

PlanOptions complete(RoleSet outputs = {Role::color}) {
    return {.elide = false, .outputs = outputs};
}

class EveryVariant : public ::testing::TestWithParam<Variant> {
  protected:
    // Every plane and every stage.
    static void expect_reference(const Chain& chain, const TestFrame& frame, double tolerance,
                                 double share) {
        const PlanOptions options = complete({Role::color, Role::hint});
        const Stages gpu = filter_with_stages(chain, frame.description, frame.planes, options);
        const ReferenceFrame expected = reference(chain, frame.description, frame.planes, options);
        const auto expect_near = [&](const ImageF& a, const ImageD& b, const std::string& name) {
            const Difference difference = compare(a, b, tolerance);
            EXPECT_LE(difference.fraction, share) << name << ": " << difference.text;
        };
        ASSERT_TRUE(gpu.outputs.contains(Role::color));
        for (const Role role : {Role::color, Role::layers, Role::hint})
            if (const auto plane = gpu.outputs.find(role); plane != gpu.outputs.end())
                expect_near(plane->second, expected.planes.at(role), name_of(role));
        // Around what is held out the reference tells no stages.
        if (frame.description.mattes.empty()) {
            EXPECT_FALSE(expected.stages.empty());
        }
        for (const auto& [name, stage] : expected.stages) {
            ASSERT_TRUE(gpu.stages.contains(name)) << name << " is no texture of the plan";
            expect_near(gpu.stages.at(name), stage, name);
        }
        if (frame.description.layers == 0) return;
        const ImageF& color = gpu.outputs.at(Role::color);
        EXPECT_LE(
            relative_difference(sum_of_layers(gpu.outputs.at(Role::layers), color.height), color),
            1e-5);
    }

    Chain chain() const { return GetParam().chain(); }

    // With a matte of what moves, which the passes that read motion keep still.
    Chain unmoved_chain(std::vector<int>& mattes) const {
        Chain unmoved = chain();
        for (ChainLink& link : unmoved.links) {
            const bool moves = link.pass->roles().required.has(Role::motion);
            mattes.push_back(moves ? 0 : -1);
            if (!moves) continue;
            link.matte = "object";
            link.matte_effect = MatteEffect::unmoved;
        }
        return unmoved;
    }
    TestFrame with_matte(const TestFrame& frame, const ImageF& matte) const {
        TestFrame held = frame;
        add_matte(held, matte, GetParam().links.size());
        return held;
    }
};

TEST_P(EveryVariant, StoresColorAndLayersAsTheirOwnBoundsAllow) {
    FrameDescription frame = rich_frame(kWidth, kHeight).description;
    for (const bool color : {false, true})
        for (const bool layers : {false, true}) {
            frame.bounds.color_is_half = color;
            frame.bounds.layers_are_half = layers;
            PlanOptions options = complete();
            options.precision = Precision::fp16;
            const Plan plan = must(make_plan(chain(), frame, options));
            const auto expect_format = [&](Role role, bool half) {
                const PlanTexture& texture = plan.textures[size_t(plan.outputs.at(role))];
                EXPECT_FALSE(texture.imported);
                EXPECT_EQ(texture.format, half ? Format::rgba16f : Format::rgba32f) << texture.name;
            };
            expect_format(Role::color, color);
            expect_format(Role::layers, layers);
        }
}

TEST_P(EveryVariant, AgreesWithItsReference) {
    const Chain one = chain();
    const auto expect = [&](const char* name, const TestFrame& frame) {
        SCOPED_TRACE(name);
        expect_reference(one, frame, GetParam().tolerance, GetParam().share);
    };
    expect("noisy", noisy_frame(61, 45));
    expect("rich", rich_frame(kWidth, kHeight));
    expect("rich and high", rich_frame(29, 57));
    if (!warps(one)) return;
    expect("lamps", lamp_frame(67, 37));
    TestFrame frame = bright_frame(kWidth, kHeight);
    add_motion_back(frame);
    add_neighbors(frame);
    add_behind(frame);
    add_lights(frame, kLights);
    SCOPED_TRACE("before a layer behind");
    expect_reference(one, frame, 2e-3, 0.02);
}

TEST_P(EveryVariant, AgreesWithItsReferenceBesideMattes) {
    const TestFrame frame = rich_frame(kWidth, kHeight);
    for (const int soft_px : {0, 1, 4}) {
        SCOPED_TRACE(soft_px);
        const ImageF matte = square_matte(kWidth, kHeight, soft_px);
        expect_reference(chain(), with_matte(frame, matte), 2e-3, 0.02);
        if (!reads_motion(chain())) continue;
        TestFrame held = with_matte(frame, matte);
        held.description.mattes.clear();
        const Chain unmoved = unmoved_chain(held.description.mattes);
        expect_reference(unmoved, held, 2e-3, 0.02);
    }
}

TEST_P(EveryVariant, ChangesNoBitForLayersOrMattesOfZero) {
    const TestFrame frame = rich_frame(kWidth, kHeight);
    const auto filtered = [](const Chain& chain, const TestFrame& given) {
        return filter(chain, given.description, given.planes, complete());
    };
    const FramePlanes out = filtered(chain(), frame);
    const auto expect_same = [&](const FramePlanes& other, const char* with) {
        EXPECT_TRUE(equal_bits(other.at(Role::color), out.at(Role::color))) << with;
        if (other.contains(Role::layers)) {
            EXPECT_TRUE(equal_bits(other.at(Role::layers), out.at(Role::layers))) << with;
        }
    };
    expect_same(filtered(chain(), without_layers(frame)), "no layers");
    TestFrame held = with_matte(frame, ImageF(kWidth, kHeight, 1));
    // How much of a pixel is not the object is filtered too.
    if (chain().guarantees().keeps_constants)
        expect_same(filtered(chain(), held), "a matte of zeros");
    held.description.mattes.clear();
    const Chain unmoved = unmoved_chain(held.description.mattes);
    if (reads_motion(unmoved))
        expect_same(filtered(unmoved, held), "a matte that holds nothing still");
    held = with_matte(frame, ImageF(kWidth, kHeight, 1, 1.0f));
    const FramePlanes kept = filtered(chain(), held);
    for (const Role role : {Role::color, Role::layers})
        EXPECT_TRUE(equal_bits(kept.at(role), frame.planes.at(role))) << "a matte of ones";
}

// Whatever the other planes hold.
TEST_P(EveryVariant, KeepsConstants) {
    const Chain one = chain();
    if (!one.guarantees().keeps_constants) return;
    TestFrame frame = noisy_frame(61, 45);
    const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f, -1e30f, -1};
    for (size_t i = 0; i < 6; ++i) {
        frame.planes[Role::motion].at(int(3 + 9 * i), 11, 0) = bad[i];
        frame.planes[Role::motion_back].at(int(5 + 9 * i), 23, 1) = bad[i];
        frame.planes[Role::inverse_depth].at(int(7 + 9 * i), 31) = bad[i];
    }
    const std::pair<Precision, ImageF> cases[] = {
        {Precision::fp32, constant_image(61, 45, {0.3f, 7.1f, 1e-3f, 0.7f})},
        // Halves hold these values.
        {Precision::fp16, constant_image(61, 45, {0.25f, 65504.0f, -0x1.554p-9f, 0x1p-24f})}};
    for (const auto& [precision, color] : cases) {
        for (const Role role : {Role::color, Role::color_before, Role::color_after})
            frame.planes[role] = color;
        frame.description.bounds.color_is_half = precision == Precision::fp16;
        const PlanOptions options = {.precision = precision, .elide = false};
        EXPECT_TRUE(equal_bits(
            filter(one, frame.description, frame.planes, options).at(Role::color), color));
    }
}

// An engine may hand in anything. NaN counts as 0, an infinity or what is too bright as the largest
// half of its sign, as conversion would have made it.
TEST_P(EveryVariant, ReadsColorsAsConversionWouldHaveMadeThem) {
    const TestFrame frame = noisy_frame(61, 45);
    FramePlanes given = frame.planes, converted = frame.planes;
    const std::pair<float, float> values[] = {
        {NAN, 0.0f}, {INFINITY, 65504.0f}, {-INFINITY, -65504.0f}, {3e38f, 65504.0f}};
    for (int i = 0; i < 4; ++i)
        for (int c = 0; c < 4; ++c)
            for (int k = 0; k < 16; ++k) {  // a box of 4 x 4
                const int x = 3 + 13 * c + k % 4, y = 4 + 10 * i + k / 4;
                given[Role::color].at(x, y, c) = values[i].first;
                converted[Role::color].at(x, y, c) = values[i].second;
            }
    const auto color_of = [&](const FramePlanes& planes) {
        return filter(chain(), frame.description, planes, complete()).at(Role::color);
    };
    const ImageF out = color_of(given);
    for (const float value : out.data) ASSERT_TRUE(std::isfinite(value));
    EXPECT_TRUE(equal_bits(out, color_of(converted)));
}

FOR_VARIANTS_THAT(EveryVariant, any_chain);

TEST(Variants, AreOfEveryPass) {
    std::set<std::string> types;
    for (const Variant& one : main_variants())
        for (const Variant::Link& link : one.links) types.insert(link.type);
    for (const PassType& type : every_pass().types())
        EXPECT_EQ(types.count(type.name), 1u) << type.name;
}

}  // namespace
}  // namespace postchain::test::variant_test

// Rules that leave out a whole pass: identity_by_facts, off_by_configuration, camera_cut,
// missing_plane.
#include <cmath>
#include <limits>

#include "passes/depth_of_field/depth_of_field.h"
#include "tests/elision/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

// Counts which way the rule went.
struct Count {
    int left = 0, kept = 0;
    void add(const Elided& elided, const std::string& rule) {
        ASSERT_EQ(elided.plan.passes.size(), 1u);
        EXPECT_EQ(elided.plan.passes[0].elided, elided.used(rule));
        EXPECT_EQ(elided.plan.steps.empty(), elided.used(rule));
        (elided.used(rule) ? left : kept) += 1;
    }
};

Elided by_facts(const Chain& chain, const FramePlanes& planes, Precision precision) {
    return expect_same_bits(chain, describe(planes), planes, only({kRuleFacts}, precision));
}

// Speeds a few floats on either side of the one whose half-velocity is min_speed_px, in every
// storage of half-velocities, whose rounding may lengthen them.
TEST(IdentityByFacts, MotionBlurAroundItsLeastSpeed) {
    Count count;
    const std::array<float, 2> directions[] = {
        {1.0f, 0.0f}, {0.6f, -0.8f}, {0.70710678f, 0.70710678f}};
    size_t cases = 0;
    const ImageF color = half_noise(33, 18, 4, 1);
    for (const char* storage : {"auto", "fp32", "fp16", "unorm8"})
        for (const double shutter : {0.5, 1.0 / 3, 2.0})
            for (const double least : {0.5, 2.3, 0.01, 0.0})
                for (const int steps : {-3, -1, 0, 1, 3, 300}) {
                    const std::array<float, 2> d = directions[++cases % 3];
                    const float speed =
                        neighbor(float(2 * least / shutter), least > 0 ? steps : 0) +
                        (least > 0 ? 0.0f : 1e-20f * float(std::max(steps, 0)));
                    SCOPED_TRACE(concat(storage, " shutter ", shutter, " least ", least, " px, ",
                                        steps, " steps, along ", d[0], ",", d[1]));
                    FramePlanes planes = flat_planes(color);
                    planes[Role::motion].at(16, 9, 0) = speed * d[0];
                    planes[Role::motion].at(16, 9, 1) = speed * d[1];
                    count.add(by_facts(chain_of("motion_blur",
                                                {{"mode", "guertin"},
                                                 {"min_speed_px", least},
                                                 {"shutter_frames", shutter},
                                                 {"samples", int64_t(5)},
                                                 {"max_blur_px", int64_t(20)},
                                                 {"velocity_storage", std::string(storage)}}),
                                       planes, kPrecisions[steps & 1]),
                              kRuleFacts);
                }
    EXPECT_GT(count.left, 60);
    EXPECT_GT(count.kept, 60);
}

// Two grays in a pattern with every kind of edge; their lumas differ by the threshold, give or take
// less and less.
TEST(IdentityByFacts, FxaaAroundItsThreshold) {
    Count count;
    for (const char* luma : {"stored", "display"})
        for (const double low : {0.0, 0.02, 0.4, 3.0})
            for (const auto& [relative, absolute] :
                 {std::pair{0.166, 0.0833}, {0.3, 0.0}, {0.0, 0.02}, {0.9, 0.5}})
                for (const double off :
                     {-0.1, -1e-3, -1e-4, -1e-5, -1e-6, 0.0, 1e-6, 1e-4, 0.1, 3.0}) {
                    const bool display = luma == "display"s;
                    const double low_luma = display ? std::sqrt(low / (1 + low)) : low;
                    const double range = std::max(absolute, relative * low_luma) * (1 + off);
                    const double high_luma = std::min(low_luma + range, display ? 0.999 : 1e9);
                    const double squared = high_luma * high_luma;
                    const double high = display ? squared / (1 - squared) : high_luma;
                    SCOPED_TRACE(concat(luma, " low ", low, " thresholds ", relative, " ", absolute,
                                        " off by ", off));
                    ImageF color(29, 23, 4, 1);
                    for (int y = 0; y < 23; ++y)
                        for (int x = 0; x < 29; ++x)
                            for (int c = 0; c < 3; ++c)
                                color.at(x, y, c) =
                                    float((x + 3 * y) % 11 < 4 || x == 20 ? high : low);
                    count.add(by_facts(chain_of("fxaa", {{"luma", std::string(luma)},
                                                         {"edge_threshold", relative},
                                                         {"edge_threshold_min", absolute},
                                                         {"hint", "none"s}}),
                                       flat_planes(color), kPrecisions[off > 0]),
                              kRuleFacts);
                }
    EXPECT_GT(count.left, 60);
    EXPECT_GT(count.kept, 60);
}

// Colored noise between two bounds: the luma of each channel's bounds holds for all mixtures.
TEST(IdentityByFacts, FxaaOnNoiseBetweenBounds) {
    Count count;
    for (const char* luma : {"stored", "display"})
        for (const float exposure : {-3.0f, 0.0f, 2.0f})
            for (int k = 0; k < 12; ++k) {
                const float low = 0.05f * float(k * k), span = 0.02f * float(1 + k);
                ImageF color = noise_image(31, 22, 4, uint32_t(k), low, low + span);
                color.at(3, 3, k % 3) = low + 2 * span;
                SCOPED_TRACE(concat(luma, " ", exposure, " stops, ", low, " + ", span));
                count.add(by_facts(chain_of("fxaa", {{"luma", std::string(luma)},
                                                     {"exposure_ev", double(exposure)}}),
                                   flat_planes(color), kPrecisions[k % 2]),
                          kRuleFacts);
            }
    EXPECT_GT(count.left, 10);
    EXPECT_GT(count.kept, 10);
}

// Black, with two alphas in a pattern.
TEST(IdentityByFacts, FxaaOnEdgesOfAlpha) {
    Count count;
    for (const double least : {0.0833, 0.5})
        for (const double off : {-0.1, -1e-3, 1e-3, 0.1}) {
            SCOPED_TRACE(concat(least, " off by ", off));
            ImageF color(29, 23, 4);
            for (int y = 0; y < 23; ++y)
                for (int x = 0; x < 29; ++x)
                    color.at(x, y, 3) = (x + 3 * y) % 11 < 4 ? float(least * (1 + off)) : 0.0f;
            count.add(by_facts(chain_of("fxaa", {{"edge_threshold", 0.0},
                                                 {"edge_threshold_min", least},
                                                 {"hint", "none"s}}),
                               flat_planes(color), kPrecisions[off > 0]),
                      kRuleFacts);
        }
    EXPECT_EQ(count.left, 4);
    EXPECT_EQ(count.kept, 4);
}

struct OneColor {
    std::string name;
    std::array<float, 4> pixel;
    int off_by;  // steps of the channel 1 of one pixel
    bool left;
};

std::vector<OneColor> one_colors() {
    std::vector<OneColor> all = {
        {"gray", {0.3f, 0.3f, 0.3f, 1}, 0, true},
        {"zero", {0, 0, 0, 0}, 0, true},
        {"negative", {-1.5f, 0.2f, -3, 0.5f}, 0, true},
        {"large", {65504, 3e9f, 1e30f, 1}, 0, true},
        {"one pixel off by an ulp", {0.3f, 0.3f, 0.3f, 1}, 1, false},
        {"one pixel off by an ulp below", {0.7f, 1.0f, 0.3f, 1}, -1, false},
        {"minus zero", {0.25f, -0.0f, 0.5f, 1}, 0, false},
        {"all minus zero", {-0.0f, -0.0f, -0.0f, -0.0f}, 0, false},
        {"smallest half", {0x1p-24f, 0x1p-20f, 0x1p-15f, 1}, 0, true},
        {"smallest normal", {0x1p-126f, 0x1p-125f, 0x1p-126f, 1}, 0, true},
    };
    // A GPU may take it for 0 (docs/performance.md).
    if (executor().device_class() == DeviceClass::software)
        all.push_back({"subnormal", {1e-40f, 3e-39f, 0x1p-149f, 1}, 0, true});
    return all;
}

// Chains of one blur or FXAA on a frame of one color, or almost one.
TEST(IdentityByFacts, OfOneColor) {
    const auto fxaa = [](const char* hint, const char* blend) {
        return chain_of("fxaa", {{"hint", std::string(hint)}, {"blend", std::string(blend)}});
    };
    struct Case {
        Chain chain;
        // Without a hint a difference of one step, or of signs of zero, is below the threshold.
        // With one FXAA blends whatever the luma.
        bool any = false, hint = false;
    };
    const Case cases[] = {{chain_of("motion_blur", {{"mode", "guertin"}, {"samples", int64_t(9)}})},
                          {fxaa("none", "tonemapped"), true},
                          {fxaa("checkerboard", "tonemapped"), false, true},
                          {fxaa("checkerboard", "stored"), false, true},
                          {fxaa("threshold", "tonemapped"), false, true},
                          {fxaa("threshold", "stored"), false, true}};
    for (const OneColor& one : one_colors())
        for (const Case& given : cases)
            for (const Precision precision : kPrecisions) {
                SCOPED_TRACE(concat(one.name, " ", name_of(precision), " ", given.chain.text()));
                const auto& c = one.pixel;
                FramePlanes planes =
                    flat_planes(constant_image(35, 18, {c[0], c[1], c[2], c[3]}), {9, -4});
                float& odd = planes[Role::color].at(17, 9, 1);
                odd = neighbor(odd, one.off_by);
                for (int x = 0; x < 20; ++x) planes[Role::inverse_depth].at(x, 6) = 0.4f;
                if (given.hint) planes[Role::hint] = noise_image(35, 18, 2, 3, 0, 1.5f);
                const Elided elided = by_facts(given.chain, planes, precision);
                EXPECT_EQ(elided.plan.passes[0].elided, one.left || given.any);
            }
}

// Luma is held to 1e30: beyond it a bound computed without that would call an edge flat.
TEST(IdentityByFacts, FxaaStaysWhereLumaIsHeld) {
    struct Case {
        const char* luma;
        double exposure_ev;
        float red, green, box;
    };
    for (const Case& one : {Case{"display", 0, 1e35f, 1e28f, 1e31f},
                            {"display", 32, 1e25f, 1e18f, 1e21f},
                            {"stored", 0, 1e35f, 0, 1e31f}}) {
        SCOPED_TRACE(concat(one.luma, " ", one.exposure_ev));
        FramePlanes planes = flat_planes(constant_image(40, 30, {one.red, one.green, 0, 1}));
        for (int y = 8; y < 20; ++y)
            for (int x = 10; x < 30; ++x) planes[Role::color].at(x, y, 1) = one.box;
        const Chain chain = chain_of(
            "fxaa",
            {{"hint", "none"s}, {"luma", std::string(one.luma)}, {"exposure_ev", one.exposure_ev}});
        expect_same_bits(chain, describe(planes), planes, only({kRuleFacts}));
    }
}

// A primary beyond the visible, as the blue of ACES2065-1, has a negative weight: bounds of the
// channels are none of the luma. Nor is a color that is not bounded.
TEST(IdentityByFacts, FxaaStaysWhereLumaHasNoBounds) {
    ImageF color = constant_image(40, 30, {0.5f, 0.25f, 0, 1});
    color.at(20, 15, 2) = 0.02f;
    const Chain chain = chain_of("fxaa", {{"luma", "display"s}, {"hint", "none"s}});
    const auto elided = [&](const FrameDescription& frame) {
        return must(make_plan(chain, frame, only({kRuleFacts}))).passes[0].elided;
    };
    FrameDescription frame = describe(flat_planes(color));
    EXPECT_TRUE(elided(frame));
    for (const auto bound : {&FrameBounds::min_color, &FrameBounds::max_color})
        for (const size_t c : {0u, 1u, 2u}) {
            FrameDescription unknown = frame;
            (unknown.bounds.*bound)[c] = FrameBounds::kUnknown;
            EXPECT_FALSE(elided(unknown)) << c;
        }
    frame.luma_weights = {0.3440, 0.7282, -0.0722};
    EXPECT_FALSE(elided(frame));
}

// FXAA after a blur that is left out: in the complete run the blur writes a hint of 0 for the whole
// frame, which equals no hint, and takes the place of the frame's own and of an earlier blur's.
// FXAA where: blurred is then left out too.
TEST(IdentityByFacts, ABlurLeftOutLeavesNoHint) {
    const std::pair<const char*, double> left_out[] = {{"min_speed_px", 50.0},
                                                       {"shutter_frames", 0.0}};
    const std::array<const char*, 3> readers[] = {{"checkerboard", "tile", "everywhere"},
                                                  {"threshold", "pixel", "everywhere"},
                                                  {"none", "pixel", "blurred"}};
    for (const auto& [key, value] : left_out)
        for (const auto& [hint, gate, where] : readers)
            for (const char* former : {"none", "frame", "blur"}) {
                SCOPED_TRACE(concat(key, " ", hint, " ", where, ", former hint: ", former));
                const Precision precision = kPrecisions[hint == "threshold"s];
                Chain chain;
                if (former == "blur"s)
                    append(chain, "motion_blur", {{"mode", "guertin"}, {"samples", int64_t(5)}});
                append(chain, "motion_blur",
                       {{"mode", "guertin"}, {"samples", int64_t(5)}, {key, value}});
                append(chain, "fxaa",
                       {{"hint", std::string(hint)},
                        {"hint_gate", std::string(gate)},
                        {"where", std::string(where)}});
                FramePlanes planes = flat_planes(half_noise(50, 37, 4, 1), {12, 3});
                if (former == "frame"s) planes[Role::hint] = constant_image(50, 37, {1, 1});
                const Elided elided =
                    expect_same_bits(chain, describe(planes), planes,
                                     only({kRuleFacts, kRuleConfiguration}, precision));
                const auto& passes = elided.plan.passes;
                EXPECT_TRUE(passes[passes.size() - 2].elided);
                EXPECT_EQ(passes.back().elided, where == "blurred"s);
            }
}

// ------------------------------------------------------------------------ off by configuration

TEST(OffByConfiguration, ReturnsEveryBit) {
    FramePlanes planes = flat_planes(half_noise(41, 23, 4, 8), {30, -8});
    for (int x = 0; x < 41; ++x) planes[Role::inverse_depth].at(x, x / 2) = x % 2 ? 0 : 3;
    const auto blur = [](const char* key, double value) {
        return chain_of("motion_blur", {{"mode", "guertin"}, {key, value}});
    };
    const auto lens = [](double max_radius_px) {
        return chain_of("depth_of_field", {{"method", "gilham"}, {"max_radius_px", max_radius_px}});
    };
    Chain pinhole = chain_of("depth_of_field", {{"method", "gilham"}});
    pinhole.links[0].pass->parameters().as<depth_of_field::Parameters>().lens.f_stop =
        std::numeric_limits<double>::infinity();
    struct Case {
        Chain chain;
        bool off = true;
    };
    const Case cases[] = {{blur("shutter_frames", 0)},
                          {blur("shutter_angle_deg", 0)},
                          {blur("shutter_frames", 1e-9), false},
                          {lens(0)},
                          {lens(0.5)},
                          {lens(0.5 + 1e-9), false},
                          {chain_of("depth_of_field", {{"method", "gilham"},
                                                       {"coc", "planes"s},
                                                       {"max_near_fraction", 0.5 / 41},
                                                       {"max_far_fraction", 0.1 / 41}})},
                          {std::move(pinhole)}};
    for (const auto& [chain, off] : cases)
        for (const Precision precision : kPrecisions) {
            SCOPED_TRACE(chain.links[0].text());
            const Elided elided = expect_same_bits(chain, describe(planes), planes,
                                                   only({kRuleConfiguration}, precision));
            EXPECT_EQ(elided.used(kRuleConfiguration), off);
            EXPECT_EQ(elided.plan.steps.empty(), off);
        }
}

// ------------------------------------------------------------------- camera cut, missing planes

TEST(CameraCut, ReturnsTheInput) {
    const FramePlanes planes = flat_planes(half_noise(41, 23, 4, 8), {30, -8});
    FrameDescription frame = describe(planes);
    frame.bounds.camera_cut = true;
    const Chain chain = chain_of("motion_blur", {{"mode", "guertin"}});
    for (const Precision precision : kPrecisions) {
        Plan plan;
        const FramePlanes cut =
            filter(chain, frame, planes, only({kRuleCameraCut}, precision), &plan);
        EXPECT_TRUE(plan.passes[0].elided);
        EXPECT_EQ(first_difference(planes.at(Role::color), cut.at(Role::color)), "");
        // Without the rule it is blurred all the same.
        PlanOptions without{.precision = precision, .rules_off = {kRuleCameraCut}};
        const Elided blurred = expect_same_bits(chain, frame, planes, without);
        EXPECT_FALSE(equal_bits(planes.at(Role::color), blurred.outputs.at(Role::color)));
    }
}

// The lens still blurs.
TEST(CameraCut, ClosesTheShutterOfTheJointBlur) {
    const FramePlanes planes = flat_planes(half_noise(41, 23, 4, 8), {30, -8}, 3);
    FrameDescription frame = describe(planes);
    const Chain cut = chain_of("joint_blur", {{"samples", int64_t(8)}, {"f_stop", 2.0}});
    const Chain closed =
        chain_of("joint_blur", {{"samples", int64_t(8)}, {"f_stop", 2.0}, {"shutter_frames", 0.0}});
    const auto color = [&](const Chain& chain, const PlanOptions& options) {
        return filter(chain, frame, planes, options).at(Role::color);
    };
    const ImageF blurred = color(cut, no_rule()), unmoved = color(closed, no_rule());
    frame.bounds.camera_cut = true;
    EXPECT_NE(first_difference(blurred, unmoved), "");
    EXPECT_NE(first_difference(planes.at(Role::color), unmoved), "");
    EXPECT_EQ(first_difference(color(cut, only({kRuleCameraCut})), unmoved), "");
    EXPECT_EQ(first_difference(color(cut, {.rules_off = {kRuleCameraCut}}), blurred), "");
    const Chain sharp = chain_of("joint_blur", {{"max_radius_px", 0.5}});
    const auto plan = make_plan(sharp, frame, only({kRuleCameraCut}));
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    EXPECT_TRUE(plan->passes[0].elided);
}

TEST(MissingPlane, IsTheChainWithoutThatPass) {
    for (const Role missing : {Role::motion, Role::inverse_depth}) {
        FramePlanes planes = flat_planes(half_noise(61, 33, 4, 8), {30, -8}, 3);
        planes.erase(missing);
        const FrameDescription frame = describe(planes);
        Chain chain, rest;
        for (const char* type : {"motion_blur", "fxaa", "depth_of_field"}) {
            append(chain, type);
            const bool needs =
                type != "fxaa"s && (missing == Role::inverse_depth || type == "motion_blur"s);
            if (!needs) append(rest, type);
        }
        EXPECT_FALSE(make_plan(chain, frame, PlanOptions()).ok());
        for (const Precision precision : kPrecisions) {
            const FramePlanes elided =
                filter(chain, frame, planes, only({kRuleMissingPlane}, precision));
            EXPECT_EQ(
                first_difference(filter(rest, frame, planes, no_rule(precision)).at(Role::color),
                                 elided.at(Role::color)),
                "");
        }
    }
}

}  // namespace
}  // namespace postchain::test

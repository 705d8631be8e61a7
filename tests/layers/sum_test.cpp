// Lights that sum to color do so when they are filtered: the proof that layers get color's weights.
#include <set>

#include "chain/layered_step.h"
#include "tests/layers/support.h"

namespace postchain::test {
namespace {

constexpr double kSumTolerance = 1e-5;

void expect_sum(const NamedChain& one, const TestFrame& frame, const char* what) {
    const int height = frame.description.height;
    ASSERT_LT(relative_difference(sum_of(frame.planes.at(Role::layers), height),
                                  frame.planes.at(Role::color)),
              1e-6);
    Plan plan;
    const FramePlanes out = filter(one.chain, frame.description, frame.planes, {}, &plan);
    ASSERT_TRUE(out.count(Role::layers)) << one.name;
    // Something is filtered.
    EXPECT_GT(relative_difference(out.at(Role::color), frame.planes.at(Role::color)), 1e-3)
        << one.name << ", " << what;
    EXPECT_LE(relative_difference(sum_of(out.at(Role::layers), height), out.at(Role::color)),
              kSumTolerance)
        << one.name << ", " << what;
}

TEST(Layers, LightsSumToTheFilteredColorInEveryMode) {
    TestFrame alone = bright_frame(67, 45);
    TestFrame neighbored = alone;
    add_neighbors(neighbored);
    add_lights(alone, kLayersPerStep);
    add_lights(neighbored, kLayersPerStep);
    for (const NamedChain& one : every_mode()) {
        expect_sum(one, alone, "alone");
        const RoleSet usable = one.chain.optional();
        if (usable.of(Neighbor::before).empty()) continue;
        expect_sum(one, neighbored, "with neighbors");
    }
}

TEST(Layers, LightsOfATracedPictureSumToItFiltered) {
    TestFrame frame = traced_frame();
    add_lights(frame, 4);
    for (const NamedChain& one : every_mode()) expect_sum(one, frame, "traced");
}

// However many: those beyond the first few have steps of their own.
TEST(Layers, AnyNumberOfThemSums) {
    std::vector<NamedChain> chains;
    chains.push_back({"joint_blur, fxaa", chain_of("joint_blur")});
    append(chains.back().chain, "fxaa");
    chains.push_back({"gilham, guertin", chain_of("depth_of_field", {{"method", "gilham"}})});
    append(chains.back().chain, "motion_blur", {{"mode", "guertin"}});
    for (const int count : {1, 2, kLayersPerStep + 1, 2 * kLayersPerStep + 3}) {
        TestFrame frame = bright_frame(45, 37);
        add_lights(frame, count);
        for (const NamedChain& one : chains) expect_sum(one, frame, "count");
    }
}

// Patches of color, each in one of many layers that are 0 elsewhere: a layer that a step takes for
// 0 somewhere though it is not leaves a hole in the sum.
TEST(Layers, PatchesOfColorSumToIt) {
    constexpr int kLayers = 37;  // more than 32, the bits of a word
    TestFrame alone = bright_frame(101, 70);
    TestFrame neighbored = alone;
    add_neighbors(neighbored);
    const auto split = [](TestFrame& frame, Role from, Role to, int shift) {
        const ImageF& color = frame.planes.at(from);
        std::vector<ImageF> layers(kLayers, ImageF(color.width, color.height, 4));
        for (int y = 0; y < color.height; ++y)
            for (int x = 0; x < color.width; ++x)
                for (int c = 0; c < 4; ++c)
                    layers[size_t(x / 13 + 8 * (y / 11) + shift) % kLayers].at(x, y, c) =
                        color.at(x, y, c);
        frame.planes[to] = stack_planes(layers);
        frame.description.planes.add(to);
        frame.description.layers = kLayers;
    };
    split(alone, Role::color, Role::layers, 0);
    split(neighbored, Role::color, Role::layers, 0);
    for (const Neighbor neighbor : kNeighbors)
        split(neighbored, role_of(neighbor, Role::color), role_of(neighbor, Role::layers),
              5 + int(neighbor));
    for (const NamedChain& one : every_mode()) {
        expect_sum(one, alone, "alone");
        if (!one.chain.optional().of(Neighbor::before).empty())
            expect_sum(one, neighbored, "with neighbors");
    }
}

// One program each, however many layers.
TEST(Layers, MoreOfThemNeedNoMorePrograms) {
    for (const NamedChain& one : every_mode()) {
        std::vector<std::set<std::string>> programs;
        for (const int count : {kLayersPerStep + 1, 2 * kLayersPerStep + 3, 100}) {
            TestFrame frame = bright_frame(45, 37);
            add_lights(frame, count);
            const auto plan = make_plan(one.chain, frame.description);
            ASSERT_TRUE(plan.ok()) << plan.status().message();
            programs.emplace_back();
            for (const Step& step : plan->steps) programs.back().insert(step.program.text());
        }
        EXPECT_EQ(programs[0], programs[1]) << one.name;
        EXPECT_EQ(programs[0], programs[2]) << one.name;
    }
}

// Color comes out as without layers, to the bit; and a frame without layers is planned as before.
TEST(Layers, ChangeNoBitOfColor) {
    TestFrame without = bright_frame(67, 45);
    add_neighbors(without);
    TestFrame with = without;
    add_lights(with, kLayersPerStep + 1);
    for (const NamedChain& one : every_mode()) {
        Plan plain, layered;
        const FramePlanes a = filter(one.chain, without.description, without.planes, {}, &plain);
        const FramePlanes b = filter(one.chain, with.description, with.planes, {}, &layered);
        EXPECT_TRUE(equal_bits(a.at(Role::color), b.at(Role::color))) << one.name;
        EXPECT_EQ(a.count(Role::layers), 0u);
        for (const Step& step : plain.steps) {
            EXPECT_EQ(step.layers, 0) << step.name;
            EXPECT_EQ(step.program.defines.count("LAYERS"), 0u) << step.name;
        }
    }
}

// A layer that is color comes out as color does.
TEST(Layers, ALayerThatIsColorIsFilteredAsColor) {
    TestFrame frame = bright_frame(67, 45);
    frame.planes[Role::layers] = frame.planes.at(Role::color);
    frame.description.layers = 1;
    frame.description.planes.add(Role::layers);
    for (const NamedChain& one : every_mode()) {
        const FramePlanes out = filter(one.chain, frame.description, frame.planes);
        EXPECT_LE(relative_difference(out.at(Role::layers), out.at(Role::color)), 1e-6) << one.name;
    }
}

// Each light against the double-precision reference, which gives it the weights that it finds for
// color; stages too.
TEST(Layers, AgreeWithTheReferenceInEveryMode) {
    TestFrame alone = bright_frame(45, 37);
    TestFrame neighbored = alone;
    add_neighbors(neighbored);
    add_lights(alone, kLayersPerStep);
    add_lights(neighbored, kLayersPerStep);
    for (const NamedChain& one : every_mode()) {
        for (const TestFrame* frame : {&alone, &neighbored}) {
            if (frame == &neighbored && one.chain.optional().of(Neighbor::before).empty()) continue;
            const Stages gpu = filter_with_stages(one.chain, frame->description, frame->planes);
            const ReferenceFrame expected = reference(one.chain, frame->description, frame->planes);
            // Highlights of 40; a tap or a decision that rounds the other way moves single pixels.
            const Difference out =
                compare(gpu.outputs.at(Role::layers), expected.planes.at(Role::layers), 2e-3);
            EXPECT_LE(out.fraction, 0.02) << one.name << ": " << out.text;
            int stages = 0;
            for (const auto& [name, stage] : expected.stages) {
                if (name.find("layers") == std::string::npos) continue;
                ++stages;
                ASSERT_TRUE(gpu.stages.count(name)) << one.name << ": " << name;
                const Difference difference = compare(gpu.stages.at(name), stage, 2e-3);
                EXPECT_LE(difference.fraction, 0.02)
                    << one.name << ", " << name << ": " << difference.text;
            }
            EXPECT_GT(stages, 0) << one.name;
        }
    }
}

bool is_image(const Binding& binding) {
    return binding.access == Access::read || binding.access == Access::write;
}

// At most the units that GL 4.3 guarantees: 8 images, 16 samplers.
TEST(Layers, NoStepNeedsMoreUnitsThanEveryDeviceHas) {
    TestFrame frame = bright_frame(45, 37);
    add_neighbors(frame);
    add_behind(frame);
    add_lights(frame, kLayersPerStep + 1);
    for (const NamedChain& one : every_mode()) {
        PlanOptions options;
        options.outputs.add(Role::hint);
        const auto plan = make_plan(one.chain, frame.description, options);
        ASSERT_TRUE(plan.ok()) << plan.status().message();
        for (const Step& step : plan->steps)
            for (const Binding& binding : step.bindings)
                EXPECT_LT(binding.unit, is_image(binding) ? 8 : 16)
                    << one.name << ": " << step.name;
    }
}

}  // namespace
}  // namespace postchain::test

// Lights that sum to color do so when they are filtered: the proof that layers get color's weights.
#include <set>

#include "chain/pass/pass.h"
#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

void expect_sum(const Chain& chain, const TestFrame& frame) {
    const int height = frame.description.height;
    ASSERT_LT(relative_difference(sum_of_layers(frame.planes.at(Role::layers), height),
                                  frame.planes.at(Role::color)),
              1e-6);
    const FramePlanes out = filter(chain, frame.description, frame.planes);
    ASSERT_TRUE(out.count(Role::layers));
    // Something is filtered.
    EXPECT_GT(relative_difference(out.at(Role::color), frame.planes.at(Role::color)), 1e-3);
    EXPECT_LE(relative_difference(sum_of_layers(out.at(Role::layers), height), out.at(Role::color)),
              1e-5);
}

// However many: those beyond the first few have steps of their own.
TEST(Layers, AnyNumberOfThemSums) {
    for (const Variant& one : one_of_each_kind())
        for (const int count : {1, 2, kLayersPerStep + 1, 2 * kLayersPerStep + 3}) {
            SCOPED_TRACE(concat(one.name, ", ", count));
            TestFrame frame = bright_frame(45, 37);
            add_lights(frame, count);
            expect_sum(one.chain(), frame);
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
    TestFrame defocused = alone;  // at its borders too
    defocused.description.camera.focus_distance = *alone.description.camera.focus_distance / 4;
    for (const Variant& one : one_of_each_kind()) {
        SCOPED_TRACE(one.name);
        expect_sum(one.chain(), alone);
        if (one.name == "gilham") expect_sum(one.chain(), defocused);
        if (!one.chain().optional().has(Role::color_before)) continue;
        expect_sum(one.chain(), neighbored);
        for (const Neighbor absent : kNeighbors) {
            TestFrame one_sided = neighbored;
            for (const Role role : kNeighborRoles) {
                one_sided.planes.erase(role_of(absent, role));
                one_sided.description.planes.remove(role_of(absent, role));
            }
            expect_sum(one.chain(), one_sided);
        }
    }
}

// One program each, however many layers.
TEST(Layers, MoreOfThemNeedNoMorePrograms) {
    for (const Variant& one : main_variants()) {
        std::vector<std::set<std::string>> programs;
        for (const int count : {kLayersPerStep + 1, 2 * kLayersPerStep + 3, 100}) {
            TestFrame frame = bright_frame(45, 37);
            add_lights(frame, count);
            const auto plan = make_plan(one.chain(), frame.description);
            ASSERT_TRUE(plan.ok()) << plan.status().message();
            programs.emplace_back();
            for (const Step& step : plan->steps) programs.back().insert(step.program.text());
        }
        EXPECT_EQ(programs[0], programs[1]) << one.name;
        EXPECT_EQ(programs[0], programs[2]) << one.name;
    }
}

// At most the units that GL 4.3 guarantees: 8 images, 16 samplers.
TEST(Layers, NoStepNeedsMoreUnitsThanEveryDeviceHas) {
    TestFrame frame = bright_frame(45, 37);
    add_neighbors(frame);
    add_behind(frame);
    add_lights(frame, kLayersPerStep + 1);
    for (const Variant& one : main_variants()) {
        PlanOptions options;
        options.outputs.add(Role::hint);
        const auto plan = make_plan(one.chain(), frame.description, options);
        ASSERT_TRUE(plan.ok()) << plan.status().message();
        for (const Step& step : plan->steps)
            for (const Binding& binding : step.bindings) {
                const bool image =
                    binding.access == Access::read || binding.access == Access::write;
                EXPECT_LT(binding.unit, image ? 8 : 16) << one.name << ": " << step.name;
            }
    }
}

}  // namespace
}  // namespace postchain::test

// Random chains on frames that change their values: a plan whose uniforms were replaced against a
// plan that was made for the frame, and the programs of plans against those that were listed
// before.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "chain/plan/plan.h"
#include "tests/elision/random_case.h"
#include "tests/elision/support.h"

namespace postchain::test {
namespace {

// Another size, camera, other bounds and another number of the same frame: what an engine changes
// from one to the next, in small steps and in large ones.
FrameDescription other_values(const FrameDescription& frame, Random& random) {
    FrameDescription other = frame;
    other.frame_number = random.whole(0, 1000);
    if (random.chance(0.5)) {
        other.width = random.whole(1, 2 * frame.width);
        other.height = random.whole(1, 2 * frame.height);
        other.display_width = other.width + random.whole(0, 300);
        other.display_height = other.height;
    }
    Camera& camera = other.camera;
    const double step = random.chance(0.5) ? 1.05 : 20;
    const auto vary = [&](std::optional<double>& value) {
        if (value && random.chance(0.7)) *value *= random.logarithmic(1 / step, step);
    };
    vary(camera.focal_length_mm);
    vary(camera.sensor_width_mm);
    vary(camera.f_stop);
    vary(camera.focus_distance);
    vary(camera.meters_per_unit);
    if (random.chance(0.5)) camera.shutter_frames = random.real(0, 1.5);
    if (random.chance(0.1)) camera.shutter_frames = 0;
    if (random.chance(0.1)) camera.aperture_blades = random.whole(0, 9);
    FrameBounds& bounds = other.bounds;
    bounds.camera_cut = random.chance(0.1);
    if (random.chance(0.3)) bounds.max_speed_px = random.logarithmic(0.1, 300);
    if (random.chance(0.2)) bounds.max_speed_px = FrameBounds::kUnknown;
    if (random.chance(0.3)) bounds.max_inverse_depth = random.logarithmic(0.01, 3);
    if (random.chance(0.3))
        bounds.min_inverse_depth = random.chance(0.5) ? 0 : 0.5 * bounds.max_inverse_depth;
    if (!std::isfinite(bounds.min_inverse_depth)) bounds.min_inverse_depth = 0;
    return other;
}

// A frame of a size at which a lens blurs by more than a few pixels, and parameters left to the
// camera that random_case() always sets.
void enlarge(RandomCase& one, Random& random) {
    one.frame.width = one.frame.display_width = 1280;
    one.frame.height = one.frame.display_height = 720;
    for (const Neighbor neighbor : kNeighbors)
        for (const Role role : kFileRoles) one.frame.planes.add(role_of(neighbor, role));
    for (auto& link : one.chain.links)
        for (const Parameter& row : link.type->parameters->rows())
            if (row.optional && random.chance(0.5)) row.set(link.pass->parameters(), {});
}

// The largest tiles decide how large textures are made, and programs and steps do not tell.
TEST(Values, AnotherTileEdgeIsAnotherShape) {
    const TestFrame frame = layered_frame(96, 64, {23.0f, -11.0f}, {17.0f, 3.0f}, 5);
    const auto plan_of = [&](int64_t tile_px) {
        const Chain chain =
            chain_of("motion_blur", {{"mode", "guertin"}, {"max_blur_px", tile_px}});
        auto plan = make_plan(chain, frame.description, {});
        EXPECT_TRUE(plan.ok()) << plan.status().message();
        return std::move(*plan);
    };
    EXPECT_TRUE(same_shape(plan_of(16), plan_of(16)));
    EXPECT_FALSE(same_shape(plan_of(16), plan_of(64)));
}

TEST(Values, APlanWithAnothersValuesIsThatPlan) {
    int same = 0, others = 0, moved = 0;
    for (uint64_t i = 0; i < 800; ++i) {
        const uint64_t seed = i * kCasesOfAShape / 4;  // nothing is compiled: many shapes
        RandomCase one = random_case(seed);
        Random random(seed + 77);
        if (random.chance(0.6)) enlarge(one, random);
        const RuleNames rules = one.elided.rules(one.chain);
        ResolvedChain resolved;
        if (!resolved.resolve(one.chain, one.frame, one.elided, rules).ok()) continue;
        const PlanShape shape = resolved.shape();
        auto plan = make_plan(one.chain, one.frame, one.elided);
        ASSERT_TRUE(plan.ok()) << plan.status().message();
        for (int k = 0; k < 4; ++k) {
            const FrameDescription frame = other_values(one.frame, random);
            const Status status = resolved.resolve(one.chain, frame, one.elided, rules);
            const auto fresh = make_plan(one.chain, frame, one.elided);
            ASSERT_EQ(status.ok(), fresh.ok());
            if (!status.ok()) {
                EXPECT_EQ(status.message(), fresh.status().message());
                continue;
            }
            if (resolved.shape() != shape) {
                ++others;
                continue;
            }
            ++same;
            SCOPED_TRACE(concat("seed ", seed, "\n", one.text));
            ASSERT_TRUE(same_shape(*plan, *fresh));
            write_values(resolved, *plan);
            EXPECT_EQ(plan->frame_number, frame.frame_number);
            ASSERT_TRUE(plan->textures == fresh->textures);
            EXPECT_EQ(plan->width, fresh->width);
            EXPECT_EQ(plan->height, fresh->height);
            for (size_t s = 0; s < fresh->steps.size(); ++s) {
                SCOPED_TRACE(plan->steps[s].name);
                ASSERT_EQ(plan->steps[s].groups, fresh->steps[s].groups);
                ASSERT_EQ(plan->steps[s].uniforms, fresh->steps[s].uniforms);
            }
            moved += k > 0;
        }
    }
    // Most frames keep the shape, and enough do not.
    EXPECT_GT(same, 1200);
    EXPECT_GT(others, 100);
    EXPECT_GT(moved, 600);
}

// Frames of one kind: whatever their camera, bounds and number are, their plans take programs from
// the list alone.
TEST(Programs, AreListedBeforeAnyFrameNeedsThem) {
    size_t planned = 0, listed = 0, needed = 0;
    for (uint64_t i = 0; i < 150; ++i) {
        const uint64_t seed = i * kCasesOfAShape / 4;
        RandomCase one = random_case(seed);
        Random random(seed + 99);
        if (random.chance(0.6)) enlarge(one, random);
        if (random.chance(0.5)) one.frame.planes.add(Role::motion_back);
        std::set<std::string> programs, used;
        for (const ProgramKey& key : programs_of(one.chain, one.frame, one.elided))
            programs.insert(key.text());
        for (int k = 0; k < 12; ++k) {
            const FrameDescription frame = other_values(one.frame, random);
            const auto plan = make_plan(one.chain, frame, one.elided);
            if (!plan.ok()) continue;
            ++planned;
            for (const Step& step : plan->steps) {
                used.insert(step.program.text());
                ASSERT_TRUE(programs.count(step.program.text()))
                    << step.program.text() << ", seed " << seed << "\n"
                    << one.text;
            }
        }
        listed += programs.size();
        needed += used.size();
    }
    EXPECT_GT(planned, 1000u);
    // The list is no catalog of all that could ever be compiled.
    EXPECT_LT(listed, 3 * needed);
}

}  // namespace
}  // namespace postchain::test

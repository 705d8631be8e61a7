// The pass's plans, elisions, requirements and errors.

#include <limits>
#include <set>

#include "passes/motion_blur/guertin.h"
#include "tests/motion_blur/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

Plan plan_of(const Chain& chain, const FrameDescription& frame, const PlanOptions& options = {}) {
    return must(make_plan(chain, frame, options));
}

FrameDescription description(double max_speed_px) {
    FrameDescription frame;
    frame.width = frame.display_width = 100;
    frame.height = frame.display_height = 50;
    frame.planes = {Role::color, Role::inverse_depth, Role::motion};
    frame.bounds.max_speed_px = max_speed_px;
    return frame;
}

using testing::ElementsAre;

// A closed shutter is elided like a frame without motion, even if the speed is unknown, as in an
// engine.
TEST(Plan, SavingOfAClosedShutter) {
    const auto saving = [](double shutter_frames, double max_speed_px) {
        const Chain chain = blur({{"mode", "inverse_warp"}, {"shutter_frames", shutter_frames}});
        const Plan plan = plan_of(chain, description(max_speed_px));
        EXPECT_TRUE(plan.steps.empty());
        Saving sum;
        for (const auto& elision : plan.elisions) sum += elision.saving;
        return sum;
    };
    EXPECT_GT(saving(0.5, 0).taps, 0u);
    EXPECT_EQ(saving(0, std::numeric_limits<double>::infinity()), saving(0.5, 0));
}

// Classes of blocks by rules and facts; each class has a list and a launch.
TEST(Plan, ClassesOfBlocks) {
    const auto steps_of = [](const Chain& chain, const FrameDescription& frame,
                             const PlanOptions& options) {
        std::vector<std::string> steps;
        const Plan plan = plan_of(chain, frame, options);
        bool classed = false;
        std::set<std::string> programs;
        for (const auto& step : plan.steps) {
            steps.push_back(step.name);
            EXPECT_TRUE(programs.insert(step.program.text()).second)
                << step.name << " does nothing less than another step";
            classed = classed || step.name == "classify";
            const bool writes_color = step.name == "keep" || step.name.rfind("gather", 0) == 0;
            EXPECT_EQ(step.work_list >= 0, classed && writes_color) << step.name;
        }
        return steps;
    };
    FrameDescription sky = description(9), ground = sky;
    ground.bounds.min_inverse_depth = 0.01;
    const Chain chain = plain_blur();
    EXPECT_THAT(steps_of(chain, sky, {}), ElementsAre("tile_max", "neighbor_max", "classify",
                                                      "keep", "gather_sky", "gather"));
    EXPECT_THAT(steps_of(chain, ground, {}),
                ElementsAre("tile_max", "neighbor_max", "classify", "keep", "gather"));
    EXPECT_THAT(steps_of(plain_blur({{"depth_softness", 0.0}}), sky, {}),
                ElementsAre("tile_max", "neighbor_max", "classify", "keep", "gather"));
    PlanOptions options = whole_passes();
    EXPECT_THAT(steps_of(chain, sky, options), ElementsAre("tile_max", "neighbor_max", "gather"));
    options.elide = false;
    for (const auto& step : steps_of(chain, sky, options)) EXPECT_NE(step, "classify");
}

TEST(Plan, FormatsFollowPrecisionAndStorage) {
    const auto format_of = [](const Chain& chain, Precision precision, const char* name,
                              bool half_input = true) {
        PlanOptions options;
        options.precision = precision;
        FrameDescription frame = description(9);
        frame.bounds.color_is_half = half_input;
        const Plan plan = plan_of(chain, frame, options);
        for (const auto& texture : plan.textures)
            if (texture.name == std::string("0.motion_blur.") + name) return texture.format;
        return Format::r8;
    };
    const char* v = "half_velocity";
    EXPECT_EQ(format_of(blur({{"velocity_storage", "fp32"}}), Precision::fp16, v), Format::rg32f);
    EXPECT_EQ(format_of(blur({{"velocity_storage", "fp16"}}), Precision::fp32, v), Format::rg16f);
    EXPECT_EQ(format_of(blur({{"velocity_storage", "unorm8"}}), Precision::fp32, v), Format::rg8);
    EXPECT_EQ(format_of(blur(), Precision::fp32, "color"), Format::rgba32f);
    EXPECT_EQ(format_of(blur(), Precision::fp16, "color"), Format::rgba16f);
    // The result's format is at least that of the frame's color.
    EXPECT_EQ(format_of(blur(), Precision::fp16, "color", false), Format::rgba32f);
    // 500 px squared exceeds half: tiles are always fp32.
    EXPECT_EQ(format_of(blur(), Precision::fp16, "tile_max"), Format::rgba32f);
}

// (That no bit changes: tests/elision.)
TEST(Plan, TellsTheFactForWhichItIsLeftOut) {
    // Default shutter 0.5: half-velocity is a quarter of the speed.
    const auto fact_of = [](double speed_px) {
        return text_of(plan_of(blur(), description(speed_px)).elisions.at(0).fact);
    };
    EXPECT_EQ(fact_of(2), "largest half-velocity 0.5 px <= 0.5 px");
    EXPECT_EQ(fact_of(1.24), "largest half-velocity 0.31 px <= 0.5 px");
}

TEST(Plan, ShutterPrecedence) {
    shutter::Parameters p;
    Camera camera;
    EXPECT_EQ(shutter::open_frames(p, camera), 0.5);
    camera.shutter_frames = 0.25;
    EXPECT_EQ(shutter::open_frames(p, camera), 0.25);
    p.shutter_angle_deg = 270;
    EXPECT_EQ(shutter::open_frames(p, camera), 0.75);
    p.shutter_angle_deg.reset();
    p.shutter_frames = 1.5;
    EXPECT_EQ(shutter::open_frames(p, camera), 1.5);
    // A closed shutter of the camera counts as well.
    FrameDescription frame = description(80);
    frame.camera.shutter_frames = 0;
    EXPECT_TRUE(plan_of(blur(), frame).passes[0].elided);
    EXPECT_FALSE(plan_of(blur({{"shutter_frames", 0.5}}), frame).passes[0].elided);
}

TEST(Plan, NeedsDepthOnlyToCompareIt) {
    FrameDescription frame = description(80);
    frame.planes = {Role::color, Role::motion};
    EXPECT_EQ(make_plan(blur(), frame).status().code(), StatusCode::input);
    EXPECT_TRUE(make_plan(blur({{"depth_softness", 0.0}}), frame).ok());
    frame.planes = {Role::color, Role::inverse_depth, Role::motion};
    const Plan plan = plan_of(blur({{"depth_softness", 0.0}}), frame);
    EXPECT_FALSE(plan.reads.has(Role::inverse_depth));
}

}  // namespace
}  // namespace postchain::test

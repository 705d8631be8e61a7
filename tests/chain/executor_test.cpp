// The executor with plans made by hand: results, reuse, errors, observers, times.
#include "chain/gl/executor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "chain/pass/planner.h"
#include "chain/pass/work_list.h"
#include "tests/chain/executor_support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

using test::Execute;
using test::must;
using ::testing::HasSubstr;

TEST_F(Execute, TwoStepsByHand) {
    // (v * 2 + x) * 2 + x = 4 v + 3 x.
    const FramePlanes in = {{Role::color, test::noise_image(33, 5, 4, 7)}};
    const FramePlanes out = must(executor_->filter(two_steps(33, 5), in));
    const ImageF& result = out.at(Role::color);
    EXPECT_FLOAT_EQ(result.at(0, 0, 0), 4 * in.at(Role::color).at(0, 0, 0));
    EXPECT_FLOAT_EQ(result.at(32, 4, 0), 4 * in.at(Role::color).at(32, 4, 0) + 96);
    EXPECT_FLOAT_EQ(result.at(17, 3, 2), 4 * in.at(Role::color).at(17, 3, 2));
}

TEST_F(Execute, SecondFrameOfASizeAllocatesNothing) {
    Executor& executor = *executor_;
    const FramePlanes in = {{Role::color, test::noise_image(40, 40, 4, 1)}};
    must(executor.filter(two_steps(40, 40), in));
    const auto before = executor.counters();
    must(executor.filter(two_steps(40, 40), in));
    EXPECT_EQ(executor.counters().texture_allocations, before.texture_allocations);
    EXPECT_EQ(executor.counters().programs, before.programs);
    EXPECT_EQ(executor.counters().dispatches, before.dispatches + 2);
}

TEST_F(Execute, StepWhoseBlockIsNotTheShadersIsAnError) {
    const FramePlanes in = {{Role::color, test::noise_image(4, 4, 4, 7)}};
    Plan plan = two_steps(4, 4);
    plan.steps[1].uniforms_type = "OtherUniforms";
    auto out = executor_->filter(plan, in);
    EXPECT_EQ(out.status().code(), StatusCode::internal);
    EXPECT_THAT(out.status().message(),
                HasSubstr("scale.b: the step brings OtherUniforms of 16 bytes"
                          ", scale.comp has Block of 16 bytes"));
    plan = two_steps(4, 4);
    // A driver may leave out members that nothing reads, but adds none.
    plan.steps[0].uniforms.resize(32);
    EXPECT_TRUE(executor_->filter(plan, in).ok());
    plan.steps[0].uniforms.clear();
    EXPECT_FALSE(executor_->filter(plan, in).ok());
    plan.steps[0].uniforms_type.clear();
    EXPECT_THAT(executor_->filter(plan, in).status().message(), HasSubstr("no block"));
}

TEST_F(Execute, ObserverSeesEveryStageAndCanEndTheRun) {
    const FramePlanes in = {{Role::color, test::noise_image(4, 4, 4, 3)}};
    std::vector<std::string> seen;
    auto out = executor_->filter(
        two_steps(4, 4), in, [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
            seen.push_back(texture.name);
            EXPECT_FLOAT_EQ(pixels.at(0, 0, 1),
                            in.at(Role::color).at(0, 0, 1) * (seen.size() == 1 ? 2.0f : 4.0f));
            return Status();
        });
    ASSERT_TRUE(out.ok());
    EXPECT_THAT(seen, ::testing::ElementsAre("0.scale.a", "0.scale.b"));
    out =
        executor_->filter(two_steps(4, 4), in, [](const Step&, const PlanTexture&, const ImageF&) {
            return Status(StatusCode::output, "disk full");
        });
    EXPECT_EQ(out.status().code(), StatusCode::output);
}

// Every block is done by the step whose list it is in, and by no other; also with more blocks than
// one row of the launch holds (64), and again with lists that were used before.
TEST_F(Execute, WorkListsLaunchOneGroupForEachBlock) {
    for (const auto& [width, height] : {std::pair(1, 1), {16, 16}, {17, 33}, {700, 645}}) {
        const FramePlanes in = {{Role::color, test::noise_image(width, height, 4, 11)}};
        const ImageF& color = in.at(Role::color);
        for (int again = 0; again < 2; ++again) {
            const FramePlanes out = must(executor_->filter(sorted(width, height), in));
            size_t dark = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const bool is_dark = color.at(x / 16 * 16, y / 16 * 16) < 0.5f;
                    ASSERT_EQ(out.at(Role::color).at(x, y), is_dark ? 1 : 2) << x << "," << y;
                    dark += is_dark && x % 16 == 0 && y % 16 == 0;
                }
            const auto done = executor_->work_done();
            const auto blocks = groups_for(width, height);
            ASSERT_EQ(done.size(), 2u);
            EXPECT_EQ(done[0].list, "0.sort.dark");
            EXPECT_EQ(done[0].blocks, dark);
            EXPECT_EQ(done[0].blocks + done[1].blocks, unsigned(blocks[0] * blocks[1]));
            EXPECT_EQ(done[1].of, unsigned(blocks[0] * blocks[1]));
        }
    }
}

// As a software renderer does, which also reads the lengths of lists.
TEST_F(Execute, PlanesReadAsImages) {
    gl::Device device = gl::describe_current();
    // Under tests/gpu_like a program may have fewer.
    glGetIntegerv(GL_MAX_IMAGE_UNITS, &device.limits.image_units);
    if (device.limits.image_units < 32)
        GTEST_SKIP() << "the device has no image units for all textures of a step";
    device.software = true;
    const auto executor = make_executor({}, device);
    const FramePlanes in = {{Role::color, test::noise_image(33, 37, 4, 7)}};
    for (const Plan& plan : {two_steps(33, 37), sorted(33, 37)})
        EXPECT_EQ(must(executor->filter(plan, in)), must(executor_->filter(plan, in)));
}

TEST_F(Execute, ObserverSeesATextureOnceWhenItIsWhole) {
    const FramePlanes in = {{Role::color, test::noise_image(64, 64, 4, 11)}};
    int seen = 0;
    must(executor_->filter(sorted(64, 64), in,
                           [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                               ++seen;
                               EXPECT_EQ(texture.name, "0.sort.result");
                               for (float value : pixels.data)
                                   EXPECT_TRUE(value == 1 || value == 2);
                               return Status();
                           }));
    EXPECT_EQ(seen, 1);
}

TEST_F(Execute, TextureAboveTheLimitIsAnErrorThatNamesIt) {
    Plan plan = two_steps(4, 4);
    plan.textures[1].width = 1 << 20;
    const FramePlanes in = {{Role::color, test::noise_image(4, 4, 4, 3)}};
    const Status status = executor_->filter(plan, in).status();
    EXPECT_EQ(status.code(), StatusCode::gl);
    EXPECT_THAT(status.message(), AllOf(HasSubstr("0.scale.a"), HasSubstr("limit")));
    EXPECT_TRUE(executor_->filter(two_steps(4, 4), in).ok()) << "works again afterwards";
}

TEST_F(Execute, MissingInputIsAnError) {
    EXPECT_EQ(executor_->filter(two_steps(4, 4), {}).status().code(), StatusCode::internal);
    EXPECT_EQ(executor_->run(two_steps(4, 4), {}).status().code(), StatusCode::internal);
}

TEST_F(Execute, PlanWithoutStepsReturnsEveryBit) {
    FramePlanes in = {{Role::color, test::noise_image(9, 9, 4, 5, -1e30f, 1e30f)}};
    in[Role::color].at(3, 3, 0) = std::numeric_limits<float>::quiet_NaN();
    FrameDescription frame;
    frame.width = frame.height = 9;
    frame.planes = {Role::color};
    const auto before = executor_->counters();
    const FramePlanes out = must(executor_->filter(must(make_plan(Chain(), frame)), in));
    EXPECT_TRUE(test::equal_bits(out.at(Role::color), in.at(Role::color)));
    EXPECT_EQ(executor_->counters().texture_allocations, before.texture_allocations);
}

TEST_F(Execute, TimesEveryPassAndNamesTheirSource) {
    const FramePlanes in = {{Role::color, test::noise_image(64, 64, 4, 5)}};
    Executor& executor = *executor_;
    executor.set_timing(true);
    must(executor.filter(two_steps(64, 64), in));
    executor.set_timing(false);
    ASSERT_EQ(executor.pass_times().size(), 1u);
    EXPECT_GT(executor.pass_times()[0].milliseconds, 0);
    EXPECT_FALSE(std::string(executor.timing_source()).empty());
}

}  // namespace
}  // namespace postchain

// The executor with plans made by hand: results, reuse, errors, observers, times.
#include "chain/gl/executor.h"

#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "chain/gl/image_reads.h"
#include "chain/pass/planner.h"
#include "chain/pass/work_list.h"
#include "chain/plan/bands.h"
#include "tests/chain/executor_support.h"
#include "tests/guest/gl_calls.h"
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

TEST_F(Execute, StepWithMoreUnitsThanThereAreIsAnError) {
    for (const Access access : {Access::sample_nearest, Access::read, Access::list}) {
        Plan plan = two_steps(4, 4);
        plan.steps[0].bindings.push_back({gl::kMaxUnits, 0, access});
        const Status status = executor_->run(plan, {}).status();
        EXPECT_EQ(status.code(), StatusCode::internal);
        EXPECT_THAT(status.message(), HasSubstr("a step uses more than"));
    }
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

// An executor deletes what it has made. Devices that behave like GPUs have their own calls of GL.
class ExecutorObjects : public Execute {
  protected:
    static std::unique_ptr<Executor> executor_on(bool software) {
        gl::Device device = gl::describe_current();
        device.software = software;
        return make_executor({.frames_kept = 1}, device);
    }
    // Runs that need no texture of an earlier size, until those are free.
    static uint64_t alive_after_small_runs(Executor& executor) {
        for (int again = 0; again < 3; ++again)
            must(executor.filter(two_steps(7, 3), FramePlanes{{Role::color, ImageF(7, 3, 4, 1)}}));
        return executor.counters().textures_alive;
    }
};

TEST_F(ExecutorObjects, GoWithIt) {
    for (const bool software : {true, false}) {
        test::GlCalls::start();
        {
            const auto own = executor_on(software);
            own->set_timing(true, true);
            const FramePlanes in = {{Role::color, test::noise_image(33, 17, 4, 7)}};
            must(own->filter(two_steps(33, 17), in));
            Plan plan = two_steps(33, 17);
            plan.steps[0].uniforms.resize(1 << 14);
            must(own->filter(plan, in));
            must(own->filter(sorted(33, 17), in));
            must(own->run(counted(uint64_t(kBandTaps)), {}));
            own->forget_rates();
            plan.steps[0].program.defines["block"] = "?";
            EXPECT_FALSE(own->filter(plan, in).ok()) << "it does not compile";
        }
        test::GlCalls::stop();
        EXPECT_EQ(test::GlCalls::objects(), 0) << (software ? "software" : "GPU");
    }
}

// Queries of bands are used again.
TEST_F(ExecutorObjects, ALaterRunMakesNone) {
    const auto own = executor_on(false);
    const FramePlanes in = {{Role::color, test::noise_image(33, 17, 4, 7)}};
    const auto run = [&] {
        must(own->filter(two_steps(33, 17), in));
        must(own->filter(sorted(33, 17), in));
    };
    run();
    test::GlCalls::start();
    for (int again = 0; again < 3; ++again) run();
    const auto calls = test::GlCalls::stop();
    for (const char* name : {"glCreateQueries", "glCreateBuffers", "glCreateTextures"})
        EXPECT_FALSE(calls.contains(name)) << name;
}

// A texture that was taken before another one failed is free again.
TEST_F(ExecutorObjects, ATextureAboveTheLimitKeepsNoOther) {
    for (const size_t large : {1u, 2u}) {
        const auto own = executor_on(true);
        Plan plan = two_steps(20, 10);
        plan.textures[large].width = 1 << 20;
        EXPECT_FALSE(own->filter(plan, FramePlanes{{Role::color, ImageF(20, 10, 4, 1)}}).ok());
        EXPECT_EQ(alive_after_small_runs(*own), 3u) << large;
    }
}

// Also if the planes before it were uploaded.
TEST_F(ExecutorObjects, AFailedUploadKeepsNoTexture) {
    const ImageF color = test::noise_image(20, 10, 4, 3), depth(20, 10, 1, 1), odd(20, 11, 1, 1);
    for (const bool first : {false, true}) {
        const auto own = executor_on(true);
        Plan plan = two_steps(20, 10);
        const PlanTexture second = {
            {Format::r32f, 20, 10}, "input.inverse_depth", true, Role::inverse_depth, 0, 1};
        plan.textures.push_back(second);
        plan.reads.add(Role::inverse_depth);
        if (first) {  // the plane that fails comes before the other
            std::swap(plan.textures[0], plan.textures[3]);
            plan.steps[0].bindings[0].texture = 3;
        }
        const FramePlanes wrong[] = {{{Role::color, color}},
                                     {{Role::inverse_depth, depth}},
                                     {{Role::color, color}, {Role::inverse_depth, odd}}};
        for (const FramePlanes& planes : wrong) EXPECT_FALSE(own->filter(plan, planes).ok());
        must(own->filter(plan, FramePlanes{{Role::color, color}, {Role::inverse_depth, depth}}));
        EXPECT_EQ(alive_after_small_runs(*own), 3u);
    }
}

// Planes of a next run are uploaded ahead: it comes, does not come, or another one comes.
TEST_F(ExecutorObjects, PlanesUploadedAheadKeepNoTexture) {
    test::gl_faults().late_fences = true;
    const auto planes_of = [](int width, int height) {
        return SharedPlanes{
            {Role::color, std::make_shared<const ImageF>(test::noise_image(width, height, 4, 7))}};
    };
    const Plan now = two_steps(7, 3), next = two_steps(40, 20), other = two_steps(30, 21);
    const SharedPlanes of_now = planes_of(7, 3), of_next = planes_of(40, 20),
                       of_other = planes_of(30, 21);
    for (const char* what : {"comes", "does not come", "another is expected"}) {
        SCOPED_TRACE(what);
        const auto own = executor_on(false);
        const auto expect = [&](const Plan& plan, const SharedPlanes& planes) {
            const ExpectScope scope(*own, [&] { return NextRun{&plan, &planes}; });
            must(own->filter(now, of_now));
        };
        expect(next, of_next);
        EXPECT_EQ(own->counters().textures_alive, 4u) << "nothing was uploaded ahead";
        if (what == std::string("comes"))
            EXPECT_EQ(must(own->filter(next, of_next)), must(executor_->filter(next, of_next)));
        else if (what == std::string("another is expected"))
            expect(other, of_other);
        own->forget_expected();
        EXPECT_EQ(alive_after_small_runs(*own), 3u);
    }
    test::gl_faults().late_fences = false;
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

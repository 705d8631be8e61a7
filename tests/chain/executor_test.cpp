// The executor with hand-made plans, and every built-in pass from outside.
#include "chain/gl/executor.h"

#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

#include "chain/bands.h"
#include "chain/gl/transfers.h"
#include "chain/work_list.h"
#include "shaders/embedded.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

// out = in * scale + position of the pixel in x.
const char* kShader = R"(#version 450 core
layout(local_size_x = 16, local_size_y = 16) in;
layout(std140, binding = 0) uniform Block { float scale; } block;
layout(binding = 0) uniform sampler2D source;
layout(binding = 0) writeonly uniform image2D result;
void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(result)))) return;
    imageStore(result, p, texelFetch(source, p, 0) * block.scale + vec4(p.x, 0, 0, 0));
}
)";

struct Block {
    static constexpr const char* kName = "Block";
    float scale;
    std::array<float, 3> pad;
};

// Sorts blocks of 16 x 16 pixels by the color of their first pixel; then one step for each list.
const char* kSort = R"(#version 450 core
#include "common/work_list.glsl"
layout(binding = 0) uniform sampler2D source;
layout(std430, binding = 0) buffer Dark { WORK_LIST } dark;
layout(std430, binding = 1) buffer Light { WORK_LIST } light;
void main() {
    ivec2 block = invocation_at();
    if (any(greaterThanEqual(kBlockPx * block, textureSize(source, 0)))) return;
    if (texelFetch(source, kBlockPx * block, 0).x < 0.5) ADD_TO_WORK_LIST(dark, block)
    else ADD_TO_WORK_LIST(light, block)
}
)";
const char* kFill = R"(#version 450 core
#include "common/work_list.glsl"
layout(binding = 0) writeonly uniform image2D result;
void main() {
    ivec2 p;
    if (!next_pixel(imageSize(result), p)) return;
    imageStore(result, p, vec4(VALUE));
}
)";

// Writes the size of the dispatch that a pixel is in.
const char* kCount = R"(#version 450 core
#include "common/work_group.glsl"
layout(binding = 0) writeonly uniform image2D result;
void main() {
    imageStore(result, invocation_at(), vec4(gl_NumWorkGroups.xy, group_at()));
}
)";

class Execute : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        test::executor();  // a GL context
        folder_ = fs::temp_directory_path() / ("postchain_executor_" + std::to_string(getpid()));
        fs::create_directories(folder_);
        std::ofstream(folder_ / "scale.comp") << kShader;
        std::ofstream(folder_ / "sort.comp") << kSort;
        std::ofstream(folder_ / "fill.comp") << kFill;
        std::ofstream(folder_ / "count.comp") << kCount;
        for (const auto& file : embedded_shaders()) {
            fs::create_directories((folder_ / file.path).parent_path());
            std::ofstream(folder_ / file.path) << file.text;
        }
        setenv("POSTCHAIN_SHADER_DIR", folder_.c_str(), 1);
        executor_ = std::make_unique<Executor>(gl::describe_current());
        unsetenv("POSTCHAIN_SHADER_DIR");  // read once, when the executor was made
    }
    static void TearDownTestSuite() {
        executor_.reset();
        fs::remove_all(folder_);
    }
    // color -> a -> b, each step scaling by 2.
    static Plan two_steps(int width, int height, Format format = Format::rgba32f) {
        Plan plan;
        plan.width = width;
        plan.height = height;
        plan.passes = {{"scale", "", false}};
        plan.reads = {Role::color};
        plan.textures = {{"input.color", Format::rgba32f, width, height, true, Role::color, 0, 0},
                         {"0.scale.a", format, width, height, false, Role::color, 0, 1},
                         {"0.scale.b", Format::rgba32f, width, height, false, Role::color, 1, 2}};
        for (int i = 0; i < 2; ++i) {
            Step step;
            step.name = i ? "b" : "a";
            step.program.file = "scale.comp";
            step.bindings = {{0, i, Access::sample_nearest}, {0, i + 1, Access::write}};
            step.set_uniforms(Block{2, {}});
            step.groups = groups_for(width, height);
            plan.steps.push_back(step);
        }
        plan.outputs[Role::color] = 2;
        return plan;
    }
    // color -> result: 1 in blocks whose first pixel is dark, 2 in the others.
    static Plan sorted(int width, int height) {
        const auto blocks = groups_for(width, height);
        Plan plan;
        plan.width = width;
        plan.height = height;
        plan.passes = {{"sort", "", false}};
        plan.reads = {Role::color};
        const int most = blocks[0] * blocks[1];
        plan.textures = {
            {"input.color", Format::rgba32f, width, height, true, Role::color, 0, 0},
            {"0.sort.dark", Format::work_list, most, 1, false, Role::color, 0, 1},
            {"0.sort.light", Format::work_list, most, 1, false, Role::color, 0, 2},
            {"0.sort.result", Format::rgba32f, width, height, false, Role::color, 1, 3}};
        Step sort;
        sort.name = "sort";
        sort.program.file = "sort.comp";
        sort.bindings = {{0, 0}, {0, 1, Access::list}, {1, 2, Access::list}};
        sort.groups = groups_for(blocks[0], blocks[1]);
        plan.steps.push_back(sort);
        for (int list : {1, 2}) {
            Step fill;
            fill.name = "fill";
            fill.program = {"fill.comp", {{"VALUE", std::to_string(list)}}};
            fill.bindings = {{0, 3, Access::write}};
            fill.groups = blocks;
            launch_by(fill, list);
            plan.steps.push_back(fill);
        }
        plan.outputs[Role::color] = 3;
        return plan;
    }
    // -> result: one step over 7 x 5 work groups.
    static Plan counted(uint64_t group_taps) {
        Plan plan;
        plan.width = 7 * 16;
        plan.height = 5 * 16;
        plan.passes = {{"count", "", false}};
        plan.textures = {
            {"0.count.result", Format::rgba32f, plan.width, plan.height, false, Role::color, 0, 1}};
        Step step;
        step.name = "count";
        step.program.file = "count.comp";
        step.bindings = {{0, 0, Access::write}};
        step.groups = {7, 5, 1};
        step.group_taps = group_taps;
        plan.steps.push_back(step);
        plan.outputs[Role::color] = 0;
        return plan;
    }
    static fs::path folder_;
    static std::unique_ptr<Executor> executor_;
};
fs::path Execute::folder_;
std::unique_ptr<Executor> Execute::executor_;

TEST_F(Execute, TwoStepsByHand) {
    // (v * 2 + x) * 2 + x = 4 v + 3 x.
    FramePlanes in;
    in[Role::color] = test::noise_image(33, 5, 4, 7);
    auto out = executor_->filter(two_steps(33, 5), in);
    ASSERT_TRUE(out.ok()) << out.status().message();
    const auto& result = out->at(Role::color);
    EXPECT_FLOAT_EQ(result.at(0, 0, 0), 4 * in[Role::color].at(0, 0, 0));
    EXPECT_FLOAT_EQ(result.at(32, 4, 0), 4 * in[Role::color].at(32, 4, 0) + 96);
    EXPECT_FLOAT_EQ(result.at(17, 3, 2), 4 * in[Role::color].at(17, 3, 2));
}

TEST_F(Execute, SecondFrameOfASizeAllocatesNothing) {
    Executor& executor = *executor_;
    FramePlanes in;
    in[Role::color] = test::noise_image(40, 40, 4, 1);
    ASSERT_TRUE(executor.filter(two_steps(40, 40), in).ok());
    const auto before = executor.counters();
    ASSERT_TRUE(executor.filter(two_steps(40, 40), in).ok());
    EXPECT_EQ(executor.counters().texture_allocations, before.texture_allocations);
    EXPECT_EQ(executor.counters().programs, before.programs);
    EXPECT_EQ(executor.counters().dispatches, before.dispatches + 2);
}

TEST_F(Execute, UnusedSizesAreGivenBack) {
    Executor& executor = *executor_;
    for (int size = 50; size < 80; ++size) {
        FramePlanes in;
        in[Role::color] = test::noise_image(size, 3, 4, 1);
        ASSERT_TRUE(executor.filter(two_steps(size, 3), in).ok());
    }
    // Three textures per size, kept for 8 frames and the one under way.
    EXPECT_LE(executor.counters().textures_alive, 3u * 10u);
}

// A GL texture of the size, as a host would hand one in.
class HostTexture {
  public:
    HostTexture(int width, int height) {
        glCreateTextures(GL_TEXTURE_2D, 1, &name_);
        glTextureStorage2D(name_, 1, GL_RGBA32F, width, height);
    }
    ~HostTexture() { glDeleteTextures(1, &name_); }
    GLuint name() const { return name_; }

  private:
    GLuint name_ = 0;
};

// A window that is dragged: run() reads nothing back, and still frees unused sizes.
TEST_F(Execute, RunGivesUnusedSizesBackToo) {
    setenv("POSTCHAIN_SHADER_DIR", folder_.c_str(), 1);
    Executor executor(gl::describe_current(), {.frames_kept = 3});
    unsetenv("POSTCHAIN_SHADER_DIR");
    for (int size = 1; size <= 101; ++size) {
        const HostTexture color(size, 3);
        ASSERT_TRUE(executor.run(two_steps(size, 3), {{Role::color, color.name()}}).ok());
        // Two textures a size, of the frame under way and the three before.
        EXPECT_LE(executor.counters().textures_alive, 2u * 4u) << size;
    }
    EXPECT_EQ(executor.counters().texture_allocations, 2u * 101u);
}

// An engine has the frame before at hand, and never the one after.
TEST_F(Execute, RunTakesThePlanesOfAPreviousFrame) {
    const Chain chain = test::chain_of("echo");
    FrameDescription frame;
    frame.width = frame.display_width = 20;
    frame.height = frame.display_height = 10;
    frame.planes = {Role::color, Role::color_before};
    const auto plan = make_plan(chain, frame);
    ASSERT_TRUE(plan.ok());
    EXPECT_EQ(plan->reads, frame.planes);
    const HostTexture color(20, 10), before(20, 10);
    const float now[4] = {1, 0.5f, 0, 1}, then[4] = {0, 0.5f, 4, 1};
    glClearTexImage(color.name(), 0, GL_RGBA, GL_FLOAT, now);
    glClearTexImage(before.name(), 0, GL_RGBA, GL_FLOAT, then);
    Executor& executor = test::executor();
    const auto out =
        executor.run(*plan, {{Role::color, color.name()}, {Role::color_before, before.name()}});
    ASSERT_TRUE(out.ok()) << out.status().message();
    const auto pixels = gl::Transfers().download(out->at(Role::color), Format::rgba32f, 20, 10);
    ASSERT_TRUE(pixels.ok());
    EXPECT_EQ(pixels->at(19, 9, 0), 1.5f);
    EXPECT_EQ(pixels->at(19, 9, 1), 0.625f);
    EXPECT_EQ(pixels->at(19, 9, 2), -1.0f);
    EXPECT_FALSE(executor.run(*plan, {{Role::color, color.name()}}).ok());
}

// Neither where it allocates nor in the steady state.
TEST_F(Execute, AnErrorThatAHostLeftPendingDoesNotFailARun) {
    const HostTexture color(12, 3);
    for (int again = 0; again < 2; ++again) {
        glEnable(0xffff);  // GL_INVALID_ENUM
        const auto out = executor_->run(two_steps(12, 3), {{Role::color, color.name()}});
        EXPECT_TRUE(out.ok()) << out.status().message();
        EXPECT_EQ(glGetError(), GLenum(GL_INVALID_ENUM)) << "the flag is the host's; run " << again;
    }
    glEnable(0xffff);
    FramePlanes in;
    in[Role::color] = test::noise_image(12, 3, 4, 7);
    EXPECT_TRUE(executor_->filter(two_steps(12, 3), in).ok());
}

TEST_F(Execute, StepWhoseBlockIsNotTheShadersIsAnError) {
    FramePlanes in;
    in[Role::color] = test::noise_image(4, 4, 4, 7);
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
    FramePlanes in;
    in[Role::color] = test::noise_image(4, 4, 4, 3);
    std::vector<std::string> seen;
    auto out = executor_->filter(
        two_steps(4, 4), in, [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
            seen.push_back(texture.name);
            EXPECT_FLOAT_EQ(pixels.at(0, 0, 1),
                            in[Role::color].at(0, 0, 1) * (seen.size() == 1 ? 2.0f : 4.0f));
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
        FramePlanes in;
        in[Role::color] = test::noise_image(width, height, 4, 11);
        const ImageF& color = in[Role::color];
        for (int again = 0; again < 2; ++again) {
            auto out = executor_->filter(sorted(width, height), in);
            ASSERT_TRUE(out.ok()) << out.status().message();
            size_t dark = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const bool is_dark = color.at(x / 16 * 16, y / 16 * 16) < 0.5f;
                    ASSERT_EQ(out->at(Role::color).at(x, y), is_dark ? 1 : 2) << x << "," << y;
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

// Color is scaled into a, then into b. If the host's b is its color, writing waits for the reads.
TEST_F(Execute, AHostsTexturesOfOneNameAreOneStorage) {
    setenv("POSTCHAIN_SHADER_DIR", folder_.c_str(), 1);
    gl::ProgramCache programs({}, gl::shader_folder_of_environment());
    unsetenv("POSTCHAIN_SHADER_DIR");
    gl::TexturePool pool;
    gl::RunObjects objects;
    Plan plan = two_steps(20, 10);
    plan.steps[1].bindings[0].texture = 0;
    for (size_t t : {1, 2}) plan.textures[t].imported = true;
    auto compiled = gl::CompiledPlan::make(plan, pool, programs, objects, false);
    ASSERT_TRUE(compiled.ok()) << compiled.status().message();
    const HostTexture color(20, 10), a(20, 10), b(20, 10);
    const auto barriers = [&](unsigned first, unsigned second) {
        compiled->import(0, color.name());
        compiled->import(1, first, GL_RGBA32F);
        compiled->import(2, second, GL_RGBA32F);
        EXPECT_TRUE(compiled->run(objects).ok());
        return compiled->barriers();
    };
    EXPECT_EQ(barriers(a.name(), b.name()), 0u);
    EXPECT_EQ(barriers(a.name(), color.name()), 1u) << "color is read by the first step";
    EXPECT_EQ(barriers(a.name(), a.name()), 1u) << "both write one texture";
    EXPECT_EQ(barriers(b.name(), a.name()), 0u);
}

// In a host bands have the estimated size, and a dispatch that is short stays whole.
TEST_F(Execute, RunsALongStepInBands) {
    ImageF pixels;
    const auto run = [&](uint64_t group_taps) {
        return executor_->run(counted(group_taps), {},
                              [&](const Step&, const PlanTexture&, const ImageF& result) {
                                  pixels = result;
                                  return Status();
                              });
    };
    ASSERT_TRUE(run(uint64_t(kBandTaps) / 16).ok());  // two rows, then what is left
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 7; ++x) {
            EXPECT_EQ(pixels.at(16 * x, 16 * y, 0), 7);
            EXPECT_EQ(pixels.at(16 * x, 16 * y, 1), y < 4 ? 2 : 1);
            EXPECT_EQ(pixels.at(16 * x + 15, 16 * y + 15, 2), x);
            EXPECT_EQ(pixels.at(16 * x + 15, 16 * y + 15, 3), y);
        }
    ASSERT_TRUE(run(uint64_t(kBandTaps) / 3).ok());  // 3, 3 and 1 of a row
    for (int x = 0; x < 7; ++x) EXPECT_EQ(pixels.at(16 * x, 16, 0), x < 6 ? 3 : 1);
    ASSERT_TRUE(run(1).ok());
    EXPECT_EQ(pixels.at(0, 0, 1), 5);
    EXPECT_EQ(pixels.at(16 * 6, 16 * 4, 3), 4) << "the place of the last band is taken back";
}

TEST_F(Execute, StopsBetweenBands) {
    std::atomic<bool> stop = false;
    {
        const StopScope scope(*executor_, &stop);
        EXPECT_TRUE(executor_->filter(counted(1), {}).ok());
        stop = true;
        const auto result = executor_->filter(counted(uint64_t(1) << 60), {});
        EXPECT_EQ(result.status().code(), StatusCode::canceled);
        const StopScope none(*executor_, nullptr);
        EXPECT_FALSE(executor_->filter(counted(1), {}).ok()) << "a scope outside counts too";
    }
    EXPECT_TRUE(executor_->filter(counted(1), {}).ok()) << "the scope has ended";
}

// The answer `wait` dispatches nothing, and its time is not the pass's.
TEST_F(Execute, WaitsForItsTurnBeforeEachBand) {
    constexpr int kWaits = 10;  // at least 1 ms each
    int asked = 0;
    executor_->set_timing(true);
    const auto start = std::chrono::steady_clock::now();
    ImageF pixels;
    {
        const TurnScope scope(*executor_, [&] {
            return asked++ % (kWaits + 1) == kWaits ? Turn::go_on : Turn::wait;
        });
        auto result = executor_->filter(counted(uint64_t(1) << 60), {});
        ASSERT_TRUE(result.ok()) << result.status().message();
        pixels = std::move(result->at(Role::color));
    }
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    executor_->set_timing(false);
    // Each group's pixels have the size of its dispatch.
    double bands = 0;
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 7; ++x)
            bands += 1 / (pixels.at(16 * x, 16 * y, 0) * pixels.at(16 * x, 16 * y, 1));
    EXPECT_GE(bands, 5);
    EXPECT_EQ(asked, std::lround(bands) * (kWaits + 1));
    EXPECT_LE(executor_->pass_times().at(0).milliseconds, ms - std::lround(bands) * kWaits);
}

TEST_F(Execute, ObserverSeesATextureOnceWhenItIsWhole) {
    FramePlanes in;
    in[Role::color] = test::noise_image(64, 64, 4, 11);
    int seen = 0;
    auto out = executor_->filter(
        sorted(64, 64), in, [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
            ++seen;
            EXPECT_EQ(texture.name, "0.sort.result");
            for (float value : pixels.data) EXPECT_TRUE(value == 1 || value == 2);
            return Status();
        });
    ASSERT_TRUE(out.ok());
    EXPECT_EQ(seen, 1);
}

TEST_F(Execute, TextureAboveTheLimitIsAnErrorThatNamesIt) {
    Plan plan = two_steps(4, 4);
    plan.textures[1].width = 1 << 20;
    FramePlanes in;
    in[Role::color] = test::noise_image(4, 4, 4, 3);
    const auto out = executor_->filter(plan, in);
    ASSERT_FALSE(out.ok());
    EXPECT_EQ(out.status().code(), StatusCode::gl);
    EXPECT_THAT(out.status().message(), HasSubstr("0.scale.a"));
    EXPECT_THAT(out.status().message(), HasSubstr("limit"));
    EXPECT_TRUE(executor_->filter(two_steps(4, 4), in).ok()) << "works again afterwards";
}

TEST_F(Execute, MissingInputIsAnError) {
    const auto out = executor_->filter(two_steps(4, 4), {});
    EXPECT_EQ(out.status().code(), StatusCode::internal);
}

TEST_F(Execute, PlanWithoutStepsReturnsEveryBit) {
    FramePlanes in;
    in[Role::color] = test::noise_image(9, 9, 4, 5, -1e30f, 1e30f);
    in[Role::color].at(3, 3, 0) = std::numeric_limits<float>::quiet_NaN();
    FrameDescription frame;
    frame.width = frame.height = 9;
    frame.planes = {Role::color};
    const auto plan = make_plan(Chain(), frame);
    ASSERT_TRUE(plan.ok());
    const auto before = executor_->counters();
    auto out = executor_->filter(*plan, in);
    ASSERT_TRUE(out.ok());
    EXPECT_TRUE(test::equal_bits(out->at(Role::color), in[Role::color]));
    EXPECT_EQ(executor_->counters().dispatches, before.dispatches);
    EXPECT_EQ(executor_->counters().texture_allocations, before.texture_allocations);
}

TEST_F(Execute, HalfStorageRoundsToHalf) {
    // 1/3 in half: 0x3555 = 0.333251953125; the second step doubles it and adds x = 0.
    FramePlanes in;
    in[Role::color] = ImageF(1, 1, 4, 1.0f / 6);
    auto out = executor_->filter(two_steps(1, 1, Format::rgba16f), in);
    ASSERT_TRUE(out.ok());
    EXPECT_EQ(out->at(Role::color).data[0], 2 * 0.333251953125f);
}

TEST_F(Execute, TimesEveryPassAndNamesTheirSource) {
    FramePlanes in;
    in[Role::color] = test::noise_image(64, 64, 4, 5);
    Executor& executor = *executor_;
    executor.set_timing(true);
    ASSERT_TRUE(executor.filter(two_steps(64, 64), in).ok());
    executor.set_timing(false);
    ASSERT_EQ(executor.pass_times().size(), 1u);
    EXPECT_GT(executor.pass_times()[0].milliseconds, 0);
    EXPECT_FALSE(std::string(executor.timing_source()).empty());
}

}  // namespace
}  // namespace postchain

// The executor on textures of a host, which reads nothing back.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "chain/gl/transfers.h"
#include "tests/chain/executor_support.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

using test::Execute;
using test::must;

// A GL texture of the size, as a host would hand one in.
class HostTexture {
  public:
    HostTexture(int width, int height, std::array<float, 4> pixel = {}) {
        glCreateTextures(GL_TEXTURE_2D, 1, &name_);
        glTextureStorage2D(name_, 1, GL_RGBA32F, width, height);
        glClearTexImage(name_, 0, GL_RGBA, GL_FLOAT, pixel.data());
    }
    ~HostTexture() { glDeleteTextures(1, &name_); }
    GLuint name() const { return name_; }

  private:
    GLuint name_ = 0;
};

// A window that is dragged: run() reads nothing back, and still frees unused sizes.
TEST_F(Execute, RunGivesUnusedSizesBackToo) {
    const auto own = make_executor({.frames_kept = 3});
    Executor& executor = *own;
    for (int size = 1; size <= 101; ++size) {
        const HostTexture color(size, 3);
        must(executor.run(two_steps(size, 3), {{Role::color, color.name()}}));
        // Two textures a size, of the frame under way and the three before.
        EXPECT_LE(executor.counters().textures_alive, 2u * 4u) << size;
    }
    EXPECT_EQ(executor.counters().texture_allocations, 2u * 101u);
}

// More frames than the executor has room for uniform blocks, each from the last one's result. On a
// GPU nothing between them waits for the device.
TEST_F(Execute, AFrameMayTakeTheResultOfTheLast) {
    const HostTexture color(8, 8, {1, 1, 1, 1});
    GLuint result = color.name();
    const Plan there = two_steps(8, 8);
    Plan back = there;
    const float half = 0.5f;
    for (Step& step : back.steps) std::memcpy(step.uniforms.data(), &half, sizeof(half));
    const auto first = make_executor(), second = make_executor();
    for (int frame = 0; frame < 40; ++frame) {
        Executor& executor = frame % 2 ? *second : *first;
        result =
            must(executor.run(frame % 2 ? back : there, {{Role::color, result}})).at(Role::color);
    }
    EXPECT_EQ(must(gl::Transfers().download(result, {Format::rgba32f, 8, 8})).at(0, 7), 1);
}

// Neither where it allocates nor in the steady state.
TEST_F(Execute, AnErrorThatAHostLeftPendingDoesNotFailARun) {
    const HostTexture color(12, 3);
    for (int again = 0; again < 2; ++again) {
        glEnable(0xffff);  // GL_INVALID_ENUM
        must(executor_->run(two_steps(12, 3), {{Role::color, color.name()}}));
        EXPECT_EQ(glGetError(), GLenum(GL_INVALID_ENUM)) << "the flag is the host's; run " << again;
    }
    glEnable(0xffff);
    must(executor_->filter(two_steps(12, 3),
                           FramePlanes{{Role::color, test::noise_image(12, 3, 4, 7)}}));
}

// Color is scaled into a, then into b. If the host's b is its color, writing waits for the reads.
TEST_F(Execute, AHostsTexturesOfOneNameAreOneStorage) {
    gl::ProgramCache programs({}, folder_->path());
    gl::TexturePool pool;
    gl::RunObjects objects;
    Plan plan = two_steps(20, 10);
    plan.steps[1].bindings[0].texture = 0;
    for (size_t t : {1, 2}) plan.textures[t].imported = true;
    auto compiled = must(gl::CompiledPlan::make(plan, pool, programs, objects, false));
    const HostTexture color(20, 10), a(20, 10), b(20, 10);
    const auto barriers = [&](unsigned first, unsigned second) {
        compiled.import(0, color.name());
        compiled.import(1, first, GL_RGBA32F);
        compiled.import(2, second, GL_RGBA32F);
        EXPECT_TRUE(compiled.run(objects).ok());
        return compiled.barriers();
    };
    EXPECT_EQ(barriers(a.name(), b.name()), 0u);
    EXPECT_EQ(barriers(a.name(), color.name()), 1u) << "color is read by the first step";
    EXPECT_EQ(barriers(a.name(), a.name()), 1u) << "both write one texture";
    EXPECT_EQ(barriers(b.name(), a.name()), 0u);
}

}  // namespace
}  // namespace postchain

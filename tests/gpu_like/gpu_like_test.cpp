// Each behavior of gpu_like.cpp is one. Run with the library preloaded and all behaviors on.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "chain/gl/run_objects.h"
#include "chain/gl/texture_pool.h"
#include "chain/gl/transfers.h"
#include "tests/support/plans.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"

namespace postchain::test {
namespace {

class GpuLike : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        folder_ = new TempFolder;
        setenv("POSTCHAIN_GPU_LIKE_TRACE", folder_->path("trace").c_str(), 1);
    }
    static void TearDownTestSuite() { delete folder_; }
    // The calls since the last time, in order: "upload", "dispatch" and so on.
    static std::vector<std::string> traced() {
        static std::streamoff known = 0;
        std::ifstream in(folder_->path("trace"));
        in.seekg(known);
        std::vector<std::string> calls;
        for (std::string line; std::getline(in, line);) {
            known += std::streamoff(line.size()) + 1;
            calls.push_back(line);
        }
        return calls;
    }
    void SetUp() override {
        // llvmpipe has threads, which a fork loses.
        GTEST_FLAG_SET(death_test_style, "threadsafe");
        executor();  // makes the context
    }

    // The first pixel of an image of `format` after a shader's main(), which may read `value`.
    static std::array<float, 4> run(const std::string& main, float value,
                                    GLenum format = GL_RGBA32F) {
        const std::string text =
            "#version 450 core\n"
            "layout(local_size_x = 1) in;\n"
            "layout(location = 0) uniform float value;\n"
            "layout(binding = 1) writeonly uniform image2D result;\n" +
            main;
        const char* source = text.c_str();
        const GLuint shader = glCreateShader(GL_COMPUTE_SHADER), program = glCreateProgram();
        glShaderSource(shader, 1, &source, nullptr);
        glCompileShader(shader);
        glAttachShader(program, shader);
        glLinkProgram(program);
        GLint linked = 0;
        glGetProgramiv(program, GL_LINK_STATUS, &linked);
        EXPECT_TRUE(linked) << text;
        GLuint texture = 0;
        glCreateTextures(GL_TEXTURE_2D, 1, &texture);
        glTextureStorage2D(texture, 1, format, 1, 1);
        glUseProgram(program);
        glUniform1f(0, value);
        glBindImageTexture(1, texture, 0, GL_FALSE, 0, GL_WRITE_ONLY, format);
        glDispatchCompute(1, 1, 1);
        glMemoryBarrier(GL_ALL_BARRIER_BITS);
        std::array<float, 4> pixel = {};
        glGetTextureImage(texture, 0, GL_RGBA, GL_FLOAT, sizeof(pixel), pixel.data());
        glDeleteTextures(1, &texture);
        glDeleteProgram(program);
        glDeleteShader(shader);
        return pixel;
    }

    static inline TempFolder* folder_ = nullptr;
};

TEST_F(GpuLike, RoundsStoredHalfFloatsTowardZero) {
    const auto stored = [](float value, GLenum format) {
        return run("void main() { imageStore(result, ivec2(0), vec4(value)); }", value, format)[0];
    };
    const float below_2 = 2 - 0x1p-12f;
    EXPECT_EQ(stored(below_2, GL_RGBA16F), 2 - 0x1p-10f);
    EXPECT_EQ(stored(-below_2, GL_RGBA16F), -2 + 0x1p-10f);
    EXPECT_EQ(stored(1e6f, GL_RGBA16F), 65504);
    EXPECT_EQ(stored(0x1.fp-24f, GL_RGBA16F), 0x1p-24f);
    EXPECT_TRUE(std::isinf(stored(INFINITY, GL_RGBA16F)));
    EXPECT_EQ(stored(below_2, GL_RGBA32F), below_2);
}

TEST_F(GpuLike, FillsTexturesWithNanWhenAFrameBegins) {
    gl::TexturePool pool;
    const gl::Texture& taken = *must(pool.acquire({Format::rg16f, 3, 2}));
    const gl::Texture& given = *must(pool.acquire({Format::r32f, 1, 1}));
    const auto read = [](const gl::Texture& texture) {
        return must(gl::Transfers().download(texture.name, texture)).data.back();
    };
    EXPECT_TRUE(std::isnan(read(taken)));
    ASSERT_EQ(error_of(gl::Transfers().upload(taken, ImageF(3, 2, 2, 7.0f))), "");
    ASSERT_EQ(error_of(gl::Transfers().upload(given, ImageF(1, 1, 1, 7.0f))), "");
    glBindImageTexture(0, taken.name, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RG16F);
    EXPECT_EQ(read(taken), 7);
    gl::RunObjects objects;
    ASSERT_EQ(error_of(objects.reserve(16)), "");
    const std::byte block[16] = {};
    objects.upload(block);
    EXPECT_TRUE(std::isnan(read(taken)));
    EXPECT_EQ(read(given), 7);
}

// What a motion blur reads; a constant for each.
FramePlanes blurred_planes(int width, int height, float value) {
    return planes_of(ImageF(width, height, 4, value), ImageF(width, height, 1, value),
                     ImageF(width, height, 2, 9 * value));
}

Plan plan_of(const char* mode, int width, int height) {
    FrameDescription frame;
    frame.width = frame.display_width = width;
    frame.height = frame.display_height = height;
    frame.planes = {Role::color, Role::motion, Role::inverse_depth};
    return must(make_plan(chain_of("motion_blur", {{"mode", std::string(mode)}}), frame));
}

TEST_F(GpuLike, UploadsTheNextFrameWhileOneIsFiltered) {
    const Plan plan = plan_of("single", 512, 640);  // 9 MB
    const auto shared = [](float value) {
        SharedPlanes all;
        for (auto& [role, plane] : blurred_planes(512, 640, value)) {
            plane.at(200, 300) = 7;
            all[role] = std::make_shared<const ImageF>(std::move(plane));
        }
        return all;
    };
    const SharedPlanes first = shared(0.5f), second = shared(0.25f);
    const std::map<const SharedPlanes*, FramePlanes> expected = {
        {&first, must(executor().filter(plan, first))},
        {&second, must(executor().filter(plan, second))}};
    const auto calls_in = [&](const SharedPlanes& planes) {
        traced();
        const FramePlanes out = must(executor().filter(plan, planes));
        EXPECT_EQ(out.at(Role::color), expected.at(&planes).at(Role::color));
        return traced();
    };
    const auto position = [](const std::vector<std::string>& calls, const char* call) {
        return std::find(calls.begin(), calls.end(), call);
    };
    const auto uploads = [](auto begin, auto end) { return std::count(begin, end, "upload"); };
    const auto alone = calls_in(first);
    const auto all = uploads(alone.begin(), alone.end());
    EXPECT_GE(all, 8);  // pieces of 1 MB
    EXPECT_EQ(uploads(position(alone, "frame"), alone.end()), 0);

    int asked = 0;
    std::vector<std::string> overlapped;
    {
        // The next frame is known a little later.
        const ExpectScope expects(executor(), [&]() -> NextRun {
            return ++asked < 3 ? NextRun{} : NextRun{&plan, &second};
        });
        overlapped = calls_in(first);
    }
    EXPECT_EQ(asked, 3);
    const auto begins = position(overlapped, "frame"), reads = position(overlapped, "read");
    const auto last_dispatch =
        std::find(std::make_reverse_iterator(reads), std::make_reverse_iterator(begins), "dispatch")
            .base();
    EXPECT_GT(uploads(begins, last_dispatch), 0) << "between two dispatches of the first frame";
    const auto ahead = uploads(begins, overlapped.cend());
    const auto rest = calls_in(second);
    EXPECT_EQ(ahead + uploads(rest.begin(), rest.end()), all) << "each piece once";

    // Four pieces are asked for before one is waited for.
    const auto first_read = position(rest, "read");
    EXPECT_EQ(std::vector<std::string>(first_read, first_read + 4),
              std::vector<std::string>(4, "read"));
}

TEST_F(GpuLike, LinksEveryProgramBeforeItAsksForOne) {
    Executor fresh(gl::describe_current());
    traced();
    must(fresh.filter(plan_of("guertin", 64, 64), blurred_planes(64, 64, 1)));
    const auto calls = traced();
    const auto asked = std::find(calls.begin(), calls.end(), "status");
    EXPECT_GE(std::count(calls.begin(), asked, "link"), 3);
    EXPECT_EQ(std::count(asked, calls.end(), "link"), 0);
}

TEST_F(GpuLike, AlignsUniformBlocks) {
    GLuint buffer = 0;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, 1024, nullptr, 0);
    EXPECT_EQ(gl::RunObjects().alignment(), 256u);
    glBindBufferRange(GL_UNIFORM_BUFFER, 0, buffer, 256, 16);
    EXPECT_DEATH(glBindBufferRange(GL_UNIFORM_BUFFER, 0, buffer, 128, 16),
                 "offset of a uniform block: 128");
    glDeleteBuffers(1, &buffer);
}

// Before GL would.
TEST_F(GpuLike, APlanThatNeedsMoreUnitsThanTheDeviceHasIsRefused) {
    Plan plan;
    PlanTexture texture;
    texture.name = "result";
    texture.format = Format::r8;
    texture.width = texture.height = 1;
    texture.first_step = texture.last_step = 0;
    plan.textures.push_back(texture);
    plan.passes.emplace_back();
    Step step;
    step.pass = 0;
    step.program.file = "common/lens_samples.comp";
    step.uniforms_type = "LensSamplesUniforms";
    step.uniforms.resize(16384);
    step.groups = {1, 1, 1};
    for (const int unit : {0, 8}) {
        step.bindings = {{unit, 0, Access::write}};
        plan.steps = {step};
        const auto out = executor().run(plan, {});
        EXPECT_EQ(out.ok(), unit < 8) << out.status().message();
        if (unit < 8) continue;
        EXPECT_EQ(out.status().message(),
                  "a step uses 9 image units; this device's limit is 8 "
                  "(GL_MAX_COMPUTE_IMAGE_UNIFORMS)");
    }
}

TEST_F(GpuLike, RefusesMoreThanTheSmallestLimits) {
    const gl::Limits limits = gl::describe_current().limits;
    EXPECT_EQ(limits.image_units, 8);
    EXPECT_EQ(limits.texture_units, 16);
    EXPECT_DEATH(glBindImageTexture(8, 0, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F),
                 "image unit: 8");
    EXPECT_DEATH(glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 8, 0), "storage buffer: 8");
    std::string images, stores;
    for (int i = 0; i < 8; ++i) {
        images += concat("layout(binding = 2) writeonly uniform image2D image_", i, ";\n");
        stores += concat("imageStore(image_", i, ", ivec2(0), vec4(0.0));\n");
    }
    const std::string main =
        images + "void main() { imageStore(result, ivec2(0), vec4(0.0));\n" + stores + "}\n";
    EXPECT_DEATH(run(main, 0), "images of a program: 9");
}

}  // namespace
}  // namespace postchain::test

// Mistakes of a host. Each gives a status and a message that names it, pc_run() returns the host's
// color, and no GL error stays set.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <thread>

#include "tests/guest/allocations.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/transcript.h"

namespace postchain::test::bad_input_test {
namespace {

constexpr int kWidth = 48, kHeight = 32;

// A guest that has seen a good frame.
class BadInput : public ::testing::Test {
  protected:
    explicit BadInput(uint32_t flags = 0)
        : host_(canonical_frame(kWidth, kHeight)),
          output_(GL_RGBA32F, ImageF(kWidth, kHeight, 4, 5)) {
        guest_ = instance(flags);
        chain_ = chain("motion_blur,depth_of_field");
        frame_ = host_.frame;
        frame_.output = output_;
        prepare_and_run(guest_, chain_, frame_);
        good_ = read(output_, kWidth, kHeight);
        clear_output();
    }
    void clear_output() {
        const float gray[4] = {5, 5, 5, 5};
        glClearTexImage(output_.texture().name, 0, GL_RGBA, GL_FLOAT, gray);
    }
    // The frame is refused, color is returned, the output is untouched, and the next good frame is
    // filtered.
    void refused(const std::function<void(pc_frame&)>& spoil) {
        pc_frame frame = frame_;
        spoil(frame);
        while (glGetError() != GL_NO_ERROR) {
        }
        pc_texture result = {};
        expect_refused(pc_run(guest_.get(), chain_.get(), &frame, &result));
        EXPECT_STREQ(pc_last_error(guest_.get()), pc_error());
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "a GL error stays";
        EXPECT_EQ(result.name, frame.color.name) << "the host's picture is handed through";
        EXPECT_EQ(read(output_, kWidth, kHeight), ImageF(kWidth, kHeight, 4, 5));
        run(guest_, chain_, frame_);
        EXPECT_STREQ(pc_last_error(guest_.get()), "");
        EXPECT_TRUE(equal_bits(read(output_, kWidth, kHeight), good_));
        clear_output();
    }

    const Transcript whole_{POSTCHAIN_SOURCE_DIR "/tests/guest/expected"};
    HostFrameTextures host_;
    HostTexture output_;
    pc::Instance guest_;
    pc::Chain chain_;
    pc_frame frame_;
    ImageF good_;
};

using F = pc_frame&;
constexpr pc_result kChain = PC_ERROR_CHAIN;

// Members that need no texture: Members.* of planner_test.cpp.
TEST_F(BadInput, Textures) {
    const HostTexture narrow(GL_R32F, kWidth / 2, kHeight);
    refused([&](F f) { f.depth = narrow; });
    refused([](F f) { f.output.x = 1; });
    refused([](F f) { f.motion.y = INT32_MAX; });
    refused([](F f) { f.height = kHeight + 1; });
    refused([](F f) { f.color.name = 0; });
    refused([](F f) { f.motion.name = 0; });
    refused([](F f) { f.depth.name = 0; });
    refused([](F f) { f.color.width = f.color.height = 0; });
    refused([](F f) { f.width = -3; });
    for (const auto side : {&pc_texture::width, &pc_texture::height})
        refused([side](F f) {
            for (pc_texture* texture : {&f.color, &f.depth, &f.motion, &f.output})
                texture->*side = 1 << 20;
        });
    pc_frame other = host_.frame;
    const auto refused_neighbor = [&](const std::function<void(F)>& spoil) {
        other = host_.frame;
        spoil(other);
        refused([&](F f) { f.before = &other; });
        refused([&](F f) { f.after = &other; });
    };
    refused_neighbor([](F f) { f.color.name = 0; });
    refused_neighbor([](F f) { f.motion.name = 0; });
    refused_neighbor([](F f) { f.exposure = f.depth; });
    refused_neighbor([](F f) { f.struct_size = 8; });
}

TEST_F(BadInput, Formats) {
    refused([](F f) { f.color.internal_format = GL_RGBA8UI; });
    refused([](F f) { f.motion.internal_format = 0; });
    refused([](F f) { f.motion.internal_format = GL_R32F; });
    refused([](F f) { f.color.internal_format = GL_DEPTH_COMPONENT32F; });
    refused([](F f) { f.output.internal_format = GL_RG32F; });
    refused([](F f) { f.output.internal_format = GL_SRGB8_ALPHA8; });
}

TEST_F(BadInput, Values) {
    static const std::string endless(500, 'x');
    refused([](F f) { f.focus_distance = 0; });
    refused([](F f) { f.depth_encoding = PC_DEPTH_REVERSE_INFINITE; });
    refused([](F f) { f.flags |= 0x400; });
    refused([](F f) { f.debug_view = "nothing"; });
    refused([](F f) { f.debug_view = endless.c_str(); });
}

// Sizes that hosts of other versions have: older_host.c.
TEST_F(BadInput, StructsOfNoVersion) {
    // The bytes behind the host's struct are not read: a short one, and two that are not set.
    for (const uint32_t size : {12u, 65537u, 0xcdcdcdcdu})
        refused([&](F f) {
            f.struct_size = size;
            f.color.name = 0;
        });
    void (*const changes[])(pc_create_info&) = {
        [](auto& info) { info.struct_size = 4; },
        [](auto& info) { info.api_version = 0x00020000; },
        [](auto& info) { info.flags = 8; },
        [](auto& info) { info.reserved = 7; },
        [](auto& info) { info.state = 3; },
        [](auto& info) { info.max_width = 9; },
        [](auto& info) { info.max_height = 9; },
        [](auto& info) { info.max_width = 1 << 20, info.max_height = 9; },
        [](auto& info) { info.max_width = 9, info.max_height = 1 << 20; }};
    for (const auto change : changes) {
        auto info = pc::create_info();
        change(info);
        pc_instance* made = nullptr;
        expect_refused(pc_create(&info, &made));
        EXPECT_EQ(made, nullptr);
    }
    pc_counters counters = {};
    EXPECT_EQ(pc_count(guest_.get(), &counters), PC_ERROR_VERSION);
    pc_parameter row = {};
    EXPECT_EQ(pc_chain_parameter(chain_.get(), 0, &row), PC_ERROR_VERSION);
}

TEST_F(BadInput, Chains) {
    pc_chain* made = nullptr;
    std::string many = "fxaa";
    for (int i = 1; i < 65; ++i) many += ",fxaa";
    for (const char* passes : {"motion_blur,fxa", many.c_str(), "", "  ", "motion_blur,",
                               "motion_blur, ,fxaa", ",fxaa", (const char*)nullptr})
        expect_refused(pc_chain_create(passes, &made));
    EXPECT_EQ(made, nullptr);
    EXPECT_TRUE(pc::chain(many.substr(5).c_str())) << "64 passes: " << pc_error();
    EXPECT_TRUE(pc::chain("  motion_blur , fxaa ")) << pc_error();
    pc_chain* c = chain_.get();
    expect_refused(pc_chain_set_number(c, 0, "samples", 24));
    EXPECT_STREQ(pc_chain_error(c), pc_error());
    expect_refused(pc_chain_set_number(c, 0, "sample", 25));
    for (const double value : {25.5, 1e15, -1e15, 1e300, double(INFINITY), std::nan("")})
        expect_refused(pc_chain_set_number(c, 0, "samples", value));
    EXPECT_EQ(pc_chain_set_number(c, 0, "animate_noise", 1), PC_OK) << pc_error();
    for (const double value : {0.5, 2.0, -1.0})
        expect_refused(pc_chain_set_number(c, 0, "animate_noise", value));
    for (const pc_result without_key :
         {pc_chain_set_number(c, 0, nullptr, 1), pc_chain_set_text(c, 0, nullptr, "guertin"),
          pc_chain_set_text(c, 0, "mode", nullptr), pc_chain_set_point(c, 0, nullptr, 0, 0),
          pc_chain_unset(c, 0, nullptr)})
        EXPECT_EQ(without_key, kChain);
    expect_refused(pc_chain_set_number(c, 9, "samples", 25));
    expect_refused(pc_chain_set_text(c, 0, "mode", "nothing"));
    expect_refused(pc_chain_set_text(c, PC_CAMERA, "aperture_image", "star.png"));
    EXPECT_EQ(pc_chain_set_number(c, 0, "shutter_angle_deg", 90), PC_OK);
    expect_refused(pc_chain_set_number(c, 0, "shutter_frames", 0.5));
    EXPECT_EQ(pc_chain_set_number(c, 0, "shutter_angle_deg", 120), PC_OK) << "it was set";
    EXPECT_EQ(pc_chain_unset(c, 0, "shutter_angle_deg"), PC_OK);
    const std::vector<float> dark(128 * 128, 0.0f);
    EXPECT_EQ(pc_chain_set_aperture(c, dark.data()), PC_ERROR_INPUT);
}

TEST_F(BadInput, MemoryThatIsRefused) {
    const auto large = canonical_frame(200, 100);
    gl_faults().refuses_storage = true;
    pc_texture result = {};
    expect_error(pc_run(guest_.get(), chain_.get(), &large.frame, &result), PC_ERROR_MEMORY,
                 "allocating a texture of 200x100");
    EXPECT_EQ(result.name, large.frame.color.name);
    gl_faults().refuses_storage = false;
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << "GL's refusal does not stay";
    EXPECT_EQ(count(guest_).texture_bytes, 0u) << "what was refused counts";
    run(guest_, chain_, large.frame);

    // Memory of the process: every operator new of the next call fails.
    frame_.focus_distance *= 1.25f;
    refuse_memory(true);
    const pc_result code = pc_run(guest_.get(), chain_.get(), &frame_, &result);
    refuse_memory(false);
    EXPECT_EQ(code, PC_ERROR_MEMORY);
    EXPECT_EQ(result.name, frame_.color.name);
    run(guest_, chain_, frame_);
}

TEST(Budget, IsKept) {
    const auto host = canonical_frame(128, 64), large = canonical_frame(512, 256);
    auto info = pc::create_info();
    info.texture_budget = 2 << 20;
    const pc::Instance guest = pc::create(info);
    ASSERT_TRUE(guest);
    const auto made = chain("motion_blur,fxaa,depth_of_field");
    prepare_and_run(guest, made, host.frame);
    pc_texture result = {};
    expect_error(pc_run(guest.get(), made.get(), &large.frame, &result), PC_ERROR_MEMORY,
                 "the budget is 2097152");
    EXPECT_EQ(result.name, large.color.texture().name);
    auto counters = pc::make<pc_counters>();
    pc_count(guest.get(), &counters);
    EXPECT_LE(counters.texture_bytes_peak, 2u << 20);
    EXPECT_EQ(pc_run(guest.get(), made.get(), &host.frame, &result), PC_OK);
}

class Validated : public BadInput {
  protected:
    Validated() : BadInput(PC_VALIDATE) {}
};

TEST_F(Validated, NamesTargetsSizesAndFormats) {
    GLuint array = 0, deleted = 0;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &array);
    glTextureStorage3D(array, 1, GL_RGBA32F, kWidth, kHeight, 2);
    const HostTexture integers(GL_RGBA32UI, kWidth, kHeight), half(GL_RGBA16F, kWidth, kHeight);
    refused([&](F f) { f.color.name = array; });
    for (const GLenum target : {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_CUBE_MAP, GL_TEXTURE_3D,
                                GL_TEXTURE_RECTANGLE, GL_TEXTURE_1D}) {
        GLuint other = 0;
        glCreateTextures(target, 1, &other);
        refused([&](F f) { f.depth.name = other; });
        glDeleteTextures(1, &other);
    }
    // Some drivers give its name to the next texture.
    glCreateTextures(GL_TEXTURE_2D, 1, &deleted);
    glDeleteTextures(1, &deleted);
    refused([&](F f) { f.depth.name = deleted; });
    refused([&](F f) { f.color.name = integers.texture().name; });
    refused([&](F f) { f.color.name = half.texture().name; });
    const HostTexture wider(GL_R32F, kWidth + 4, kHeight), higher(GL_R32F, kWidth, kHeight + 4);
    refused([&](F f) { f.depth.name = wider.texture().name; });
    refused([&](F f) { f.depth.name = higher.texture().name; });
    glDeleteTextures(1, &array);
    const HostTexture other(GL_RG32F, kWidth, kHeight);
    pc_frame before = host_.frame;
    before.color.name = other.texture().name;
    refused([&](F f) { f.before = &before; });
}

// Values that no frame has.
TEST_F(Validated, BoundsAndLens) {
    refused([](F f) { f.nearest = 5, f.farthest = 2; });
    refused([](F f) { f.max_speed_px = -1; });
    refused([](F f) { f.nearest = -3; });
    refused([](F f) { f.farthest = -3; });
    refused([](F f) { f.f_stop = 1e-30f; });
    refused([](F f) { f.meters_per_unit = -1; });
    refused([](F f) { f.shutter_frames = 101; });
    frame_.nearest = frame_.farthest = 5;
    frame_.shutter_frames = -1;
    frame_.f_stop = 0.01f;
    run(guest_, chain_, frame_);
}

TEST_F(Validated, ReadsDepthNotStencil) {
    for (const unsigned format : {GL_DEPTH24_STENCIL8, GL_DEPTH32F_STENCIL8}) {
        const HostTexture both(format, kWidth, kHeight);
        glTextureParameteri(both.texture().name, GL_DEPTH_STENCIL_TEXTURE_MODE, GL_STENCIL_INDEX);
        refused([&](F f) { f.depth = both; });
    }
}

TEST_F(Validated, LevelsOfMutableTextures) {
    GLuint name = 0;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    const auto allocate = [&](int level, GLenum format, int width, int height) {
        glTexImage2D(GL_TEXTURE_2D, level, GLint(format), width, height, 0, GL_RGBA, GL_FLOAT,
                     nullptr);
    };
    const auto as_output = [&](F f) { f.output.name = name; };
    const auto as_color = [&](F f) { f.color.name = name; };
    const auto accepted = [&](const std::function<void(pc_frame&)>& change) {
        pc_frame frame = frame_;
        change(frame);
        run(guest_, chain_, frame);
        clear_output();
    };
    // As it comes from glTexImage2D(): a filter that needs levels, and none of them.
    allocate(0, GL_RGBA32F, kWidth, kHeight);
    accepted(as_color);
    refused(as_output);
    for (const GLint filter : {GL_NEAREST, GL_LINEAR}) {
        glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, filter);
        accepted(as_output);
    }
    pc_texture stored = output_;
    stored.name = name;
    EXPECT_TRUE(equal_bits(read(stored, kWidth, kHeight), good_));
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAX_LEVEL, 0);
    accepted(as_output);
    glTextureParameteri(name, GL_TEXTURE_MAX_LEVEL, 1000);
    for (int level = 1; level < 6; ++level) {
        refused(as_output);
        allocate(level, GL_RGBA32F, kWidth >> level, kHeight >> level);
    }
    accepted(as_output);  // 48x32 to 1x1
    glTextureParameteri(name, GL_TEXTURE_BASE_LEVEL, 1);
    refused(as_color);
    glTextureParameteri(name, GL_TEXTURE_BASE_LEVEL, 0);
    allocate(0, GL_RGBA, kWidth, kHeight);
    refused(as_color);
    glDeleteTextures(1, &name);
}

TEST(Context, NoneAnotherOneAndAnotherThread) {
    const auto host = canonical_frame(40, 24);
    auto guest = instance();
    const auto made = chain("motion_blur");
    prepare_and_run(guest, made, host.frame);
    pc_texture result = {};
    const auto run = [&] { return pc_run(guest.get(), made.get(), &host.frame, &result); };

    auto info = pc::create_info();
    pc_instance* second = nullptr;
    info.flags = PC_OWN_CONTEXT;
    expect_error(pc_create(&info, &second), PC_ERROR_CONTEXT, "a context is current");

    other_context();
    expect_error(run(), PC_ERROR_CONTEXT, "not current");
    EXPECT_EQ(result.name, host.color.texture().name);
    EXPECT_EQ(pc_prepare(guest.get(), made.get(), &host.frame, 1), PC_ERROR_CONTEXT);
    uint32_t none = 0;
    EXPECT_EQ(pc_timings(guest.get(), nullptr, &none, nullptr), PC_ERROR_CONTEXT);
    other_context_done();
    EXPECT_EQ(run(), PC_OK);

    pc_result elsewhere = PC_OK;
    std::thread([&] { elsewhere = run(); }).join();
    EXPECT_EQ(elsewhere, PC_ERROR_CONTEXT);

    release_host_context();
    EXPECT_EQ(run(), PC_ERROR_CONTEXT);
    info.flags = 0;
    expect_error(pc_create(&info, &second), PC_ERROR_CONTEXT, "no GL context");
    // Without its context an instance can only be abandoned.
    pc_destroy(guest.release());
    regain_host_context();
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
}

TEST(Context, LostOneCanOnlyBeAbandoned) {
    const auto host = canonical_frame(40, 24);
    gl_faults().tells_loss = true;
    auto guest = instance();
    const auto made = chain("motion_blur");
    prepare_and_run(guest, made, host.frame);
    gl_faults().is_lost = true;
    pc_texture result = {};
    expect_error(pc_run(guest.get(), made.get(), &host.frame, &result), PC_ERROR_CONTEXT, "lost");
    EXPECT_EQ(result.name, host.color.texture().name);
    gl_faults().tells_loss = gl_faults().is_lost = false;  // GL reports it once
    EXPECT_EQ(pc_run(guest.get(), made.get(), &host.frame, &result), PC_ERROR_CONTEXT);
    GlCalls::start();
    pc_abandon(guest.release());
    EXPECT_TRUE(GlCalls::stop().empty()) << "calls no GL";
}

void* no_compute(void*, const char* name) {
    return std::string(name) == "glDispatchComputeIndirect" ? nullptr : (void*)&no_compute;
}
const unsigned char* another_gl(GLenum) {
    return reinterpret_cast<const unsigned char*>("4.5 of another driver");
}
void* elsewhere(void*, const char*) {
    return (void*)&another_gl;
}
void* this_gl(void*, const char* name) {
    return std::string(name) == "glGetString" ? (void*)glGetString : (void*)&this_gl;
}

TEST(Context, ALoaderThatLeadsElsewhere) {
    make_host_context();
    auto info = pc::create_info();
    pc_instance* made = nullptr;
    info.get_proc_address = no_compute;
    expect_error(pc_create(&info, &made), PC_ERROR_CONTEXT, "knows no glDispatchComputeIndirect");
    info.get_proc_address = elsewhere;
    expect_error(pc_create(&info, &made), PC_ERROR_CONTEXT, "4.5 of another driver");
    info.get_proc_address = this_gl;
    EXPECT_EQ(pc_create(&info, &made), PC_OK) << pc_create_error();
    pc_destroy(made);
}

}  // namespace
}  // namespace postchain::test::bad_input_test

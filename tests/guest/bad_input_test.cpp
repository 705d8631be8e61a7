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

using ::testing::HasSubstr;

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
    // The frame is refused with this code, color is returned, the output is untouched, and the next
    // good frame is filtered.
    void refused(pc_result code, const std::string& message,
                 const std::function<void(pc_frame&)>& spoil) {
        pc_frame frame = frame_;
        spoil(frame);
        while (glGetError() != GL_NO_ERROR) {
        }
        pc_texture result = {};
        EXPECT_EQ(pc_run(guest_.get(), chain_.get(), &frame, &result), code) << message;
        Transcript::say(concat(pc_result_name(code), " ", pc_last_error(guest_.get())));
        EXPECT_THAT(pc_last_error(guest_.get()), HasSubstr(message));
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
constexpr pc_result kInput = PC_ERROR_INPUT, kChain = PC_ERROR_CHAIN, kArgument = PC_ERROR_ARGUMENT;

TEST_F(BadInput, Textures) {
    const HostTexture narrow(GL_R32F, kWidth / 2, kHeight), low(GL_R32F, kWidth, kHeight / 2);
    for (const HostTexture* small : {&narrow, &low})
        refused(kInput, "depth: a frame of 48x32", [&](F f) { f.depth = *small; });
    for (const auto place : {&pc_texture::x, &pc_texture::y}) {
        refused(kInput, "output", [&](F f) { f.output.*place = 1; });
        refused(kInput, "motion", [&](F f) { f.motion.*place = -1; });
        refused(kInput, "motion", [&](F f) { f.motion.*place = INT32_MAX; });
    }
    refused(kInput, "color: a frame of 49x32", [](F f) { f.width = kWidth + 1; });
    refused(kInput, "color: a frame of 48x33", [](F f) { f.height = kHeight + 1; });
    refused(kInput, "color: name 0", [](F f) { f.color.name = 0; });
    refused(kInput, "motion", [](F f) { f.motion.name = 0; });
    pc_frame other = host_.frame;
    const auto refused_neighbor = [&](pc_result code, const char* text,
                                      const std::function<void(F)>& spoil) {
        other = host_.frame;
        spoil(other);
        refused(code, concat("before", text), [&](F f) { f.before = &other; });
        refused(code, concat("after", text), [&](F f) { f.after = &other; });
    };
    refused_neighbor(kInput, ".color: name 0", [](F f) { f.color.name = 0; });
    refused_neighbor(kInput, ".motion: name 0; give the plane", [](F f) { f.motion.name = 0; });
    refused_neighbor(kInput, ".depth.internal_format: 0x1",
                     [](F f) { f.depth.internal_format = 1; });
    refused_neighbor(kInput, ".exposure: give it in both", [](F f) { f.exposure = f.depth; });
    refused_neighbor(kChain, ".near_clip", [](F f) { f.depth_encoding = PC_DEPTH_FORWARD; });
    refused_neighbor(PC_ERROR_VERSION, ".struct_size is 8", [](F f) { f.struct_size = 8; });
    refused(kInput, "depth", [](F f) { f.depth.name = 0; });
    refused(kInput, "the frame is 0x0", [](F f) { f.color.width = f.color.height = 0; });
    refused(kInput, "-3x", [](F f) { f.width = -3; });
    refused(kInput, "x-3", [](F f) { f.height = -3; });
    refused(kInput, "depth: its size is 0x0", [](F f) { f.depth.width = f.depth.height = 0; });
    for (const auto& [side, text] :
         {std::pair(&pc_texture::width, "the frame is 1048576x32; this device's limit is "),
          {&pc_texture::height, "the frame is 48x1048576; this device's limit is "}})
        refused(kInput, text, [side = side](F f) {
            for (pc_texture* texture : {&f.color, &f.depth, &f.motion, &f.output})
                texture->*side = 1 << 20;
        });
}

TEST_F(BadInput, Formats) {
    refused(kInput, "color.internal_format: 0x8d7c",
            [](F f) { f.color.internal_format = GL_RGBA8UI; });
    refused(kInput, "motion.internal_format: 0x0", [](F f) { f.motion.internal_format = 0; });
    refused(kInput, "motion: GL_R32F has fewer than the 2 channels",
            [](F f) { f.motion.internal_format = GL_R32F; });
    refused(kInput, "color: GL_DEPTH_COMPONENT32F",
            [](F f) { f.color.internal_format = GL_DEPTH_COMPONENT32F; });
    refused(kInput, "output: GL_RG32F has fewer than the 3 channels",
            [](F f) { f.output.internal_format = GL_RG32F; });
    refused(kInput, "output: GL_SRGB8_ALPHA8 cannot be written",
            [](F f) { f.output.internal_format = GL_SRGB8_ALPHA8; });
}

TEST_F(BadInput, Values) {
    static const std::string endless(500, 'x');
    refused(kChain, "focus_distance is nan", [](F f) { f.focus_distance = std::nanf(""); });
    refused(kChain, "view_projection: element 7", [](F f) { f.view_projection[7] = INFINITY; });
    refused(kChain, "near_clip", [](F f) { f.depth_encoding = PC_DEPTH_REVERSE_INFINITE; });
    refused(kChain, "far_clip", [](F f) {
        f.depth_encoding = PC_DEPTH_FORWARD;
        f.near_clip = f.far_clip = 1;
    });
    refused(kArgument, "flags: PC_TOP_LEFT and PC_BOTTOM_LEFT; give one",
            [](F f) { f.flags |= PC_TOP_LEFT | PC_BOTTOM_LEFT; });
    refused(kArgument, "depth_encoding: 9", [](F f) { f.depth_encoding = 9; });
    refused(kChain, "depth_range: both ends are 0.5", [](F f) {
        f.depth_encoding = PC_DEPTH_REVERSE_INFINITE;
        f.near_clip = 1;
        f.depth_range[0] = f.depth_range[1] = 0.5f;
    });
    refused(kChain, "depth_range: this depth_encoding", [](F f) { f.depth_range[1] = 0.5f; });
    refused(kChain, "focus_distance", [](F f) { f.focus_distance = 0; });
    refused(kChain, "focus_radius: 2", [](F f) { f.focus_radius = 2; });
    refused(kChain, "frame_seconds: must be > 0", [](F f) { f.focus_seconds = 0.5f; });
    refused(kChain, "pixel_aspect", [](F f) { f.pixel_aspect = -1; });
    refused(kInput, "motion_size: 32x61",
            [](F f) { f.motion_size[0] = 32, f.motion_size[1] = 61; });
    refused(kArgument, "no texture \"nothing\"", [](F f) { f.debug_view = "nothing"; });
    refused(kArgument, "debug_view: longer than", [](F f) { f.debug_view = endless.c_str(); });
    refused(PC_ERROR_VERSION, "pc_frame.flags: 1030", [](F f) { f.flags |= 0x400; });
    refused(PC_ERROR_VERSION, "pc_frame.reserved", [](F f) { f.reserved = 1; });
    refused(PC_ERROR_VERSION, "pc_frame.reserved", [](F f) { f.reserved_2 = 1; });
    refused(PC_ERROR_VERSION, "pc_frame.reserved", [](F f) { f.reserved_3[1] = 1; });
}

// Sizes that hosts of other versions have: older_host.c.
TEST_F(BadInput, StructsOfNoVersion) {
    refused(PC_ERROR_VERSION, "pc_frame.struct_size is 12", [](F f) {
        f.struct_size = 12;
        f.color.name = 0;  // not read from so short a struct
    });
    // Not initialized: the bytes behind the host's struct are not read.
    for (const uint32_t size : {65537u, 0xcdcdcdcdu})
        refused(PC_ERROR_VERSION, concat("pc_frame.struct_size is ", size, ", more than 65536"),
                [&](F f) {
                    f.struct_size = size;
                    f.color.name = 0;
                });
    constexpr pc_result kVersion = PC_ERROR_VERSION;
    const struct {
        pc_result code;
        const char* member;
        void (*change)(pc_create_info&);
    } cases[] = {{kVersion, "pc_create_info.struct_size", [](auto& info) { info.struct_size = 4; }},
                 {kVersion, "api_version 2.0", [](auto& info) { info.api_version = 0x00020000; }},
                 {kVersion, "pc_create_info.flags: 8", [](auto& info) { info.flags = 8; }},
                 {kVersion, "pc_create_info.reserved", [](auto& info) { info.reserved = 7; }},
                 {kArgument, "state: 3", [](auto& info) { info.state = 3; }},
                 {kArgument, "max_height: 9x0; give both", [](auto& info) { info.max_width = 9; }},
                 {kArgument, "max_height: 0x9; give both", [](auto& info) { info.max_height = 9; }},
                 {kArgument, "max_height: 1048576x9",
                  [](auto& info) { info.max_width = 1 << 20, info.max_height = 9; }},
                 {kArgument, "max_height: 9x1048576",
                  [](auto& info) { info.max_width = 9, info.max_height = 1 << 20; }}};
    for (const auto& [code, member, change] : cases) {
        auto info = pc::create_info();
        change(info);
        pc_instance* made = nullptr;
        expect_error(pc_create(&info, &made), code, member);
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
    const struct {
        const char *passes, *text;
    } lists[] = {{"motion_blur,fxa", "did you mean fxaa?"},
                 {many.c_str(), "more than 64 passes"},
                 {"", "no pass; known are "},
                 {"  ", "no pass; known are "},
                 {"motion_blur,", "\"motion_blur,\": a name is empty"},
                 {"motion_blur, ,fxaa", "a name is empty"},
                 {",fxaa", "a name is empty"}};
    for (const auto& [passes, text] : lists)
        expect_error(pc_chain_create(passes, &made), PC_ERROR_CHAIN, text);
    expect_error(pc_chain_create(nullptr, &made), PC_ERROR_ARGUMENT, "passes is NULL");
    EXPECT_EQ(made, nullptr);
    EXPECT_TRUE(pc::chain(many.substr(5).c_str())) << "64 passes: " << pc_error();
    EXPECT_TRUE(pc::chain("  motion_blur , fxaa ")) << pc_error();
    pc_chain* c = chain_.get();
    expect_error(pc_chain_set_number(c, 0, "samples", 24), kChain, "24 is even");
    EXPECT_STREQ(pc_chain_error(c), pc_error());
    expect_error(pc_chain_set_number(c, 0, "sample", 25), kChain, "samples");
    expect_error(pc_chain_set_number(c, 0, "samples", 25.5), kChain, "25.5");
    for (const double value : {1e15, -1e15, 1e300, double(INFINITY), std::nan("")})
        expect_error(pc_chain_set_number(c, 0, "samples", value), kChain, "samples");
    EXPECT_EQ(pc_chain_set_number(c, 0, "animate_noise", 1), PC_OK) << pc_error();
    for (const double value : {0.5, 2.0, -1.0})
        expect_error(pc_chain_set_number(c, 0, "animate_noise", value), kChain, "animate_noise");
    for (const pc_result without_key :
         {pc_chain_set_number(c, 0, nullptr, 1), pc_chain_set_text(c, 0, nullptr, "guertin"),
          pc_chain_set_text(c, 0, "mode", nullptr), pc_chain_set_point(c, 0, nullptr, 0, 0),
          pc_chain_unset(c, 0, nullptr)})
        EXPECT_EQ(without_key, kChain);
    expect_error(pc_chain_set_number(c, 9, "samples", 25), kArgument, "9");
    expect_error(pc_chain_set_text(c, 0, "mode", "nothing"), kChain, "guertin");
    expect_error(pc_chain_set_text(c, PC_CAMERA, "aperture_image", "star.png"), kChain,
                 "pc_chain_set_aperture");
    EXPECT_EQ(pc_chain_set_number(c, 0, "shutter_angle_deg", 90), PC_OK);
    expect_error(pc_chain_set_number(c, 0, "shutter_frames", 0.5), kChain, "shutter_angle_deg");
    EXPECT_EQ(pc_chain_set_number(c, 0, "shutter_angle_deg", 120), PC_OK) << "it was set";
    EXPECT_EQ(pc_chain_unset(c, 0, "shutter_angle_deg"), PC_OK);
    const std::vector<float> dark(128 * 128, 0.0f);
    EXPECT_EQ(pc_chain_set_aperture(c, dark.data()), kInput);
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
    refused(kInput, "is a GL_TEXTURE_2D_ARRAY", [&](F f) { f.color.name = array; });
    const std::pair<GLenum, const char*> targets[] = {
        {GL_TEXTURE_2D_MULTISAMPLE, "is a GL_TEXTURE_2D_MULTISAMPLE; only GL_TEXTURE_2D and"},
        {GL_TEXTURE_CUBE_MAP, "is a GL_TEXTURE_CUBE_MAP; only"},
        {GL_TEXTURE_3D, "is a GL_TEXTURE_3D; only"},
        {GL_TEXTURE_RECTANGLE, "is a GL_TEXTURE_RECTANGLE; only"},
        {GL_TEXTURE_1D, "is of another target; only"}};
    for (const auto& [target, text] : targets) {
        GLuint other = 0;
        glCreateTextures(target, 1, &other);
        refused(kInput, text, [&](F f) { f.depth.name = other; });
        glDeleteTextures(1, &other);
    }
    // Some drivers give its name to the next texture.
    glCreateTextures(GL_TEXTURE_2D, 1, &deleted);
    glDeleteTextures(1, &deleted);
    refused(kInput, "was it deleted?", [&](F f) { f.depth.name = deleted; });
    refused(kInput, "is 0x8d70, not GL_RGBA32F",
            [&](F f) { f.color.name = integers.texture().name; });
    refused(kInput, "is GL_RGBA16F, not GL_RGBA32F",
            [&](F f) { f.color.name = half.texture().name; });
    const HostTexture wider(GL_R32F, kWidth + 4, kHeight), higher(GL_R32F, kWidth, kHeight + 4);
    refused(kInput, "is 52x32, not 48x32", [&](F f) { f.depth.name = wider.texture().name; });
    refused(kInput, "is 48x36, not 48x32", [&](F f) { f.depth.name = higher.texture().name; });
    glDeleteTextures(1, &array);
}

// Values that no frame has.
TEST_F(Validated, Neighbors) {
    const HostTexture other(GL_RG32F, kWidth, kHeight);
    pc_frame before = host_.frame;
    before.color.name = other.texture().name;
    refused(kInput, "before.color: ", [&](F f) { f.before = &before; });
}

TEST_F(Validated, BoundsAndLens) {
    refused(kChain, "nearest: 5 is beyond farthest, 2", [](F f) { f.nearest = 5, f.farthest = 2; });
    refused(kChain, "max_speed_px is -1; give a bound, or 0", [](F f) { f.max_speed_px = -1; });
    refused(kChain, "nearest is -3", [](F f) { f.nearest = -3; });
    refused(kChain, "farthest is -3", [](F f) { f.farthest = -3; });
    refused(kChain, "f_stop: 1e-30 is below 0.01", [](F f) { f.f_stop = 1e-30f; });
    refused(kChain, "meters_per_unit is a number > 0", [](F f) { f.meters_per_unit = -1; });
    refused(kChain, "shutter_frames is a number in 0..100", [](F f) { f.shutter_frames = 101; });
    frame_.nearest = frame_.farthest = 5;
    frame_.shutter_frames = -1;
    frame_.f_stop = 0.01f;
    run(guest_, chain_, frame_);
}

TEST_F(Validated, ReadsDepthNotStencil) {
    for (const unsigned format : {GL_DEPTH24_STENCIL8, GL_DEPTH32F_STENCIL8}) {
        const HostTexture both(format, kWidth, kHeight);
        glTextureParameteri(both.texture().name, GL_DEPTH_STENCIL_TEXTURE_MODE, GL_STENCIL_INDEX);
        refused(kInput,
                concat("depth: texture ", both.texture().name,
                       " is read as stencil; set GL_DEPTH_STENCIL_TEXTURE_MODE"),
                [&](F f) { f.depth = both; });
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
    refused(kInput, "output: texture ", as_output);
    refused(kInput, "set the filter to GL_LINEAR or GL_NEAREST", as_output);
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
        refused(kInput, "lacks levels", as_output);
        allocate(level, GL_RGBA32F, kWidth >> level, kHeight >> level);
    }
    accepted(as_output);  // 48x32 to 1x1
    glTextureParameteri(name, GL_TEXTURE_BASE_LEVEL, 1);
    refused(kInput, "has GL_TEXTURE_BASE_LEVEL 1; set 0", as_color);
    glTextureParameteri(name, GL_TEXTURE_BASE_LEVEL, 0);
    allocate(0, GL_RGBA, kWidth, kHeight);
    refused(kInput, "is of the unsized format GL_RGBA, not GL_RGBA32F; name that format", as_color);
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

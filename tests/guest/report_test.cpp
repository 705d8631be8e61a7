// Reports of the guest: parameters and their cost, times, the plan, debug views, conventions, and
// the check of signs.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "chain/gl/device.h"
#include "passes/registry.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/transcript.h"

namespace postchain::test::report_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kWidth = 96, kHeight = 60;

// Pass, key, type and unit; the ranges; whether it is set, value and text; choices and cost.
TEST(Parameters, EveryMember) {
    const auto made = chain("depth_of_field,fxaa,motion_blur,joint_blur");
    ASSERT_EQ(pc_chain_set_point(made.get(), 0, "focus_at", 0.25, 0.75), PC_OK) << pc_error();
    ASSERT_EQ(pc_chain_set_number(made.get(), 2, "samples", 51), PC_OK);
    ASSERT_EQ(pc_chain_set_number(made.get(), PC_CAMERA, "aperture_blades", 6), PC_OK);
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/guest/expected");
    for (const pc_parameter& row : pc::parameters(made.get())) {
        const ParameterTable& table = row.pass == PC_CAMERA
                                          ? camera_parameters()
                                          : *builtin_passes().find(row.pass_name)->parameters;
        EXPECT_STREQ(row.help, table.find(row.key)->help.c_str()) << row.key;
        std::string line = concat(int32_t(row.pass), " ", row.pass_name, ".", row.key, " ",
                                  row.type, " ", row.unit, ", ", row.min, "..", row.max, " ",
                                  row.soft_min, "..", row.soft_max, row.is_set ? "" : ", unset",
                                  ", ", row.value, " '", row.text, "', cost ", row.cost);
        for (uint32_t i = 0; i < row.choice_count; ++i) line += concat(" ", row.choices[i]);
        Transcript::say(line);
    }
    for (const pc_parameter& row : pc::parameters(paper_chain().get()))
        if (row.cost != PC_COST_UNIFORM)
            Transcript::say(concat(row.pass_name, ".", row.key, " ", row.cost));
}

TEST(Parameters, EveryRowOfEveryTable) {
    const auto made = chain("fxaa,motion_blur");
    EXPECT_EQ(pc::parameters(made.get()).size(),
              builtin_passes().find("fxaa")->parameters->rows().size() +
                  builtin_passes().find("motion_blur")->parameters->rows().size() +
                  camera_parameters().rows().size());
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/guest/expected");
    const char *name = nullptr, *help = nullptr;
    uint32_t count = 0;
    for (; pc_pass(count, &name, &help) == PC_OK; ++count)
        Transcript::say(concat(name, ": ", help));
    EXPECT_EQ(count, builtin_passes().types().size());
    for (uint32_t i = 0; pc_tier(i, &name, &help) == PC_OK; ++i)
        Transcript::say(concat("tier:", name, ": ", help));
}

// Texts stay where they are until the chain changes.
TEST(Parameters, TextsOutliveOtherReads) {
    const auto made = chain("motion_blur");
    set(made, 0, "jitter", 0.12345678901234567);
    const auto text_of_jitter = [&] {
        for (const auto& row : pc::parameters(made.get()))
            if (std::string(row.key) == "jitter") return row.text;
        return "";
    };
    const char* text = text_of_jitter();
    EXPECT_EQ(text_of_jitter(), text);
}

// A parameter whose cost is a uniform compiles no program and creates no texture.
TEST(Parameters, AUniformIsAllThatItCosts) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa");
    prepare_and_run(guest, made, host.frame);
    const pc_counters before = count(guest);
    const std::tuple<uint32_t, const char*, double> changes[] = {{0, "samples", 31},
                                                                 {0, "depth_softness", 3},
                                                                 {0, "shutter_frames", 0.8},
                                                                 {1, "subpix", 0.2},
                                                                 {1, "exposure_ev", 1}};
    for (const auto& [pass, key, value] : changes) {
        for (const auto& row : pc::parameters(made.get()))
            EXPECT_TRUE(row.pass != pass || row.key != std::string(key) ||
                        row.cost == uint32_t(PC_COST_UNIFORM))
                << key;
        set(made, pass, key, value);
        run(guest, made, host.frame);
    }
    const pc_counters after = count(guest);
    EXPECT_EQ(after.programs, before.programs);
    EXPECT_EQ(after.texture_allocations, before.texture_allocations);
    EXPECT_EQ(after.plans_made, before.plans_made + std::size(changes));
}

TEST(Reports, TimesOfTheNewestFinishedFrame) {
    auto host = canonical_frame(kWidth, kHeight);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa");
    uint64_t number = 0;
    uint32_t none = 0;
    EXPECT_EQ(pc_timings(guest.get(), nullptr, &none, &number), PC_PENDING);
    ASSERT_EQ(pc_set_timing(guest.get(), 1), PC_OK);
    host.frame.frame_number = 41;
    host.frame.pre_exposure = 2;
    prepare_and_run(guest, made, host.frame);
    glFinish();
    auto times = pc::timings(guest.get(), &number);
    EXPECT_EQ(number, 41u);
    std::vector<std::string> names;
    for (const auto& time : times) {
        names.push_back(time.name);
        EXPECT_GT(time.milliseconds, 0) << time.name;
    }
    EXPECT_EQ(names, (std::vector<std::string>{"import", "motion_blur", "fxaa", "export"}));
    ASSERT_EQ(pc_set_timing(guest.get(), 2), PC_OK);
    host.frame.frame_number = 42;
    prepare_and_run(guest, made, host.frame);
    glFinish();
    times = pc::timings(guest.get(), &number);
    ASSERT_EQ(number, 42u);
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/guest/expected");
    for (const pc_time& time : times) Transcript::say(time.name);
    EXPECT_EQ(pc_set_timing(guest.get(), 3), PC_ERROR_ARGUMENT);
    // If the room is too small, it is filled, and count is the full number.
    pc_time first;
    uint32_t count = 1;
    ASSERT_EQ(pc_timings(guest.get(), &first, &count, nullptr), PC_OK);
    EXPECT_EQ(count, times.size());
    EXPECT_STREQ(first.name, "import.import");
}

TEST(Reports, PlanLogAndCapabilities) {
    const auto host = canonical_frame(kWidth, kHeight);
    std::vector<std::string> said;
    auto info = pc::create_info();
    info.user = &said;
    info.log = [](void* user, int level, const char* text) {
        static_cast<std::vector<std::string>*>(user)->push_back(std::to_string(level) + text);
    };
    const pc::Instance guest = pc::create(info);
    const auto made = chain("motion_blur,fxaa");
    EXPECT_EQ(pc::explain(guest.get()), "");
    prepare_and_run(guest, made, host.frame);
    const std::string json = pc::explain(guest.get());
    EXPECT_THAT(json, HasSubstr("\"0.motion_blur.block_surfaces\""));
    EXPECT_THAT(json, HasSubstr("\"steps\""));
    size_t little = 5;
    char text[5];
    EXPECT_EQ(pc_explain(guest.get(), text, &little), PC_ERROR_ARGUMENT);
    EXPECT_EQ(little, json.size() + 1);
    pc_frame bad = host.frame;
    bad.color.name = 0;
    for (int i = 0; i < 3; ++i) pc_run(guest.get(), made.get(), &bad, nullptr);
    ASSERT_EQ(said.size(), 1u) << "the same is said once";
    EXPECT_EQ(said[0], "0color: name 0; give the texture to filter");
    auto capabilities = pc::make<pc_capabilities>();
    ASSERT_EQ(pc_query(guest.get(), &capabilities), PC_OK);
    EXPECT_STREQ(capabilities.renderer, reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
    EXPECT_STREQ(capabilities.version, pc_version());
    EXPECT_EQ(capabilities.api_version, PC_API_VERSION);
    GLint side = 0, major = 0, minor = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
    EXPECT_EQ(capabilities.max_texture_px, uint32_t(side));
    EXPECT_EQ(capabilities.gl_version, uint32_t(10 * major + minor));
    EXPECT_EQ(capabilities.software, uint32_t(gl::describe_current().software));
}

TEST(Reports, PreparingInSlices) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa");
    int pending = 0;
    for (pc_result result = PC_PENDING; result == PC_PENDING; ++pending) {
        const uint64_t before = count(guest).programs;
        GlCalls::start();
        result = pc_prepare(guest.get(), made.get(), &host.frame, 0);
        auto calls = GlCalls::stop();
        ASSERT_GE(result, PC_OK) << pc_last_error(guest.get());
        EXPECT_LE(count(guest).programs - before + calls["glDispatchCompute"], 1u);
    }
    EXPECT_GT(pending, 10);
    run(guest, made, host.frame);
}

TEST(DebugView, DrawsATextureInsteadOfThePicture) {
    const auto host = canonical_frame(kWidth, kHeight);
    const auto guest = instance();
    const auto made = paper_chain("motion_blur,depth_of_field");
    pc_frame frame = host.frame;
    const auto view = [&](const char* name) {
        frame.debug_view = name;
        return read(prepare_and_run(guest, made, frame), kWidth, kHeight);
    };
    // A vector to the right is red (hue 0), its opposite cyan; each brighter the longer it is.
    const ImageF vectors = view("input.motion:vector");
    const ImageF& motion = host.test.planes.at(Role::motion);
    int right = 0, left = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const float* c = vectors.pixel(x, y);
            if (motion.at(x, y, 0) > 5) right += c[0] > c[1] && c[0] > c[2];
            if (motion.at(x, y, 0) < -2) left += c[0] < c[1] || c[0] < c[2];
        }
    EXPECT_GT(right, 100);
    EXPECT_GT(left, 1000);
    // The input itself.
    EXPECT_TRUE(equal_bits(view("input.color"), host.test.planes.at(Role::color)));
    // Blocks of a work list are bright, the others dark.
    const ImageF blocks = view("0.motion_blur.full_blocks");
    int bright = 0;
    for (size_t i = 0; i < blocks.pixels(); ++i) bright += blocks.data[4 * i] == 0.9f;
    EXPECT_GT(bright, 0);
    EXPECT_EQ(bright % 4, 0);
    frame.debug_view = "0.motion_blur.full_blocks:vector";
    EXPECT_EQ(pc_prepare(guest.get(), made.get(), &frame, 1), PC_ERROR_ARGUMENT);
    frame.debug_view = nullptr;
    run(guest, made, frame);
}

// A texture without a period inside the image, and the same one frame later, moved by 6, -3 px (y
// up).
TEST(Conventions, SignsAreChecked) {
    const auto texture = [](double x, double y, int c) {
        if (c == 3) return 1.0;
        return 0.5 + 0.25 * std::sin(0.31 * x + 0.17 * y + c) +
               0.2 * std::cos(0.05 * x * x / 20 - 0.23 * y + 2 * c);
    };
    const ImageF before = make_image(64, 48, 4, texture),
                 now = make_image(64, 48, 4,
                                  [&](int x, int y, int c) { return texture(x - 6, y + 3, c); }),
                 motion = constant_image(64, 48, {6.0f / 64, -3.0f / 48});
    const HostTexture color(GL_RGBA32F, now), previous(GL_RGBA32F, before);
    const HostTexture vectors(GL_RG32F, motion);
    auto frame = pc::make<pc_frame>();
    frame.color = color;
    frame.motion = vectors;
    ASSERT_EQ(pc_use_conventions("unity", &frame), PC_OK);  // fractions, y up, this minus previous
    const auto guest = instance();
    int signs[2] = {};
    float margin = 0;
    const auto check = [&](const pc_frame& one, const pc_texture& other) {
        return pc_check_motion(guest.get(), &one, &other, signs, &margin);
    };
    const auto expect_signs = [&](const pc_frame& one, const pc_texture& other, int x, int y) {
        ASSERT_EQ(check(one, other), PC_OK) << pc_error();
        EXPECT_EQ(signs[0], x);
        EXPECT_EQ(signs[1], y);
        EXPECT_GT(margin, 1.5f);
    };
    expect_signs(frame, previous, 1, 1);
    const float margin_of_all = margin;
    pc_frame wrong = frame;
    wrong.motion_scale[1] *= -1;
    expect_signs(wrong, previous, 1, -1);
    wrong.flags |= PC_MOTION_TO_NEXT;  // but the other image is the previous one
    expect_signs(wrong, previous, -1, 1);
    // The same rectangles in larger textures, read while the host packs pixels in its own way.
    const HostTexture now_inside = HostTexture::inside(GL_RGBA32F, now, 90, 70, 11, 13),
                      before_inside = HostTexture::inside(GL_RGBA32F, before, 80, 80, 5, 3),
                      motion_inside = HostTexture::inside(GL_RG32F, motion, 100, 60, 17, 9);
    pc_frame part = frame;
    part.width = 64;
    part.height = 48;
    part.color = now_inside;
    part.motion = motion_inside;
    glPixelStorei(GL_PACK_ROW_LENGTH, 200);
    glPixelStorei(GL_PACK_SKIP_PIXELS, 3);
    expect_signs(part, before_inside, 1, 1);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    glPixelStorei(GL_PACK_SKIP_PIXELS, 0);
    EXPECT_EQ(margin, margin_of_all);
    // A texture that cannot be read is an error, not a result.
    pc_texture unusable = previous;
    unusable.name = 12345;
    expect_error(check(frame, unusable), PC_ERROR_INPUT,
                 "other_color: texture 12345 is not one of this context");
    const HostTexture small(GL_RGBA32F, 32, 24);
    unusable.name = small.texture().name;
    expect_error(check(frame, unusable), PC_ERROR_INPUT, "is 32x24, not 64x48");
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    frame.motion.name = 0;
    expect_error(check(frame, previous), PC_ERROR_INPUT, "motion: name 0");
}

// Each engine stores the motion (4, 2) px to the right and down, this minus previous, in its own
// convention. A value stored by hand must give the motion back.
TEST(Conventions, OfEngines) {
    const struct {
        const char* name;
        float x, y;
        bool y_up_rows;
        pc_depth depth;
    } engines[] = {{"unity", 4.0f / 100, -2.0f / 50, true, PC_DEPTH_FORWARD},
                   {"unreal", 8.0f / 100 * 0.2495f + 32767.0f / 65535,
                    -4.0f / 50 * 0.2495f + 32767.0f / 65535, false, PC_DEPTH_REVERSE_INFINITE},
                   {"bevy", 4.0f / 100, 2.0f / 50, false, PC_DEPTH_REVERSE_INFINITE},
                   {"godot", -4.0f / 100, -2.0f / 50, false, PC_DEPTH_REVERSE},
                   {"falcor", -4.0f / 100, -2.0f / 50, false, PC_DEPTH_FORWARD},
                   {"g3d", 4, 2, false, PC_DEPTH_FORWARD}};
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/guest/expected");
    for (const auto& engine : engines) {
        auto frame = pc::make<pc_frame>();
        frame.width = 100;
        frame.height = 50;
        frame.flags =
            PC_CAMERA_CUT | PC_MOTION_JITTERED | (engine.y_up_rows ? PC_TOP_LEFT : PC_BOTTOM_LEFT);
        ASSERT_EQ(pc_use_conventions(engine.name, &frame), PC_OK);
        const float x = (engine.x - frame.motion_bias[0]) * frame.motion_scale[0];
        float y = (engine.y - frame.motion_bias[1]) * frame.motion_scale[1];
        EXPECT_EQ(frame.flags & (PC_TOP_LEFT | PC_BOTTOM_LEFT),
                  uint32_t(engine.y_up_rows ? PC_BOTTOM_LEFT : PC_TOP_LEFT))
            << engine.name;
        if (engine.y_up_rows) y = -y;
        EXPECT_NEAR(x, 4, 1e-3) << engine.name;
        EXPECT_NEAR(y, 2, 1e-3) << engine.name;
        EXPECT_EQ(frame.depth_encoding, engine.depth) << engine.name;
        EXPECT_TRUE(frame.flags & PC_CAMERA_CUT) << "what is no convention stays";
        EXPECT_FALSE(frame.flags & PC_MOTION_JITTERED);
        Transcript::say(concat(engine.name, ": flags ", frame.flags, ", depth ",
                               frame.depth_encoding, ", scale ", frame.motion_scale[0], " ",
                               frame.motion_scale[1], ", bias ", frame.motion_bias[0], " ",
                               frame.motion_bias[1]));
    }
}

}  // namespace
}  // namespace postchain::test::report_test

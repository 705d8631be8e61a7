// Every call of the header with handles that are none, from two threads, and with values that this
// library does not know: a status and a sentence, and nothing stays behind.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/transcript.h"

namespace postchain::test::handles_test {
namespace {

using ::testing::HasSubstr;

const char* const kExpected = POSTCHAIN_SOURCE_DIR "/tests/guest/expected";

class Handles : public SharedScene {};

using I = pc_instance*;
using C = pc_chain*;

struct Call {
    const char* name;
    std::function<pc_result(I, C)> make;
    bool takes_chain = true;
};

// Every call with an instance.
std::vector<Call> instance_calls(const pc_frame& frame) {
    static auto capabilities = pc::make<pc_capabilities>();
    static auto needs = pc::make<pc_frame_needs>();
    static const auto budget = pc::make<pc_budget>();
    static auto state = pc::make<pc_budget_state>();
    static auto counters = pc::make<pc_counters>();
    static uint32_t none = 0;
    static char text[1 << 18];
    static size_t size;
    size = sizeof(text);
    static int signs[2];
    static float margin = 0;
    return {
        {"pc_query", [](I i, C) { return pc_query(i, &capabilities); }, false},
        {"pc_set_timing", [](I i, C) { return pc_set_timing(i, 0); }, false},
        {"pc_timings", [](I i, C) { return pc_timings(i, nullptr, &none, nullptr); }, false},
        {"pc_count", [](I i, C) { return pc_count(i, &counters); }, false},
        {"pc_explain", [](I i, C) { return pc_explain(i, text, &size); }, false},
        {"pc_check_motion",
         [&](I i, C) { return pc_check_motion(i, &frame, &frame.color, signs, &margin); }, false},
        {"pc_prepare", [&](I i, C c) { return pc_prepare(i, c, &frame, 1); }},
        {"pc_run", [&](I i, C c) { return pc_run(i, c, &frame, nullptr); }},
        {"pc_query_frame", [&](I i, C c) { return pc_query_frame(i, c, &frame, &needs); }},
        {"pc_set_budget", [](I i, C c) { return pc_set_budget(i, c, &budget); }},
        {"pc_query_budget", [](I i, C c) { return pc_query_budget(i, c, &state); }}};
}

std::vector<Call> chain_calls() {
    static auto row = pc::make<pc_parameter>();
    static const std::vector<float> open(128 * 128, 1.0f);
    return {{"parameter", [](I, C c) { return pc_chain_parameter(c, 0, &row); }},
            {"set_number", [](I, C c) { return pc_chain_set_number(c, 0, "samples", 25); }},
            {"set_text", [](I, C c) { return pc_chain_set_text(c, 0, "mode", "inverse_warp"); }},
            {"set_point", [](I, C c) { return pc_chain_set_point(c, 1, "focus_at", 0.5, 0.5); }},
            {"set_aperture", [](I, C c) { return pc_chain_set_aperture(c, open.data()); }},
            {"set_mask", [](I, C c) { return pc_chain_set_mask(c, 0, PC_MASK_UNMOVED); }},
            {"unset", [](I, C c) { return pc_chain_unset(c, 0, "max_blur_px"); }}};
}

void refused(const Call& call, pc_instance* instance, pc_chain* chain) {
    EXPECT_EQ(call.make(instance, chain), PC_ERROR_ARGUMENT) << call.name;
    Transcript::say(concat(call.name, ": ", pc_error()));
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << call.name;
}

TEST_F(Handles, NullForeignAndDestroyedAreRefusedByEveryCall) {
    const Transcript whole(kExpected);
    const auto good = chain("motion_blur,depth_of_field");
    prepare_and_run(guest(), good, host().frame);
    auto gone_guest = instance();
    auto gone_chain = chain("fxaa");
    pc_instance* destroyed = gone_guest.get();
    pc_chain* destroyed_chain = gone_chain.get();
    gone_guest.reset();
    gone_chain.reset();
    long other = 0;
    const auto foreign = reinterpret_cast<pc_instance*>(&other);
    const auto foreign_chain = reinterpret_cast<pc_chain*>(&other);

    for (const Call& call : instance_calls(host().frame)) {
        EXPECT_EQ(call.make(guest().get(), good.get()),
                  PC_OK + (call.name == std::string("pc_timings")))
            << call.name << ": " << pc_error();
        EXPECT_STREQ(pc_error(), "");
        refused(call, nullptr, good.get());
        refused(call, foreign, good.get());
        refused(call, destroyed, good.get());
        refused(call, reinterpret_cast<pc_instance*>(good.get()), good.get());
        if (!call.takes_chain) continue;
        refused(call, guest().get(), nullptr);
        refused(call, guest().get(), foreign_chain);
        refused(call, guest().get(), destroyed_chain);
        EXPECT_STREQ(pc_last_error(guest().get()), pc_error());
    }
    for (const Call& call : chain_calls()) {
        EXPECT_EQ(call.make(nullptr, good.get()), PC_OK) << call.name << ": " << pc_error();
        refused(call, nullptr, nullptr);
        refused(call, nullptr, foreign_chain);
        refused(call, nullptr, destroyed_chain);
    }
    const std::pair<pc_instance*, pc_chain*> runs[] = {
        {nullptr, good.get()}, {destroyed, good.get()}, {guest().get(), nullptr}};
    for (const auto& [instance, chain] : runs) {
        pc_texture result = {};
        EXPECT_EQ(pc_run(instance, chain, &host().frame, &result), PC_ERROR_ARGUMENT);
        EXPECT_EQ(result.name, host().frame.color.name) << pc_error();
    }
    // Calls without a result.
    EXPECT_STREQ(pc_last_error(destroyed), "no such instance");
    EXPECT_STREQ(pc_chain_error(destroyed_chain), "no such chain");
    pc_destroy(nullptr);
    pc_destroy(foreign);
    pc_destroy(destroyed);
    pc_abandon(destroyed);
    pc_chain_destroy(foreign_chain);
    pc_chain_destroy(destroyed_chain);
    EXPECT_EQ(other, 0);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    prepare_and_run(guest(), chain("fxaa"), host().frame);
}

TEST_F(Handles, NullArguments) {
    const Transcript whole(kExpected);
    const auto guest = instance();
    const auto good = chain("motion_blur");
    I i = guest.get();
    C c = good.get();
    auto info = pc::create_info();
    auto frame = pc::make<pc_frame>();
    pc_instance* made = nullptr;
    expect_refused(pc_create(&info, nullptr));
    expect_refused(pc_create(nullptr, &made));
    expect_refused(pc_chain_create("fxaa", nullptr));
    expect_refused(pc_query(i, nullptr));
    expect_refused(pc_count(i, nullptr));
    expect_refused(pc_explain(i, nullptr, nullptr));
    expect_refused(pc_timings(i, nullptr, nullptr, nullptr));
    expect_refused(pc_prepare(i, c, nullptr, 1));
    expect_refused(pc_run(i, c, nullptr, nullptr));
    expect_refused(pc_chain_parameter(c, 0, nullptr));
    expect_refused(pc_chain_set_aperture(c, nullptr));
    const pc_texture other = {};
    int signs[2];
    float margin = 0;
    expect_refused(pc_check_motion(i, &frame, nullptr, signs, &margin));
    expect_refused(pc_check_motion(i, &frame, &other, nullptr, &margin));
    expect_refused(pc_check_motion(i, &frame, &other, signs, nullptr));
    expect_refused(pc_check_motion(i, nullptr, &other, signs, &margin));
    expect_refused(pc_use_conventions(nullptr, &frame));
    expect_refused(pc_use_conventions("unity", nullptr));
    expect_refused(pc_use_conventions("quake", &frame));
    expect_refused(pc_pass(4, nullptr, nullptr));
    expect_refused(pc_tier(5, nullptr, nullptr));
    EXPECT_EQ(pc_pass(0, nullptr, nullptr), PC_OK);
    EXPECT_EQ(pc_tier(0, nullptr, nullptr), PC_OK);
    EXPECT_STREQ(pc_error(), "");
}

// While one thread is in a call on an instance, every call of another is refused. Its chain can be
// changed: the frame keeps the values that it began with.
TEST_F(Handles, TwoThreadsOnOneObject) {
    static std::atomic<int> inside, leave;
    inside = leave = 0;
    auto info = pc::create_info();
    info.log = [](void*, int, const char*) {  // called within pc_run()
        inside = 1;
        while (!leave) std::this_thread::yield();
    };
    info.flags = PC_VALIDATE;
    make_host_context();
    const pc::Instance guest = pc::create(info);
    const auto good = chain("motion_blur,depth_of_field");
    std::thread other([&] {
        while (!inside) std::this_thread::yield();
        for (const Call& call : instance_calls(host().frame)) {
            EXPECT_EQ(call.make(guest.get(), good.get()), PC_ERROR_ARGUMENT) << call.name;
            EXPECT_THAT(pc_error(), HasSubstr("instance: another thread is in a call with it"));
        }
        for (const Call& call : chain_calls()) {
            EXPECT_EQ(call.make(nullptr, good.get()), PC_OK) << call.name << ": " << pc_error();
        }
        pc_destroy(guest.get());
        EXPECT_THAT(pc_error(), HasSubstr("instance: another thread is in a call with it"));
        pc_chain_destroy(good.get());
        EXPECT_THAT(pc_error(), HasSubstr("chain: a call with it is not finished; destroy it"));
        leave = 1;
    });
    glEnable(0xffff);  // an error that the host left is logged within pc_run()
    EXPECT_EQ(pc_run(guest.get(), good.get(), &host().frame, nullptr), PC_ERROR_PREPARE);
    other.join();
    prepare_and_run(guest, good, host().frame);
}

// A thread sets values while another renders: no call is refused, and each frame has the values of
// one moment.
TEST_F(Handles, ValuesAreSetWhileAnotherThreadRenders) {
    make_host_context();
    const auto guest = instance();
    const auto good = chain("motion_blur");
    pc_frame frame = host().frame;
    prepare_and_run(guest, good, frame);
    std::atomic<bool> done = false;
    std::thread setter([&] {
        for (int i = 0; !done; ++i)
            ASSERT_EQ(pc_chain_set_number(good.get(), 0, "shutter_angle_deg", 90 + i % 180), PC_OK)
                << pc_error();
    });
    gl_faults().silent_dispatches = true;
    for (int i = 0; i < 500; ++i)
        ASSERT_EQ(pc_run(guest.get(), good.get(), &frame, nullptr), PC_OK) << pc_error();
    gl_faults().silent_dispatches = false;
    done = true;
    setter.join();
    ASSERT_EQ(pc_chain_set_number(good.get(), 0, "shutter_angle_deg", 180), PC_OK);
    prepare_and_run(guest, good, frame);
}

// A handle that a callback destroys within a call on it stays as it is.
TEST_F(Handles, NoneIsDestroyedWithinItsCall) {
    static pc_instance* running = nullptr;
    static pc_chain* used = nullptr;
    static int calls = 0;
    auto info = pc::create_info();
    info.store_program = [](void*, const char*, const void*, size_t) {
        ++calls;
        pc_destroy(running);
        EXPECT_THAT(pc_error(), HasSubstr("instance: a call with it is not finished"));
        pc_chain_destroy(used);
        EXPECT_THAT(pc_error(), HasSubstr("chain: a call with it is not finished"));
        pc_abandon(running);
        EXPECT_THAT(pc_error(), HasSubstr("instance: a call with it is not finished"));
    };
    make_host_context();
    const pc::Instance guest = pc::create(info);
    const auto made = chain("motion_blur");
    running = guest.get();
    used = made.get();
    prepare_and_run(guest, made, host().frame);
    EXPECT_GT(calls, 0);
}

// A GL error is found when the frame is dispatched already.
TEST_F(Handles, ValidateGivesTheHostsColorAfterAnError) {
    auto info = pc::create_info();
    info.flags = PC_VALIDATE;
    info.log = [](void*, int level, const char*) {
        if (level == PC_LOG_WARNING) glEnable(0xffff);
    };
    make_host_context();
    const pc::Instance guest = pc::create(info);
    const auto made = chain("motion_blur");
    pc_frame frame = host().frame;
    const HostTexture output(GL_RGBA32F, kWidth, kHeight);
    frame.output = output;
    prepare_and_run(guest, made, frame);
    glEnable(0xffff);
    pc_texture result = {};
    EXPECT_EQ(pc_run(guest.get(), made.get(), &frame, &result), PC_ERROR_GL);
    EXPECT_EQ(result.name, frame.color.name) << pc_error();
}

// No sum or difference of a rectangle's members overflows.
TEST_F(Handles, RectanglesBeyondTheIntegers) {
    const auto made = chain("motion_blur");
    pc_frame frame = host().frame;
    frame.color.x = INT32_MIN;
    expect_error(pc_run(guest().get(), made.get(), &frame, nullptr), PC_ERROR_INPUT,
                 "color: a frame of 2147483647x60 at -2147483648, 0 is not");
    ASSERT_EQ(pc_use_conventions("godot", &frame), PC_OK);
    EXPECT_EQ(frame.motion_scale[0], -2147483744.0f);
    // Without a size, the frame is what the rectangle leaves.
    auto part = pc::make<pc_frame>();
    part.color.width = 96;
    part.color.height = 60;
    part.color.x = 7;
    part.color.y = 5;
    ASSERT_EQ(pc_use_conventions("godot", &part), PC_OK);
    EXPECT_EQ(std::abs(part.motion_scale[0]), 96 - 7);
    EXPECT_EQ(std::abs(part.motion_scale[1]), 60 - 5);
    part.width = 30;
    part.height = 20;
    ASSERT_EQ(pc_use_conventions("godot", &part), PC_OK);
    EXPECT_EQ(std::abs(part.motion_scale[0]), 30);
    EXPECT_EQ(std::abs(part.motion_scale[1]), 20);
    int signs[2];
    float margin = 0;
    const auto refused = [&](const std::function<void(pc_texture&)>& change) {
        pc_texture other = host().color;
        change(other);
        expect_error(pc_check_motion(guest().get(), &host().frame, &other, signs, &margin),
                     PC_ERROR_INPUT, "it does not cover the frame");
    };
    refused([](pc_texture& other) { other.name = 0; });
    for (const auto& [place, side] :
         {std::pair(&pc_texture::x, &pc_texture::width), {&pc_texture::y, &pc_texture::height}}) {
        for (const int32_t at : {INT32_MIN, -1, 1, INT32_MAX})
            refused([=, place = place](pc_texture& other) { other.*place = at; });
        for (const int32_t less : {INT32_MIN, 0, host().color.texture().*side - 1})
            refused([=, side = side](pc_texture& other) { other.*side = less; });
    }
    EXPECT_EQ(
        pc_check_motion(guest().get(), &host().frame, &host().color.texture(), signs, &margin),
        PC_OK);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
}

// PC_VALIDATE: what would give wrong pixels without a GL error.
TEST_F(Handles, ValidateRefusesMatricesAndOutputsThatCannotBe) {
    const auto guest = instance(PC_VALIDATE), plain = instance();
    const auto made = chain("motion_blur,fxaa");
    pc_frame frame = host().frame;
    for (int i = 0; i < 4; ++i) frame.view_projection[5 * i] = 1;
    std::copy_n(frame.view_projection, 16, frame.other_view_projection);
    frame.view_projection[11] = frame.other_view_projection[11] = -1;
    frame.view_projection[10] = frame.other_view_projection[10] = 0;
    prepare_and_run(guest, made, frame);
    pc_frame singular = frame;
    std::copy_n(singular.other_view_projection, 4, singular.other_view_projection + 4);
    expect_error(pc_run(guest.get(), made.get(), &singular, nullptr), PC_ERROR_INPUT,
                 "other_view_projection: is singular");
    prepare_and_run(plain, made, singular);
    const HostTexture motion(GL_RGBA32F, kWidth, kHeight);
    pc_frame over = frame;
    over.motion = over.output = motion;
    expect_error(pc_run(guest.get(), made.get(), &over, nullptr), PC_ERROR_INPUT,
                 "output: is the texture of motion, which it would overwrite");
}

// PC_STATE_LEAVE leaves the last step's program in use. It is not current when it is deleted.
TEST_F(Handles, NoDeletedProgramStaysInUse) {
    const auto made = chain("fxaa");
    prepare_and_run(instance(0, PC_STATE_LEAVE), made, host().frame);
    GLint program = -1;
    glGetIntegerv(GL_CURRENT_PROGRAM, &program);
    EXPECT_EQ(program, 0);
}

// A missing value is asked for in a host's words.
TEST_F(Handles, MessagesAreForHosts) {
    pc_frame frame = host().frame;
    frame.f_stop = 0;
    expect_error(pc_prepare(guest().get(), chain("depth_of_field").get(), &frame, 1),
                 PC_ERROR_CHAIN, "f_stop: not known");
    EXPECT_THAT(pc_error(), HasSubstr("in pc_frame"));
    EXPECT_THAT(pc_error(), ::testing::Not(HasSubstr("--camera")));
}

// The host's own textures as debug views: whole, or a rectangle of them, rows as stored.
TEST_F(Handles, ViewsOfTheHostsTextures) {
    const auto made = chain("motion_blur");
    const HostTexture color = HostTexture::inside(GL_RGBA32F, plane(Role::color), 120, 80, 9, 7);
    pc_frame frame = host().frame;
    frame.width = kWidth;
    frame.height = kHeight;
    frame.color = color;
    frame.debug_view = "host.color";
    EXPECT_TRUE(equal_bits(filtered(made, frame), plane(Role::color)));
    frame.debug_view = "host.motion";
    const ImageF vectors = filtered(made, frame);
    frame.debug_view = "input.motion";
    EXPECT_TRUE(equal_bits(filtered(made, frame), vectors));
    frame.debug_view = "0.motion_blur.moving_blocks";  // the header's example
    prepare_and_run(guest(), made, frame);
    for (const char* none :
         {"host.nothing", "host.mask", "host.color:nothing", "0.motion_blur.moving_blocks:color"}) {
        frame.debug_view = none;
        EXPECT_EQ(pc_prepare(guest().get(), made.get(), &frame, 1), PC_ERROR_ARGUMENT) << none;
    }
    // As what it is, or as something else.
    const auto shown = [&](const char* view) {
        frame.debug_view = view;
        return filtered(made, frame);
    };
    const std::tuple<const char*, const char*, bool> views[] = {
        {"host.color", "host.color:color", true},
        {"host.color", "host.color:number", false},
        {"host.color:number", "host.color:vector", false},
        {"input.inverse_depth", "input.inverse_depth:number", true},
        {"input.inverse_depth", "input.inverse_depth:color", false},
        {"host.motion", "host.motion:vector", true},
        {"host.motion", "host.motion:number", false}};
    for (const auto& [one, other, equal] : views)
        EXPECT_EQ(equal_bits(shown(one), shown(other)), equal) << other;
}

TEST(Results, HaveTheNamesOfTheHeader) {
    const std::pair<pc_result, const char*> names[] = {{PC_OK, "PC_OK"},
                                                       {PC_PENDING, "PC_PENDING"},
                                                       {PC_ERROR_ARGUMENT, "PC_ERROR_ARGUMENT"},
                                                       {PC_ERROR_CHAIN, "PC_ERROR_CHAIN"},
                                                       {PC_ERROR_INPUT, "PC_ERROR_INPUT"},
                                                       {PC_ERROR_CONTEXT, "PC_ERROR_CONTEXT"},
                                                       {PC_ERROR_MEMORY, "PC_ERROR_MEMORY"},
                                                       {PC_ERROR_VERSION, "PC_ERROR_VERSION"},
                                                       {PC_ERROR_PREPARE, "PC_ERROR_PREPARE"},
                                                       {PC_ERROR_GL, "PC_ERROR_GL"},
                                                       {PC_ERROR_INTERNAL, "PC_ERROR_INTERNAL"}};
    for (const auto& [result, name] : names) EXPECT_STREQ(pc_result_name(result), name);
    EXPECT_STREQ(pc_result_name(pc_result(15)), "unknown");
}

}  // namespace
}  // namespace postchain::test::handles_test

// Tiers, and budgets of time.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <thread>

#include "chain/guest/budgets.h"
#include "tests/guest/host.h"

namespace postchain::test::budget_test {
namespace {

using guest::SampleController;
using ::testing::HasSubstr;

// From one part to another at a time of its frames: down only if the budget is exceeded, to the
// first part that fits; up by one if a tenth of the budget is left then.
TEST(SampleController, ChangesAtItsLimits) {
    const struct {
        double before, milliseconds, after;
    } cases[] = {{1, 10, 1},          {1, 10.1, 0.75},    {1, 13.4, 0.5},    {1, 99, 0.25},
                 {0.75, 6.7, 1},      {0.75, 6.8, 0.75},  {0.75, 10, 0.75},  {0.75, 10.1, 0.5},
                 {0.375, 13.4, 0.25}, {0.25, 5.9, 0.375}, {0.25, 6.1, 0.25}, {0.25, 0.1, 0.375}};
    for (const auto& [before, milliseconds, after] : cases) {
        SampleController controller(10, 0.25);
        const auto run = [&](double time, double now) {
            for (int i = 0; i < 4; ++i) controller.add(time);
            controller.change(now);
        };
        run(9.99 / before, 0);
        ASSERT_EQ(controller.part(), before);
        run(milliseconds, 1);
        EXPECT_EQ(controller.part(), after) << milliseconds << " ms with " << before;
    }
}

TEST(SampleController, WaitsBetweenChanges) {
    SampleController controller(10, 0.25);
    const auto changes = [&](double now) {
        for (int i = 0; i < 4; ++i) controller.add(11);
        return controller.change(now);
    };
    EXPECT_TRUE(changes(0));
    EXPECT_FALSE(changes(0.49));
    EXPECT_TRUE(changes(0.5));
    for (int i = 0; i < 3; ++i) controller.add(11);
    EXPECT_FALSE(controller.change(9)) << "three frames are too few";
}

// One slow frame, as when a window is moved, changes nothing.
TEST(SampleController, OneSlowFrameDoesNotCount) {
    SampleController controller(10, 0.25);
    for (int i = 0; i < 20; ++i) {
        controller.add(i % 7 == 3 ? 80 : 8);
        EXPECT_FALSE(controller.change(i));
    }
    EXPECT_EQ(controller.milliseconds(), 8);
}

pc_budget_state state_of(const pc::Instance& guest, const pc::Chain& chain) {
    auto state = pc::make<pc_budget_state>();
    EXPECT_EQ(pc_query_budget(guest.get(), chain.get(), &state), PC_OK) << pc_error();
    return state;
}

// Runs frames until a state is reached.
void run_until(const std::function<bool()>& reached, const std::function<void()>& run) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (!reached() && std::chrono::steady_clock::now() < end) run();
    EXPECT_TRUE(reached());
}
void run_until(const pc::Instance& guest, const pc::Chain& made, const pc_frame& frame,
               float part) {
    run_until([&] { return state_of(guest, made).part == part; }, [&] { run(guest, made, frame); });
}

pc_budget budget_of(float milliseconds, float least = 0) {
    auto budget = pc::make<pc_budget>();
    budget.milliseconds = milliseconds;
    budget.least = least;
    return budget;
}

void set_budget(const pc::Instance& guest, const pc::Chain& made, const pc_budget& budget) {
    EXPECT_EQ(pc_set_budget(guest.get(), made.get(), &budget), PC_OK) << pc_error();
}

// No frame keeps it, on any machine.
constexpr float kTooLittle = 1e-4f;

ImageF filtered(const pc::Instance& guest, const pc::Chain& made, const pc_frame& frame) {
    return read(run(guest, made, frame), 40, 24);
}

ImageF with_samples(double count, const pc_frame& frame) {
    const auto guest = instance();
    const auto plain = chain("joint_blur,fxaa");
    set(plain, 0, "samples", count);
    return read(prepare_and_run(guest, plain, frame), 40, 24);
}

// A budget that no frame keeps, and one that all do: no time of this machine decides.
TEST(TimeBudget, FiltersWithAPartOfTheSamples) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    const auto made = chain("joint_blur,fxaa");
    set(made, 0, "samples", 32);
    prepare(guest, made, host.frame);
    set_budget(guest, made, budget_of(kTooLittle));
    run_until(guest, made, host.frame, 0.25f);
    EXPECT_EQ(state_of(guest, made).changes, 1u);
    EXPECT_TRUE(equal_bits(filtered(guest, made, host.frame), with_samples(8, host.frame)));
    const auto without = instance();  // the chain's values stay the host's
    prepare(without, made, host.frame);
    EXPECT_TRUE(equal_bits(filtered(without, made, host.frame), with_samples(32, host.frame)));
    for (int i = 0; i < 3; ++i) pc_run(guest.get(), made.get(), &host.frame, nullptr);
    EXPECT_EQ(state_of(guest, made).milliseconds, kTooLittle);
    EXPECT_GT(state_of(guest, made).frame_ms, 10 * kTooLittle);

    set_budget(guest, made, budget_of(1e6f));
    EXPECT_EQ(state_of(guest, made).part, 1) << "a new budget begins with the host's samples";
    set_budget(guest, made, budget_of(kTooLittle, 0.5f));
    run_until(guest, made, host.frame, 0.5f);
    set(made, 0, "samples", 64);  // counts at once
    EXPECT_TRUE(equal_bits(filtered(guest, made, host.frame), with_samples(32, host.frame)));
    set_budget(guest, made, budget_of(0));
    EXPECT_EQ(state_of(guest, made).milliseconds, 0);
    EXPECT_EQ(state_of(guest, made).part, 1);
    EXPECT_TRUE(equal_bits(filtered(guest, made, host.frame), with_samples(64, host.frame)));
}

struct Masked {
    HostFrameTextures host = canonical_frame(40, 24);
    HostTexture mask{GL_R8, ImageF(40, 24, 1, 0.5f)};
    pc_frame frame = host.frame;
    Masked() { frame.mask = mask; }
};

// With a mask other samples are other programs: compiled if the chain is prepared with its budget,
// and otherwise the samples stay.
TEST(TimeBudget, WithAMask) {
    const Masked masked;
    std::string said;
    auto info = pc::create_info();
    info.user = &said;
    info.log = [](void* user, int, const char* text) {
        static_cast<std::string*>(user)->append(text);
    };
    for (const bool first : {true, false}) {
        const pc::Instance guest = pc::create(info);
        const auto made = chain("joint_blur");
        set(made, 0, "samples", 32);
        if (first) set_budget(guest, made, budget_of(kTooLittle));
        prepare(guest, made, masked.frame);
        if (first) {
            run_until(guest, made, masked.frame, 0.25f);
            EXPECT_EQ(said, "");
            continue;
        }
        set_budget(guest, made, budget_of(kTooLittle));
        run_until([&] { return said.starts_with("the budget is not kept"); },
                  [&] { run(guest, made, masked.frame); });
        EXPECT_EQ(state_of(guest, made).part, 1);
    }
}

// Its programs are among those that are announced.
TEST(TimeBudget, NeedsThePrograms) {
    const Masked masked;
    const auto guest = instance();
    const auto made = chain("joint_blur");
    const auto needs = [&] {
        auto found = pc::make<pc_frame_needs>();
        EXPECT_EQ(pc_query_frame(guest.get(), made.get(), &masked.frame, &found), PC_OK);
        return found;
    };
    const uint32_t without = needs().programs;
    set_budget(guest, made, budget_of(1));
    EXPECT_GT(needs().programs, without);
    prepare(guest, made, masked.frame);
    EXPECT_EQ(count(guest).programs, needs().programs);
    EXPECT_EQ(needs().programs_to_compile, 0u);
}

// Chains in turn on one instance, more than the clock remembers frames: each gets its own times.
TEST(TimeBudget, OfManyChains) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance();
    std::vector<pc::Chain> chains;
    for (int i = 0; i < 9; ++i) chains.push_back(chain(i % 2 ? "motion_blur" : "joint_blur"));
    for (const auto& made : chains) {
        prepare(guest, made, host.frame);
        set_budget(guest, made, budget_of(kTooLittle));
    }
    const auto reduced = [&](const pc::Chain& made) { return state_of(guest, made).part < 1; };
    run_until([&] { return std::all_of(chains.begin(), chains.end(), reduced); },
              [&] {
                  for (const auto& made : chains) run(guest, made, host.frame);
              });
}

// The timestamps of a device that takes as long as the test says.
class Timestamps {
  public:
    Timestamps() {
        epoxy_glQueryCounter = [](GLuint name, GLenum) { taken_[name] = now_; };
        epoxy_glGetQueryObjectiv = [](GLuint, GLenum, GLint* value) { *value = GL_TRUE; };
        epoxy_glGetQueryObjectui64v = [](GLuint name, GLenum, GLuint64* value) {
            *value = taken_.at(name);
        };
    }
    ~Timestamps() {
        epoxy_glQueryCounter = counter_;
        epoxy_glGetQueryObjectiv = available_;
        epoxy_glGetQueryObjectui64v = result_;
    }
    static void pass(std::chrono::nanoseconds time) { now_ += GLuint64(time.count()); }

  private:
    static inline GLuint64 now_ = 0;  // ns
    static inline std::map<GLuint, GLuint64> taken_;
    const decltype(epoxy_glQueryCounter) counter_ = epoxy_glQueryCounter;
    const decltype(epoxy_glGetQueryObjectiv) available_ = epoxy_glGetQueryObjectiv;
    const decltype(epoxy_glGetQueryObjectui64v) result_ = epoxy_glGetQueryObjectui64v;
};

// The chain's revision stays: only its part changes, and returns.
TEST(TimeBudget, EachPartHasItsSamples) {
    make_host_context();
    const Timestamps timestamps;
    guest::Budgets budgets;
    guest::ChainHandle made(std::move(*guest::ChainHandle::parse("joint_blur")));
    ASSERT_TRUE(made.set_number(0, "samples", 32).ok());
    ASSERT_TRUE(budgets.set(made.version(), budget_of(10)).ok());
    gl::Clock clock{gl::Device{}};
    uint64_t tag = 0;
    const auto samples = [&] {
        const auto chain = budgets.version(made.version()).chain;
        const auto [pass, row] = guest::samples_of(*chain).at(0);
        return std::get<int64_t>(row->get(chain->links[pass].pass->parameters()));
    };
    const auto after_frames_of_13_ms = [&] {
        auto state = pc::make<pc_budget_state>();
        budgets.query(made.version(), state);
        const uint32_t changes = state.changes;
        run_until([&] { return budgets.query(made.version(), state), state.changes > changes; },
                  [&] {
                      EXPECT_TRUE(budgets.govern(made.version(), clock, ++tag));
                      clock.begin(tag, tag);
                      Timestamps::pass(std::chrono::milliseconds(13));
                      clock.mark(0, "blur");
                      std::this_thread::sleep_for(std::chrono::milliseconds(5));
                  });
        return samples();
    };
    EXPECT_EQ(samples(), 32);
    EXPECT_EQ(after_frames_of_13_ms(), 24);
    EXPECT_EQ(after_frames_of_13_ms(), 16);
    EXPECT_EQ(after_frames_of_13_ms(), 12);
    EXPECT_TRUE(budgets.undo(made.version()));
    EXPECT_EQ(samples(), 16);
    EXPECT_FALSE(budgets.undo(made.version())) << "once";
}

TEST(TimeBudget, BadValues) {
    const auto guest = instance();
    const auto fails = [&](const pc::Chain& chain, const pc_budget& budget, pc_result code,
                           const char* text) {
        expect_error(pc_set_budget(guest.get(), chain.get(), &budget), code, text);
        EXPECT_EQ(state_of(guest, chain).milliseconds, 0);
    };
    const auto made = chain("joint_blur"), dof = chain("depth_of_field");
    for (const float time : {-1.0f, NAN, INFINITY})
        fails(made, budget_of(time), PC_ERROR_ARGUMENT, "milliseconds: ");
    for (const float least : {0.249f, 1.01f, -1.0f, NAN})
        fails(made, budget_of(2, least), PC_ERROR_ARGUMENT, "is not within 0.25 and 1");
    auto reserved = budget_of(2);
    reserved.reserved = 1;
    fails(made, reserved, PC_ERROR_VERSION, "pc_budget.reserved is not 0");
    fails(chain("fxaa"), budget_of(2), PC_ERROR_CHAIN, "no pass of the chain reads a number");
    // The method decides whether the pass reads its samples.
    ASSERT_EQ(pc_chain_set_text(dof.get(), 0, "method", "gilham"), PC_OK);
    fails(dof, budget_of(2), PC_ERROR_CHAIN, "choose a method that has samples");
    ASSERT_EQ(pc_chain_set_text(dof.get(), 0, "method", "inverse_warp"), PC_OK);
    set_budget(guest, dof, budget_of(2));
}

TEST(TimeBudget, OfADestroyedChainIsForgotten) {
    guest::Budgets budgets;
    auto budget = pc::make<pc_budget>();
    budget.milliseconds = 2;
    guest::ChainHandle kept(std::move(*guest::ChainHandle::parse("joint_blur")));
    for (int i = 0; i < 20; ++i) {
        guest::ChainHandle passing(std::move(*guest::ChainHandle::parse("motion_blur")));
        ASSERT_TRUE(budgets.set(passing.version(), budget).ok());
        EXPECT_LE(budgets.size(), 2u);
        ASSERT_TRUE(budgets.set(kept.version(), budget).ok());
        EXPECT_EQ(budgets.size(), 2u);
    }
    ASSERT_TRUE(budgets.set(kept.version(), budget).ok());
    EXPECT_EQ(budgets.size(), 1u);
}

TEST(Tiers, AreListed) {
    const char *name = nullptr, *help = nullptr;
    uint32_t count = 0;
    while (pc_tier(count, &name, &help) == PC_OK) {
        EXPECT_TRUE(pc::chain((std::string("tier:") + name).c_str())) << pc_error();
        EXPECT_STRNE(help, "");
        ++count;
    }
    EXPECT_EQ(count, 5u);
    EXPECT_THAT(pc_error(), HasSubstr("there are 5 tiers"));
    pc_chain* none = nullptr;
    EXPECT_EQ(pc_chain_create("tier:cinema", &none), PC_ERROR_CHAIN);
    EXPECT_THAT(pc_error(), HasSubstr("unknown tier \"cinema\"; known are paper, realtime, fast"));
}

double squared_error(const ImageF& found, const ImageF& expected) {
    double sum = 0;
    for (int y = 0; y < found.height; ++y)
        for (int x = 0; x < found.width; ++x)
            for (int c = 0; c < 3; ++c)
                sum += std::pow(found.at(x, y, c) - expected.at(x, y, c), 2);
    return sum;
}

// A TAA behind the tier averages frames exponentially: of a still frame whose objects go on moving,
// what is left of the noise is less than half.
TEST(Tiers, NoiseOfRealtimeResolves) {
    make_host_context();
    constexpr int kWidth = 96, kHeight = 60;
    auto host = canonical_frame(kWidth, kHeight);
    const auto guest = instance(0, PC_STATE_LEAVE);
    const auto tier = chain("tier:realtime"), many = chain("joint_blur");
    ASSERT_EQ(pc_chain_set_text(many.get(), 0, "neighbors", "none"), PC_OK);
    set(many, 0, "samples", 1000);
    const ImageF expected = read(prepare_and_run(guest, many, host.frame), kWidth, kHeight);
    prepare(guest, tier, host.frame);
    double of_one = 0;
    ImageF mean;
    constexpr int kFrames = 24;
    for (int i = 0; i < kFrames; ++i) {
        host.frame.frame_number = uint64_t(i);
        const ImageF one = read(run(guest, tier, host.frame), kWidth, kHeight);
        of_one += squared_error(one, expected) / kFrames;
        if (i == 0) mean = one;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                for (int c = 0; c < 3; ++c)
                    mean.at(x, y, c) += 0.1f * (one.at(x, y, c) - mean.at(x, y, c));
    }
    EXPECT_LT(squared_error(mean, expected), 0.5 * of_one);
}

}  // namespace
}  // namespace postchain::test::budget_test

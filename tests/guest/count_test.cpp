// The cost of a frame in the steady state: GL calls by kind, objects, and allocations. Every
// pc_run() is counted separately.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <set>
#include <vector>

#include "chain/gl/device.h"
#include "tests/guest/allocations.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"
#include "tests/support/transcript.h"

namespace postchain::test::count_test {
namespace {

constexpr const char* kPasses = "motion_blur,fxaa,depth_of_field";
constexpr int kFrames = 60;

// What one pc_run() did, without the calls of the fence that every fourth frame makes, waits for
// and deletes.
struct Cost {
    uint64_t allocations = 0, fences = 0, all_calls = 0;
    std::map<std::string, uint64_t> calls;
    uint32_t last_barrier = 0;

    // Calls that make, wait or read.
    std::string slow_calls() const {
        std::string slow;
        for (const auto& [name, number] : calls)
            for (const char* part : {"glGet", "glIs", "glCreate", "glDelete", "glFinish",
                                     "glCompile", "glLink", "Storage", "Debug", "Label"})
                if (name.find(part) != std::string::npos) slow += name + " ";
        return slow;
    }
};

Cost run(const pc::Instance& guest, const pc::Chain& made, const pc_frame& frame) {
    Cost cost;
    GlCalls::start();
    const uint64_t before = allocations();
    const pc_result result = pc_run(guest.get(), made.get(), &frame, nullptr);
    cost.allocations = allocations() - before;
    cost.calls = GlCalls::stop();
    cost.last_barrier = GlCalls::last_barrier();
    EXPECT_EQ(result, PC_OK) << pc_last_error(guest.get());
    for (const char* name : {"glFenceSync", "glClientWaitSync", "glDeleteSync"}) {
        cost.fences += cost.calls[name];
        cost.calls.erase(name);
    }
    for (const auto& [name, number] : cost.calls) cost.all_calls += number;
    return cost;
}

// Frames of each kind that a game draws in turn: plain, jittered, converted from its own
// conventions. Lens, shutter, bounds and noise change in every frame: values are written in place.
TEST(Count, TheSteadyStatePlansMakesAllocatesAndReadsNothing) {
    const auto host = canonical_frame(64, 48);
    const HostTexture output(GL_RGBA8, 64, 48);
    const auto papers = paper_chain(), plain = chain(kPasses), joint = chain("joint_blur,fxaa");
    ASSERT_EQ(pc_chain_set_text(papers.get(), 0, "noise", "halton"), PC_OK);
    for (const auto* made : {&papers, &plain, &joint}) {
        set(*made, 0, "animate_noise", 1);
        const auto guest = instance(0, PC_STATE_RESET);
        pc_frame kinds[] = {host.frame, host.frame, host.frame};
        kinds[1].flags |= PC_MOTION_JITTERED;
        kinds[2].flags = 0;
        kinds[2].output = output;
        kinds[2].pre_exposure = 1.5f;
        if (made == &joint) kinds[2].before = kinds[2].after = &host.frame;
        for (pc_frame& frame : kinds) {
            frame.max_speed_px = 100;
            for (int again = 0; again < 4; ++again) prepare_and_run(guest, *made, frame);
        }
        pc_counters before = {};
        uint64_t calls_per_frame[3] = {}, fences = 0;
        gl_faults().silent_dispatches = true;
        for (int i = 0; i < kFrames; ++i) {
            if (i == 6) before = count(guest);  // the first plans of each kind are made
            pc_frame& frame = kinds[i % 3];
            frame.frame_number = uint64_t(i);
            frame.jitter_px[0] = float(i % 8) / 8;
            frame.focus_distance *= 1 + 0.001f * float(i % 5);
            frame.f_stop *= 1 + 0.001f * float(i % 7);
            frame.shutter_frames = 0.4f + 0.01f * float(i % 5);
            frame.max_speed_px = 100 + float(i);
            if (i % 3 == 2) frame.pre_exposure = 2 + float(i % 5);
            if (i % 3 > 0) frame.motion_scale[0] = 2 + float(i % 3);
            const Cost cost = run(guest, *made, frame);
            fences += cost.fences;
            if (i < 6) continue;
            ASSERT_EQ(cost.allocations, 0u) << "frame " << i;
            ASSERT_EQ(cost.slow_calls(), "") << "frame " << i;
            uint64_t& per_frame = calls_per_frame[i % 3];
            if (per_frame == 0) per_frame = cost.all_calls;
            ASSERT_EQ(cost.all_calls, per_frame) << "frame " << i;
        }
        gl_faults().silent_dispatches = false;
        // Each is made, asked for and deleted. A GPU may be behind, and is asked in each frame.
        const bool software = gl::describe_current().software;
        EXPECT_LE(fences, software ? 3u * (kFrames / 4 + 1) : 2u * (kFrames / 4 + 1) + kFrames);
        expect_nothing_made(before, count(guest));
    }
}

// Every member: before the first frame, after two frames, a larger and a smaller one, another
// chain, and a program of the cache.
TEST(Count, EveryMember) {
    const auto host = canonical_frame(64, 48), large = canonical_frame(101, 67);
    std::map<std::string, std::string> cache;
    auto info = pc::create_info();
    info.user = &cache;
    info.keep_frames = 2;
    info.store_program = [](void* user, const char* key, const void* bytes, size_t size) {
        (*static_cast<std::map<std::string, std::string>*>(user))[key] = {
            static_cast<const char*>(bytes), size};
    };
    info.load_program = [](void* user, const char* key, void* bytes, size_t room) {
        const std::string& found = (*static_cast<std::map<std::string, std::string>*>(user))[key];
        if (found.size() <= room) std::copy(found.begin(), found.end(), static_cast<char*>(bytes));
        return found.size();
    };
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/guest/expected");
    const auto made = paper_chain("motion_blur,depth_of_field"), other = chain("fxaa");
    for (int again = 0; again < 2; ++again) {
        const pc::Instance guest = pc::create(info);
        auto needs = pc::make<pc_frame_needs>();
        const auto told = [&](const pc::Chain& chain, const pc_frame& frame) {
            ASSERT_EQ(pc_query_frame(guest.get(), chain.get(), &frame, &needs), PC_OK);
            say(needs);
            say(count(guest));
        };
        told(made, host.frame);
        prepare(guest, made, host.frame);
        told(made, host.frame);
        for (const pc_frame* frame : {&host.frame, &host.frame, &large.frame, &host.frame}) {
            test::run(guest, made, *frame);
            told(made, *frame);
        }
        prepare(guest, other, host.frame);
        for (int i = 0; i < 3; ++i) test::run(guest, other, host.frame);
        told(other, host.frame);
    }
}

// Before each of the chain's ten levels but the first, and after the last one
// (chain/plan/hazards.h).
TEST(Count, BarriersOfTheChainAndOfTheHost) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance();
    const auto made = paper_chain("motion_blur,depth_of_field,fxaa");
    prepare_and_run(guest, made, host.frame);
    pc_frame frame = host.frame;
    const uint64_t before = count(guest).barriers;
    const Cost plain = run(guest, made, frame);
    EXPECT_EQ(count(guest).barriers - before, 10u);
    EXPECT_EQ(plain.calls.at("glMemoryBarrier"), 10u);
    EXPECT_TRUE(plain.last_barrier & GL_TEXTURE_FETCH_BARRIER_BIT);
    frame.barriers = GL_PIXEL_BUFFER_BARRIER_BIT;
    const Cost asked = run(guest, made, frame);
    EXPECT_EQ(asked.last_barrier, plain.last_barrier | GL_PIXEL_BUFFER_BARRIER_BIT);
    EXPECT_NE(asked.last_barrier, plain.last_barrier);
}

// Restoring reads state first: a fixed number of glGet calls in each frame, and no allocation.
TEST(Count, RestoringReadsTheSameEveryFrame) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance();
    const auto made = chain(kPasses);
    for (int again = 0; again < 2; ++again) prepare_and_run(guest, made, host.frame);
    const Cost first = run(guest, made, host.frame);
    EXPECT_GT(first.all_calls, 100u);
    for (const char* name : {"glGetError", "glFinish", "glIsTexture"})
        EXPECT_EQ(first.calls.count(name), 0u) << name;
    for (int i = 0; i < 10; ++i) {
        const Cost cost = run(guest, made, host.frame);
        EXPECT_EQ(cost.allocations, 0u);
        EXPECT_EQ(cost.calls, first.calls);
    }
}

// A closed shutter and a cut skip passes. Their plans have other shapes and are kept together.
TEST(Count, ShapesThatAreKnownPlanAndAllocateNothing) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance(0, PC_STATE_RESET);
    const auto made = chain(kPasses);
    prepare(guest, made, host.frame);
    const uint64_t textures = count(guest).texture_allocations;
    pc_frame cut = host.frame;
    cut.flags |= PC_CAMERA_CUT;
    run(guest, made, cut);
    EXPECT_EQ(count(guest).texture_allocations, textures) << "pc_prepare() makes those of a cut";
    uint64_t plans = 0;
    for (int i = 0; i < 20; ++i) {
        pc_frame frame = host.frame;
        frame.focus_distance *= 1 + 0.001f * float(i);
        if (i % 4 == 1) frame.shutter_frames = -1;
        if (i % 4 == 2) frame.flags |= PC_CAMERA_CUT;
        if (i % 4 == 3) frame.f_stop = 1e6f;
        const Cost cost = run(guest, made, frame);
        if (i == 7) plans = count(guest).plans_made;
        if (i > 7) {
            ASSERT_EQ(cost.allocations, 0u) << "frame " << i;
        }
    }
    EXPECT_EQ(count(guest).plans_made, plans);
}

// Chains of the same passes that run in turn, as those of several views, have a plan each.
TEST(Count, ChainsOfOneShapeKeepTheirPlans) {
    const auto host = canonical_frame(64, 48);
    const auto guest = instance(0, PC_STATE_RESET);
    constexpr size_t kChains = 12;
    std::vector<pc::Chain> chains;
    for (size_t i = 0; i < kChains; ++i) {
        chains.push_back(chain("motion_blur,fxaa"));
        set(chains[i], PC_CAMERA, "shutter_frames", 0.3 + 0.05 * double(i));
        prepare_and_run(guest, chains[i], host.frame);
    }
    const pc_counters before = count(guest);
    for (size_t i = 0; i < 2 * kChains; ++i)
        EXPECT_EQ(run(guest, chains[i % kChains], host.frame).allocations, 0u) << "frame " << i;
    expect_nothing_made(before, count(guest));
}

// A window that is dragged through 30 sizes and back.
TEST(Count, ResizingDoesNotGrow) {
    const auto guest = instance();
    const auto made = chain("motion_blur,fxaa");
    const auto prepared = canonical_frame(64, 48);
    prepare_and_run(guest, made, prepared.frame);
    const uint64_t programs = count(guest).programs;
    uint64_t most = 0, most_bytes = 0;
    for (int i = 0; i < 30; ++i) {
        const auto host = canonical_frame(64 + 3 * i, 48 + i);
        run(guest, made, host.frame);
        if (i == 15) {
            most = count(guest).textures_alive;
            most_bytes = count(guest).texture_bytes;
        }
        if (i > 15) {
            ASSERT_LE(count(guest).textures_alive, most * 5 / 4) << "size " << i;
            ASSERT_LE(count(guest).texture_bytes, 3 * most_bytes) << "size " << i;
        }
    }
    EXPECT_EQ(count(guest).programs, programs);
    for (int i = 0; i < 20; ++i) run(guest, made, prepared.frame);
    const auto fresh = instance();
    prepare_and_run(fresh, made, prepared.frame);
    EXPECT_EQ(count(guest).textures_alive, count(fresh).textures_alive);
    EXPECT_EQ(count(guest).texture_bytes, count(fresh).texture_bytes);
}

// Every GL function that chain/gl and chain/guest name is among those that are counted.
TEST(Count, EveryFunctionIsCounted) {
    const auto list = GlCalls::names();
    const std::set<std::string> counted(list.begin(), list.end());
    const auto in_name = [](char c) { return std::isalnum(uint8_t(c)) || c == '_'; };
    size_t found = 0;
    for (const char* folder : {"chain/gl", "chain/guest"})
        for (const auto& entry :
             std::filesystem::directory_iterator(std::string(POSTCHAIN_SOURCE_DIR "/") + folder)) {
            std::ifstream in(entry.path());
            for (std::string line; std::getline(in, line);) {
                line = line.substr(0, line.find("//"));
                for (auto at = line.begin(), end = at; at != line.end(); at = end) {
                    at = std::find_if(at, line.end(), in_name);
                    end = std::find_if_not(at, line.end(), in_name);
                    const std::string name(at, end);
                    if (!name.starts_with("gl") || name.size() < 3 || !std::isupper(name[2]) ||
                        end == line.end() || *end != '(')
                        continue;
                    ++found;
                    EXPECT_TRUE(counted.contains(name)) << entry.path() << ": " << name;
                }
            }
        }
    EXPECT_GT(found, 60u);
}

}  // namespace
}  // namespace postchain::test::count_test

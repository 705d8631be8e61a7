// Plans as data (postchain_plan.h), without a device: every array against an independent walk of
// the steps, and the cost of a frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <postchain/postchain.hpp>
#include <set>
#include <thread>

#include "chain/guest/handles.h"
#include "chain/guest/postchain_plan.h"
#include "chain/plan/program_source.h"
#include "tests/guest/allocations.h"
#include "tests/support/transcript.h"

namespace postchain::test::planner_test {
namespace {

using ::testing::HasSubstr;

const std::string kExpected = POSTCHAIN_SOURCE_DIR "/tests/guest/expected";
constexpr uint32_t kMaxWidth = 200, kMaxHeight = 120;
constexpr uint32_t kWrites = PC_PLAN_IMAGE_WRITE | PC_PLAN_LIST_WRITE | PC_PLAN_ZEROED;
enum : uint32_t { kColor = 1, kDepth, kMotion, kMask, kExposure, kOutput };

struct Destroy {
    void operator()(pc_planner* planner) const { pc_plan_destroy(planner); }
};
using Planner = std::unique_ptr<pc_planner, Destroy>;

Planner planner(uint32_t flags = 0, uint32_t max_width = kMaxWidth,
                uint32_t max_height = kMaxHeight) {
    auto info = pc::make<pc_plan_create_info>();
    info.api_version = PC_API_VERSION;
    info.flags = flags;
    info.max_width = max_width;
    info.max_height = max_height;
    pc_planner* made = nullptr;
    EXPECT_EQ(pc_plan_create(&info, &made), PC_OK) << pc_error();
    return Planner(made);
}

pc_texture texture(uint32_t number, pc_format format) {
    return {number, format, 3840, 2160, 0, 0};
}

pc_frame engine_frame(int width = 101, int height = 67) {
    auto frame = pc::make<pc_frame>();
    frame.width = width;
    frame.height = height;
    frame.color = texture(kColor, PC_FORMAT_RGBA16F);
    frame.depth = texture(kDepth, PC_FORMAT_D32F);
    frame.motion = texture(kMotion, PC_FORMAT_RG16F);
    frame.output = texture(kOutput, PC_FORMAT_RGBA16F);
    frame.depth_encoding = PC_DEPTH_REVERSE_INFINITE;
    frame.near_clip = 0.1f;
    frame.focal_length_mm = 50;
    frame.sensor_width_mm = 36;
    frame.f_stop = 2;
    frame.focus_distance = 4;
    return frame;
}

pc_plan plan(const Planner& by, const pc::Chain& chain, const pc_frame& frame) {
    auto made = pc::make<pc_plan>();
    EXPECT_EQ(pc_plan_frame(by.get(), chain.get(), &frame, &made), PC_OK) << pc_error();
    return made;
}

// The number of the texture's storage, host's textures behind the slots.
uint32_t storage_of(const pc_plan& plan, uint32_t texture) {
    const pc_plan_texture& one = plan.textures[texture];
    return one.host ? plan.slot_count + one.host : one.slot;
}

const pc_plan_texture& texture_of(const pc_plan& plan, const pc_plan_binding& binding) {
    return plan.textures[binding.texture];
}

// Lives, found anew from the bindings; textures of one slot follow one another.
void expect_lives(const pc_plan& plan) {
    std::map<uint32_t, std::pair<uint32_t, uint32_t>> lives;
    for (uint32_t i = 0; i < plan.step_count; ++i)
        for (uint32_t b = 0; b < plan.steps[i].binding_count; ++b) {
            const uint32_t t = plan.steps[i].bindings[b].texture;
            ASSERT_LT(t, plan.texture_count);
            lives.try_emplace(t, i, i).first->second.second = i;
        }
    if (plan.result != PC_PLAN_NONE) lives.at(plan.result).second = plan.step_count;
    for (uint32_t t = 0; t < plan.texture_count; ++t) {
        const pc_plan_texture& one = plan.textures[t];
        if (!lives.contains(t)) {
            EXPECT_EQ(one.first_step, PC_PLAN_NONE) << one.name;
            continue;
        }
        EXPECT_EQ(std::pair(one.first_step, one.last_step), lives.at(t)) << one.name;
        EXPECT_EQ(one.host == 0, one.slot != PC_PLAN_NONE) << one.name;
        if (one.host) continue;
        ASSERT_LT(one.slot, plan.slot_count);
        const pc_plan_slot& slot = plan.slots[one.slot];
        EXPECT_EQ(one.format, slot.format) << one.name;
        EXPECT_LE(one.width, slot.width) << one.name;
        EXPECT_LE(one.height, slot.height) << one.name;
        for (uint32_t other = 0; other < t; ++other) {
            if (!lives.contains(other) || plan.textures[other].slot != one.slot) continue;
            EXPECT_TRUE(lives.at(other).second < lives.at(t).first ||
                        lives.at(t).second < lives.at(other).first)
                << one.name << " and " << plan.textures[other].name;
            EXPECT_NE(one.format, pc_format(PC_FORMAT_LIST)) << "lists keep their counts";
        }
    }
    uint64_t bytes = 0;
    for (uint32_t s = 0; s < plan.slot_count; ++s) {
        bytes += plan.slots[s].bytes;
        EXPECT_EQ(plan.slots[s].zero_bytes, plan.slots[s].format == PC_FORMAT_LIST ? 16u : 0u);
    }
    EXPECT_EQ(bytes, plan.slot_bytes);
}

// A device that knows the state of each storage, as D3D12 has it: each use is one of the state, a
// barrier begins at the state that is, and there is one between any two steps that conflict.
void expect_barriers(const pc_plan& plan) {
    struct State {
        uint32_t texture = PC_PLAN_NONE;
        pc_plan_uses uses = 0;
        uint32_t barrier_at = 0;  // the step of the last one
    };
    std::map<uint32_t, State> states;
    struct Earlier {
        uint32_t step, texture;
        pc_plan_uses uses;
    };
    std::map<uint32_t, std::vector<Earlier>> earlier;  // of each storage
    uint32_t level = 0;
    for (uint32_t i = 0; i < plan.step_count; ++i) {
        const pc_plan_step& step = plan.steps[i];
        EXPECT_TRUE(step.level == level || (i > 0 && step.level == level + 1)) << step.name;
        const bool begins = i == 0 || step.level > level;
        level = step.level;
        EXPECT_TRUE(begins || step.barrier_count == 0) << step.name;
        for (uint32_t b = 0; b < step.barrier_count; ++b) {
            const pc_plan_barrier& barrier = step.barriers[b];
            State& state = states[storage_of(plan, barrier.texture)];
            const bool list = plan.textures[barrier.texture].format == PC_FORMAT_LIST;
            EXPECT_EQ(barrier.before, state.texture) << step.name;
            EXPECT_EQ(barrier.from, state.uses ? state.uses
                                    : list     ? PC_PLAN_ZEROED
                                               : 0)
                << step.name;
            EXPECT_TRUE(barrier.from != barrier.to || (barrier.to & kWrites)) << "it does nothing";
            // Reads together, one kind of writes, or a texture that is filtered in place.
            EXPECT_TRUE((barrier.to & kWrites) == 0 || std::has_single_bit(barrier.to) ||
                        barrier.to == (PC_PLAN_SAMPLED | PC_PLAN_IMAGE_WRITE))
                << barrier.to;
            state = {barrier.texture, barrier.to, i};
        }
        for (uint32_t b = 0; b < step.binding_count; ++b) {
            const pc_plan_binding& binding = step.bindings[b];
            const uint32_t storage = storage_of(plan, binding.texture);
            const State& state = states[storage];
            EXPECT_EQ(binding.access & ~state.uses, 0u)
                << step.name << ": " << texture_of(plan, binding).name << " is in state "
                << state.uses << ", not in " << binding.access;
            for (const Earlier& before : earlier[storage]) {
                const bool together =
                    before.texture == binding.texture &&
                    (before.uses == binding.access && (before.uses & kWrites) != 0);
                if (((before.uses | binding.access) & kWrites) == 0 || together) continue;
                EXPECT_GT(state.barrier_at, before.step)
                    << plan.steps[before.step].name << " -> " << step.name;
                EXPECT_GT(step.level, plan.steps[before.step].level);
            }
        }
        for (uint32_t b = 0; b < step.binding_count; ++b)
            earlier[storage_of(plan, step.bindings[b].texture)].push_back(
                {i, step.bindings[b].texture, step.bindings[b].access});
    }
}

void expect_steps(const pc_plan& plan, const std::set<uint64_t>& programs) {
    uint64_t end = 0;
    for (uint32_t i = 0; i < plan.step_count; ++i) {
        const pc_plan_step& step = plan.steps[i];
        EXPECT_TRUE(programs.contains(step.program)) << step.name;
        std::set<std::pair<uint32_t, uint32_t>> units;
        bool launched = step.list == PC_PLAN_NONE;
        for (uint32_t b = 0; b < step.binding_count; ++b) {
            const pc_plan_binding& binding = step.bindings[b];
            EXPECT_TRUE(units.emplace(binding.kind, binding.unit).second) << step.name;
            EXPECT_LT(binding.unit, binding.kind == PC_PLAN_UNIT_TEXTURE ? 16u : 8u);
            EXPECT_EQ(binding.kind == PC_PLAN_UNIT_LIST,
                      texture_of(plan, binding).format == PC_FORMAT_LIST);
            launched |= binding.texture == step.list &&
                        binding.access == (PC_PLAN_LIST_READ | PC_PLAN_INDIRECT);
        }
        EXPECT_TRUE(launched) << step.name << " does not read the list that launches it";
        EXPECT_EQ(step.dispatch_count == 0, step.list != PC_PLAN_NONE);
        if (step.uniform_bytes == 0) continue;
        EXPECT_EQ(step.uniform_offset % 256, 0u);
        EXPECT_GE(step.uniform_offset, end);
        end = step.uniform_offset + step.uniform_bytes;
    }
    EXPECT_LE(end, plan.uniform_bytes);
}

std::set<uint64_t> programs_of(const Planner& by, const pc::Chain& chain, const pc_frame& frame) {
    uint32_t count = 0;
    EXPECT_EQ(pc_plan_programs(by.get(), chain.get(), &frame, nullptr, &count), PC_OK)
        << pc_error();
    std::vector<uint64_t> keys(count + 1, 0);
    EXPECT_EQ(pc_plan_programs(by.get(), chain.get(), &frame, keys.data(), &count), PC_OK);
    EXPECT_EQ(keys.back(), 0u) << "written beyond its room";
    keys.pop_back();
    const std::set<uint64_t> all(keys.begin(), keys.end());
    EXPECT_EQ(all.size(), count) << "a key is listed twice";
    return all;
}

struct Variant {
    const char* name;
    std::function<void(pc_frame&)> change;
};

std::vector<Variant> variants() {
    return {{"as an engine has it", [](pc_frame&) {}},
            {"read in place, halves",
             [](pc_frame& f) {
                 f.depth = texture(kDepth, PC_FORMAT_R32F);
                 f.depth_encoding = PC_DEPTH_INVERSE;
                 f.flags |= PC_HALF_PLANES | PC_NO_ELISION;
             }},
            {"rows from the bottom, 8 bits",
             [](pc_frame& f) {
                 f.flags = PC_BOTTOM_LEFT;
                 f.output = texture(kOutput, PC_FORMAT_RGBA8);
             }},
            {"over color", [](pc_frame& f) { f.output = f.color; }},
            {"no output", [](pc_frame& f) { f.output = {}; }},
            {"mask and exposure",
             [](pc_frame& f) {
                 f.mask = texture(kMask, PC_FORMAT_R8);
                 f.exposure = texture(kExposure, PC_FORMAT_R32F);
             }},
            {"the frame before",
             [](pc_frame& f) {
                 static pc_frame before;
                 before = f;
                 before.color.name = 7;
                 before.depth.name = 8;
                 before.motion.name = 9;
                 f.before = &before;
             }},
            {"half resolution", [](pc_frame& f) { f.flags |= PC_HALF_RESOLUTION; }},
            {"a cut", [](pc_frame& f) { f.flags |= PC_CAMERA_CUT; }}};
}

TEST(Planner, EveryArrayHoldsOnAnIndependentWalk) {
    const Planner by = planner();
    size_t lists = 0, shared = 0;
    std::vector<std::string> chains = {"motion_blur,fxaa,depth_of_field", "joint_blur"};
    const char* tier = nullptr;
    for (uint32_t i = 0; pc_tier(i, &tier, nullptr) == PC_OK; ++i)
        chains.push_back(std::string("tier:") + tier);
    for (const std::string& name : chains)
        for (const Variant& variant : variants()) {
            SCOPED_TRACE(name + ", " + variant.name);
            const pc::Chain chain = pc::chain(name.c_str());
            pc_frame frame = engine_frame();
            variant.change(frame);
            const std::set<uint64_t> programs = programs_of(by, chain, frame);
            const pc_plan found = plan(by, chain, frame);
            ASSERT_GT(found.step_count, 0u);
            ASSERT_NE(found.result, PC_PLAN_NONE);
            EXPECT_EQ(found.textures[found.result].host, frame.output.name);
            expect_lives(found);
            expect_barriers(found);
            expect_steps(found, programs);
            ASSERT_FALSE(HasFailure());
            for (uint32_t i = 0; i < found.step_count; ++i)
                lists += found.steps[i].list != PC_PLAN_NONE;
            size_t textures = 0;
            std::set<std::string> names;
            for (uint32_t t = 0; t < found.texture_count; ++t) {
                textures += found.textures[t].slot != PC_PLAN_NONE;
                EXPECT_TRUE(names.insert(found.textures[t].name).second);
            }
            shared += textures > found.slot_count;
        }
    EXPECT_GT(lists, 0u);
    EXPECT_GT(shared, 0u);
}

// Every member, by index; keys are numbered in the order of the steps.
std::string text_of(const pc_plan& plan) {
    std::map<uint64_t, size_t> keys;
    std::string text = concat("result ", plan.result, ", ", plan.uniform_bytes,
                              " bytes of uniforms, ", plan.slot_bytes, " of slots, made for ",
                              plan.made_width, "x", plan.made_height, "\n");
    for (uint32_t i = 0; i < plan.slot_count; ++i) {
        const pc_plan_slot& slot = plan.slots[i];
        text +=
            concat("slot ", i, ": format ", slot.format, ", ", slot.width, "x", slot.height, ", ",
                   slot.slices, " slices, ", slot.bytes, " bytes, ", slot.zero_bytes, " zeros\n");
    }
    for (uint32_t i = 0; i < plan.texture_count; ++i) {
        const pc_plan_texture& one = plan.textures[i];
        text += concat("texture ", i, " ", one.name, ": host ", one.host, ", slot ",
                       int32_t(one.slot), ", format ", one.format, ", ", one.width, "x", one.height,
                       ", steps ", int32_t(one.first_step), " to ", int32_t(one.last_step), "\n");
    }
    for (uint32_t i = 0; i < plan.step_count; ++i) {
        const pc_plan_step& step = plan.steps[i];
        const size_t key = keys.try_emplace(step.program, keys.size()).first->second;
        text += concat("step ", i, " ", step.name, ": program ", key, ", level ", step.level,
                       ", list ", int32_t(step.list), ", wait ", step.bands_wait, ", uniforms ",
                       step.uniform_offset, " + ", step.uniform_bytes, ", fetches ", step.fetches,
                       ", reads ", step.read_bytes, ", writes ", step.written_bytes, "\n");
        text += "  barriers";
        for (uint32_t b = 0; b < step.barrier_count; ++b) {
            const pc_plan_barrier& one = step.barriers[b];
            text += concat("; ", one.texture, " after ", int32_t(one.before), ": ", one.from,
                           " to ", one.to);
        }
        text += "\n  bindings";
        for (uint32_t b = 0; b < step.binding_count; ++b) {
            const pc_plan_binding& one = step.bindings[b];
            text += concat("; kind ", one.kind, " unit ", one.unit, ": ", one.texture, ", access ",
                           one.access);
        }
        text += "\n  groups";
        for (uint32_t b = 0; b < step.dispatch_count; ++b) {
            const pc_plan_dispatch& one = step.dispatches[b];
            text += concat("; ", one.groups[0], " ", one.groups[1], " ", one.groups[2], " from ",
                           one.first_group[0], " ", one.first_group[1]);
        }
        text += "\n";
    }
    for (uint32_t i = 0; i < plan.elision_count; ++i) {
        const pc_plan_elision& one = plan.elisions[i];
        text += concat("left out ", one.item, ", ", one.rule, ", ", one.reason, ": ", one.fetches,
                       " fetches, ", one.bytes, " bytes, ", one.dispatches, " dispatches\n");
    }
    return text;
}

// The second frame is smaller, in the same storage, with another output and without a mask.
TEST(Planner, EveryMember) {
    const Planner by = planner();
    const pc::Chain chain = pc::chain("motion_blur,fxaa");
    EXPECT_EQ(pc_chain_set_text(chain.get(), 0, "mode", "guertin"), PC_OK) << pc_error();
    pc_frame frame = engine_frame();
    frame.mask = texture(kMask, PC_FORMAT_R8);
    frame.exposure = texture(kExposure, PC_FORMAT_R32F);
    std::string text = text_of(plan(by, chain, frame));
    frame.width = 33;
    frame.height = 17;
    frame.mask = {};
    frame.output = {};
    frame.flags = PC_CAMERA_CUT;
    text += "\n" + text_of(plan(by, chain, frame));
    test::expect_text_of(kExpected + "/plan", text);
}

// The key of a program is that of its source, which postchain-programs hashes too.
TEST(Planner, KeysAreThoseOfTheSources) {
    const Planner by = planner();
    const pc::Chain chain = pc::chain("fxaa");
    const auto key_of = [](const ProgramKey& program) {
        return program_key(*program_source(program));
    };
    const std::set<uint64_t> keys = programs_of(by, chain, engine_frame());
    EXPECT_TRUE(keys.contains(key_of({"guest/export.comp", {{"EXPOSURE", "0"}}})));
    EXPECT_FALSE(keys.contains(key_of({"guest/export.comp", {{"EXPOSURE", "1"}}})));
    programs_of(by, pc::chain("fxaa,fxaa"), engine_frame());  // two passes, one program
}

// Size, lens, shutter, bounds and noise are values; large frames are cut into more bands.
TEST(Planner, AFrameLikeTheLastOnesAllocatesNothing) {
    const Planner by = planner(0, 3840, 2160);
    for (const char* passes : {"motion_blur,fxaa,depth_of_field", "tier:realtime"}) {
        const pc::Chain chain = pc::chain(passes);
        pc_frame frame = engine_frame(33, 17);
        frame.max_speed_px = 30;
        auto made = plan(by, chain, frame);
        const pc_plan first = made;
        const std::string uniforms(static_cast<const char*>(made.uniforms), made.uniform_bytes);
        for (int i = 1; i < 50; ++i) {
            frame.width = 33 + 70 * i;
            frame.height = 17 + 40 * i;
            frame.frame_number = uint64_t(i);
            frame.f_stop *= 1.001f;
            frame.shutter_frames = 0.4f + 0.01f * float(i % 5);
            frame.near_clip = 0.1f + 0.01f * float(i);
            frame.max_speed_px = 30 + float(i);
            const uint64_t before = allocations();
            const pc_result result = pc_plan_frame(by.get(), chain.get(), &frame, &made);
            ASSERT_EQ(allocations() - before, 0u) << i;
            ASSERT_EQ(result, PC_OK) << pc_error();
            ASSERT_EQ(made.shape, first.shape);
        }
        size_t bands = 0;
        for (uint32_t i = 0; i < made.step_count; ++i) bands += made.steps[i].dispatch_count;
        EXPECT_GT(bands, made.step_count);
        EXPECT_EQ(made.textures, first.textures);
        EXPECT_EQ(made.textures[made.result].width, uint32_t(frame.width));
        EXPECT_NE(std::memcmp(made.uniforms, uniforms.data(), uniforms.size()), 0);
        expect_lives(made);
    }
}

// A chain's new values have a new plan of the same shape, if they change no program; other chains
// and formats have another one.
TEST(Planner, ShapesAreTold) {
    const Planner by = planner();
    const pc::Chain chain = pc::chain("motion_blur,fxaa"), other = pc::chain("fxaa");
    const pc_frame frame = engine_frame();
    const uint64_t shape = plan(by, chain, frame).shape;
    EXPECT_EQ(pc_chain_set_number(chain.get(), 0, "seed", 7), PC_OK);
    pc_frame small = frame;
    small.width = 90;
    small.height = 50;
    const pc_plan again = plan(by, chain, small);
    EXPECT_EQ(again.shape, shape);
    EXPECT_EQ(again.made_width, 90u);
    EXPECT_EQ(again.made_height, 50u);
    // Row 0 is the top, unless it is said to be the bottom.
    pc_frame top = frame, bottom = frame;
    top.flags |= PC_TOP_LEFT;
    bottom.flags |= PC_BOTTOM_LEFT;
    EXPECT_EQ(plan(by, chain, top).shape, shape);
    EXPECT_NE(plan(by, chain, bottom).shape, shape);
    EXPECT_NE(plan(by, other, frame).shape, shape);
    pc_frame halves = frame;
    halves.flags |= PC_HALF_PLANES;
    EXPECT_NE(plan(by, chain, halves).shape, shape);
    EXPECT_EQ(plan(by, chain, frame).shape, shape);
}

TEST(Planner, WhatIsLeftOutIsToldWithItsReason) {
    const Planner by = planner();
    const pc::Chain chain = pc::chain("motion_blur,fxaa");
    pc_frame frame = engine_frame();
    frame.flags |= PC_CAMERA_CUT;
    const pc_plan cut = plan(by, chain, frame);
    std::map<std::string, pc_plan_elision> by_item;
    for (uint32_t i = 0; i < cut.elision_count; ++i)
        by_item.emplace(cut.elisions[i].item, cut.elisions[i]);
    ASSERT_TRUE(by_item.contains("motion_blur"));
    EXPECT_STREQ(by_item.at("motion_blur").rule, "camera_cut");
    EXPECT_GT(by_item.at("motion_blur").dispatches, 0u);
    EXPECT_GT(std::strlen(by_item.at("motion_blur").reason), 0u);
    // Nothing to do, and no output: the frame's own color.
    const pc::Chain blur = pc::chain("motion_blur");
    frame.output = {};
    const pc_plan none = plan(by, blur, frame);
    EXPECT_EQ(none.step_count, 0u);
    EXPECT_EQ(none.result, PC_PLAN_NONE);
    EXPECT_EQ(none.slot_bytes, 0u);
}

// The code and the message are in the transcript.
void expect_refused(pc_result result) {
    Transcript::say(concat(pc_result_name(result), " ", pc_error()));
    EXPECT_NE(result, PC_OK);
}

TEST(Planner, FramesThatCannotBePlannedAreRefused) {
    const Transcript whole(kExpected);
    const Planner by = planner(PC_VALIDATE);
    const pc::Chain chain = pc::chain("motion_blur,depth_of_field");
    void (*const changes[])(pc_frame&) = {
        [](pc_frame& f) { f.color = {}; },
        [](pc_frame& f) { f.color.internal_format = 99; },
        [](pc_frame& f) { f.color.internal_format = PC_FORMAT_RGBA32UI; },
        [](pc_frame& f) { f.output.internal_format = PC_FORMAT_RGB9E5; },
        [](pc_frame& f) { f.width = 201; },
        [](pc_frame& f) { f.height = 121; },
        [](pc_frame& f) { f.barriers = 1; },
        [](pc_frame& f) { f.motion = {}; }};
    for (const auto change : changes) {
        pc_frame frame = engine_frame();
        change(frame);
        auto out = pc::make<pc_plan>();
        expect_refused(pc_plan_frame(by.get(), chain.get(), &frame, &out));
        EXPECT_EQ(out.steps, nullptr);
    }
    pc_frame largest = engine_frame(kMaxWidth, kMaxHeight);
    EXPECT_EQ(plan(by, chain, largest).made_width, kMaxWidth);
    // Only PC_VALIDATE looks deeper.
    largest.nearest = 5;
    largest.farthest = 4;
    EXPECT_NE(plan(planner(), chain, largest).result, PC_PLAN_NONE);
    // The depth at a place would have to be read back.
    EXPECT_EQ(pc_chain_set_point(chain.get(), 1, "focus_at", 0.5, 0.5), PC_OK);
    const pc_frame frame = engine_frame();
    auto out = pc::make<pc_plan>();
    uint32_t count = 0;
    expect_refused(pc_plan_frame(by.get(), chain.get(), &frame, &out));
    expect_refused(pc_plan_programs(by.get(), chain.get(), &frame, nullptr, &count));
    EXPECT_EQ(pc_chain_unset(chain.get(), 1, "focus_at"), PC_OK);
    EXPECT_NE(plan(by, chain, frame).result, PC_PLAN_NONE);
}

// Each member with a value that it cannot have is refused by its name, in neighbors too.
class Members : public ::testing::Test {
  protected:
    using F = pc_frame&;
    using Change = std::function<void(F)>;
    static constexpr int kWidth = 101, kHeight = 67;

    static pc_frame whole_frame() {
        pc_frame frame = engine_frame(kWidth, kHeight);
        frame.mask = texture(kMask, PC_FORMAT_R8);
        frame.exposure = texture(kExposure, PC_FORMAT_R32F);
        return frame;
    }
    pc_result planned(const Change& change) const {
        pc_frame frame = whole_frame();
        change(frame);
        auto out = pc::make<pc_plan>();
        return pc_plan_frame(by_.get(), chain_.get(), &frame, &out);
    }
    void accepted(const Change& change) const { EXPECT_EQ(planned(change), PC_OK) << pc_error(); }
    void refused(const Change& change) const { expect_refused(planned(change)); }
    // In a neighbor too, with the same words after its name.
    void refused_in_both(const Change& change) const {
        const pc_result code = planned(change);
        expect_refused(code);
        refused_neighbor(change, code, pc_error());
    }
    void refused_neighbor(const Change& change, pc_result code, const std::string& text) const {
        pc_frame other = whole_frame();
        change(other);
        for (const auto& [name, of] :
             {std::pair("before.", &pc_frame::before), {"after.", &pc_frame::after}}) {
            EXPECT_EQ(planned([&](F f) { f.*of = &other; }), code) << name << text;
            EXPECT_THAT(pc_error(), HasSubstr(name + text));
        }
    }

    const Transcript whole_{kExpected};
    const Planner by_ = planner(PC_VALIDATE);
    const pc::Chain chain_ = pc::chain("motion_blur,depth_of_field");
};

TEST_F(Members, Numbers) {
    const auto is_checked = [&](const std::function<float&(F)>& of, bool is_signed) {
        const auto set = [&](float value) { return [&of, value](F f) { of(f) = value; }; };
        for (const float value : {NAN, INFINITY, -INFINITY}) refused_in_both(set(value));
        if (is_signed)
            accepted(set(-1));
        else
            refused(set(-1));
    };
    for (const auto of :
         {&pc_frame::near_clip, &pc_frame::far_clip, &pc_frame::pre_exposure,
          &pc_frame::focal_length_mm, &pc_frame::sensor_width_mm, &pc_frame::f_stop,
          &pc_frame::focus_distance, &pc_frame::meters_per_unit, &pc_frame::max_speed_px,
          &pc_frame::nearest, &pc_frame::farthest, &pc_frame::pixel_aspect, &pc_frame::focus_radius,
          &pc_frame::focus_seconds})
        is_checked([of](F f) -> float& { return f.*of; }, false);
    for (const auto of : {&pc_frame::shutter_frames, &pc_frame::frame_seconds})
        is_checked([of](F f) -> float& { return f.*of; }, true);
    for (const auto of : {&pc_frame::motion_scale, &pc_frame::motion_bias, &pc_frame::jitter_px,
                          &pc_frame::other_jitter_px, &pc_frame::depth_range})
        for (const int i : {0, 1}) is_checked([of, i](F f) -> float& { return (f.*of)[i]; }, true);
    for (int i = 0; i < 16; ++i)
        for (const auto matrix : {&pc_frame::view_projection, &pc_frame::other_view_projection})
            refused_in_both([matrix, i](F f) { (f.*matrix)[i] = NAN; });
    for (const auto matrix : {&pc_frame::view_projection, &pc_frame::other_view_projection})
        refused([&](F f) { (f.*matrix)[0] = 1; });
}

TEST_F(Members, Limits) {
    accepted([](F f) { f.focus_radius = 1; });
    refused([](F f) { f.focus_radius = 1.001f; });
    for (const float seconds : {0.0f, -1.0f})
        refused_in_both([&](F f) {
            f.focus_seconds = 1;
            f.frame_seconds = seconds;
        });
    for (const pc_depth encoding : {PC_DEPTH_LINEAR, PC_DEPTH_INVERSE}) {
        const auto set = [&](float near, float first) {
            return [encoding, near, first](F f) {
                f.depth_encoding = encoding;
                f.near_clip = near;
                f.depth_range[0] = first;
            };
        };
        accepted(set(0, 0));
        refused_in_both(set(1, 0.5f));
    }
    for (pc_depth encoding = PC_DEPTH_FORWARD; encoding <= PC_DEPTH_REVERSE_INFINITE; ++encoding) {
        const bool far = encoding == PC_DEPTH_FORWARD || encoding == PC_DEPTH_REVERSE;
        const auto set = [&](float near_clip, float far_clip) {
            return [=](F f) {
                f.depth_encoding = encoding;
                f.near_clip = near_clip;
                f.far_clip = far_clip;
            };
        };
        accepted(set(1, 1.5f));
        for (const float near_clip : {0.0f, -1.0f}) refused_in_both(set(near_clip, 2));
        for (const float far_clip : {1.0f, 0.0f})
            if (far)
                refused_in_both(set(1, far_clip));
            else
                accepted(set(1, far_clip));
    }
    refused_in_both([](F f) { f.depth_range[0] = f.depth_range[1] = 0.5f; });
    refused([](F f) { f.flags = PC_TOP_LEFT | PC_BOTTOM_LEFT; });
    refused([](F f) { f.flags = 2 * PC_BOTTOM_LEFT; });
    accepted([](F f) { f.nearest = f.farthest = 5; });
    refused([](F f) { f.nearest = 5, f.farthest = 4; });
    refused_in_both([](F f) { f.depth_encoding = 6; });
    for (const auto reserved : {&pc_frame::reserved, &pc_frame::reserved_2})
        refused_in_both([&](F f) { f.*reserved = 1; });
    for (int i = 0; i < 2; ++i) refused_in_both([&](F f) { f.reserved_3[i] = 1; });
}

TEST_F(Members, Textures) {
    const struct {
        pc_texture pc_frame::*of;
        int width = kWidth, height = kHeight;
        bool of_neighbors = true;
    } textures[] = {{&pc_frame::color},
                    {&pc_frame::depth},
                    {&pc_frame::motion},
                    {&pc_frame::exposure, 1, 1},
                    {&pc_frame::mask, kWidth, kHeight, false},
                    {&pc_frame::output, kWidth, kHeight, false}};
    for (const auto& one : textures) {
        const std::function<void(pc_texture&)> changes[] = {
            [](pc_texture& t) { t.width = 0; },
            [](pc_texture& t) { t.height = 0; },
            [](pc_texture& t) { t.width = INT32_MIN; },
            [](pc_texture& t) { t.height = INT32_MIN; },
            [](pc_texture& t) { t.x = -1; },
            [](pc_texture& t) { t.y = -1; },
            [&](pc_texture& t) { t.x = t.width - one.width + 1; },
            [&](pc_texture& t) { t.y = t.height - one.height + 1; },
            [](pc_texture& t) { t.internal_format = PC_FORMAT_R32UI; }};
        for (const auto& change : changes) {
            const auto spoil = [&](F f) { change(f.*one.of); };
            if (one.of_neighbors)
                refused_in_both(spoil);
            else
                refused(spoil);
        }
        accepted([&](F f) {
            (f.*one.of).x = (f.*one.of).width - one.width;
            (f.*one.of).y = (f.*one.of).height - one.height;
        });
        if (one.of != &pc_frame::color && one.of != &pc_frame::output)
            refused([&](F f) { f.output.name = (f.*one.of).name; });
    }
    // The least channels, and whether a depth format counts.
    const std::pair<pc_texture pc_frame::*, pc_format> formats[] = {
        {&pc_frame::color, PC_FORMAT_RG16F}, {&pc_frame::color, PC_FORMAT_D32F},
        {&pc_frame::motion, PC_FORMAT_R16F}, {&pc_frame::motion, PC_FORMAT_D32F},
        {&pc_frame::mask, PC_FORMAT_D32F},   {&pc_frame::output, PC_FORMAT_RG16F}};
    for (const auto& [of, format] : formats)
        refused([of = of, format = format](F f) { (f.*of).internal_format = format; });
    for (const auto of : {&pc_frame::depth, &pc_frame::exposure})
        accepted([&](F f) { (f.*of).internal_format = PC_FORMAT_D32F; });
    // The frame from color's x, y to its end.
    const auto rest = [](int width, int height) {
        return [=](F f) {
            f.color.x = f.color.width - width;
            f.color.y = f.color.height - height;
            f.width = f.height = 0;
        };
    };
    accepted(rest(1, 1));
    refused(rest(0, 1));
    refused(rest(1, 0));
    for (const auto of : {&pc_frame::depth_size, &pc_frame::motion_size}) {
        const auto set = [of](int width, int height) {
            return [=](F f) {
                (f.*of)[0] = width;
                (f.*of)[1] = height;
            };
        };
        accepted(set(kWidth, 1));
        accepted(set(1, kHeight));
        for (const auto& [width, height] : {std::pair(kWidth + 1, kHeight),
                                            {kWidth, kHeight + 1},
                                            {0, 1},
                                            {1, 0},
                                            {-1, 1},
                                            {1, -1}})
            refused_in_both(set(width, height));
    }
}

// A plan has no slices.
TEST_F(Members, Slices) {
    constexpr uint32_t k2d = 0x0de1, kArray = 0x8c1a;  // GL_TEXTURE_2D, GL_TEXTURE_2D_ARRAY
    const std::pair<pc_slice pc_frame::*, bool> slices[] = {{&pc_frame::color_slice, true},
                                                            {&pc_frame::depth_slice, true},
                                                            {&pc_frame::motion_slice, true},
                                                            {&pc_frame::mask_slice, false},
                                                            {&pc_frame::output_slice, false}};
    for (const auto& [of, of_neighbors] : slices) {
        const auto set = [of = of](pc_slice slice) { return [=](F f) { f.*of = slice; }; };
        for (const pc_slice slice :
             {pc_slice{1, 0, 0}, {0, 1, 0}, {k2d, 1, 0}, {kArray, -1, 0}, {0, 0, -1}, {0, 0, 31}})
            if (of_neighbors)
                refused_in_both(set(slice));
            else
                refused(set(slice));
        accepted(set({k2d, 0, 0}));
        for (const pc_slice slice : {pc_slice{0, 0, 30}, {kArray, 0, 0}}) {
            refused(set(slice));
            if (!of_neighbors) continue;
            pc_frame other = whole_frame();
            set(slice)(other);
            for (const auto neighbor : {&pc_frame::before, &pc_frame::after})
                refused([&](F f) { f.*neighbor = &other; });
        }
    }
}

TEST_F(Members, OfHalfTheResolution) {
    const auto halved = [](const Change& change) {
        return [change](F f) {
            f.flags |= PC_HALF_RESOLUTION;
            change(f);
        };
    };
    refused(halved([](F f) { f.output = {}; }));
    refused(halved([](F f) { f.output = f.color; }));
    refused(halved([](F f) { f.debug_view = "fill"; }));
    accepted(halved([](F f) { f.debug_view = ""; }));
}

TEST(Planner, StructsAndHandlesOfNoneAreRefused) {
    const Transcript whole(kExpected);
    auto info = pc::make<pc_plan_create_info>();
    info.api_version = PC_API_VERSION;
    info.max_width = info.max_height = 64;
    const auto create = [&](auto change) {
        auto changed = info;
        change(changed);
        pc_planner* made = reinterpret_cast<pc_planner*>(1);
        const pc_result result = pc_plan_create(&changed, &made);
        EXPECT_EQ(made, nullptr);
        return result;
    };
    expect_refused(create([](auto& i) { i.struct_size = 4; }));
    expect_refused(create([](auto& i) { i.api_version = 2 << 16; }));
    expect_refused(create([](auto& i) { i.flags = PC_LABELS; }));
    expect_refused(create([](auto& i) { i.reserved = 1; }));
    for (const auto side : {&pc_plan_create_info::max_width, &pc_plan_create_info::max_height})
        for (const uint32_t px : {0u, 32769u})
            expect_refused(create([&](auto& i) { i.*side = px; }));
    planner(0, 32768, 32768);
    expect_refused(pc_plan_create(nullptr, nullptr));

    const Planner by = planner();
    const pc::Chain chain = pc::chain("fxaa");
    const pc_frame frame = engine_frame();
    auto out = pc::make<pc_plan>();
    uint32_t room = 1;
    const auto refused = [&](pc_planner* p, pc_chain* c) {
        expect_refused(pc_plan_frame(p, c, &frame, &out));
        expect_refused(pc_plan_programs(p, c, &frame, nullptr, &(room = 0)));
    };
    refused(nullptr, chain.get());
    refused(by.get(), nullptr);
    refused(reinterpret_cast<pc_planner*>(chain.get()), chain.get());
    expect_refused(pc_plan_frame(by.get(), chain.get(), nullptr, &out));
    expect_refused(pc_plan_frame(by.get(), chain.get(), &frame, nullptr));
    expect_refused(pc_plan_programs(by.get(), chain.get(), &frame, nullptr, nullptr));
    room = 1;
    expect_refused(pc_plan_programs(by.get(), chain.get(), &frame, nullptr, &room));
    out.struct_size = 8;
    expect_refused(pc_plan_frame(by.get(), chain.get(), &frame, &out));
    // A host with a newer header, whose new members are 0.
    struct {
        pc_plan plan = {};
        uint64_t more = 0;
    } newer;
    newer.plan.struct_size = sizeof(newer);
    EXPECT_EQ(pc_plan_frame(by.get(), chain.get(), &frame, &newer.plan), PC_OK) << pc_error();
    EXPECT_GT(newer.plan.step_count, 0u);
    newer.more = 1;
    expect_refused(pc_plan_frame(by.get(), chain.get(), &frame, &newer.plan));
}

TEST(Planner, OneThreadAtATime) {
    const Planner by = planner(), other = planner();
    const pc::Chain chain = pc::chain("motion_blur,fxaa");
    const pc_frame frame = engine_frame();
    const pc_plan expected = plan(by, chain, frame);
    const guest::Use call(by.get(), "planner");  // as if this thread were in one
    std::thread([&] {
        auto out = pc::make<pc_plan>();
        expect_refused(pc_plan_frame(by.get(), chain.get(), &frame, &out));
        const pc_plan found = plan(other, chain, frame);
        ASSERT_EQ(found.step_count, expected.step_count);
        for (uint32_t i = 0; i < found.step_count; ++i)
            EXPECT_EQ(found.steps[i].program, expected.steps[i].program);
    }).join();
}

// Everything that a plan allocates may fail.
TEST(Planner, WithoutMemoryTheCallFails) {
    const Planner by = planner();
    const pc::Chain chain = pc::chain("fxaa");
    const pc_frame frame = engine_frame();
    auto out = pc::make<pc_plan>();
    refuse_memory(true);
    const pc_result result = pc_plan_frame(by.get(), chain.get(), &frame, &out);
    refuse_memory(false);
    EXPECT_EQ(result, PC_ERROR_MEMORY);
    EXPECT_GT(plan(by, chain, frame).step_count, 0u);
}

}  // namespace
}  // namespace postchain::test::planner_test

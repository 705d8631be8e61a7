// Barriers of a plan as data: a software renderer does not show a missing one.
#include "chain/plan/hazards.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "chain/pass/planner.h"
#include "chain/plan/storage.h"
#include "tests/support/images.h"
#include "tests/support/plans.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

// a -> b -> c by steps that read one texture and write another, given as {read, written}.
Plan chain_of(const std::vector<std::pair<int, int>>& steps, int textures) {
    Plan plan;
    plan.textures.resize(size_t(textures));
    for (const auto& [from, to] : steps) {
        Step step;
        step.bindings = {{0, from}, {0, to, Access::write}};
        plan.steps.push_back(step);
    }
    return plan;
}

TEST(Hazards, WhatEachStepWaitsFor) {
    struct Case {
        const char* what;
        std::vector<std::pair<int, int>> steps;
        std::vector<int> storage;  // of each texture
        std::vector<uint32_t> waits;
    };
    constexpr uint32_t kBoth = kWaitFetch | kWaitImage;
    const Case cases[] = {
        {"the third waits for the first, which lets the fourth go on",
         {{0, 1}, {0, 2}, {1, 3}, {2, 4}},
         {0, 1, 2, 3, 4},
         {0, 0, kWaitFetch, 0}},
        {"3 has the storage of 1, which the second step still reads",
         {{0, 1}, {1, 2}, {2, 3}},
         {0, 1, 2, 1},
         {0, kWaitFetch, kBoth}},
        {"each has its own", {{0, 1}, {1, 2}, {2, 3}}, {0, 1, 2, 3}, {0, kWaitFetch, kWaitFetch}},
        {"the third waits for both, as the fourth reads 1; the fifth writes where that lay",
         {{0, 1}, {0, 2}, {0, 3}, {1, 4}, {0, 5}},
         {0, 1, 2, 2, 4, 1},
         {0, 0, kBoth, 0, kWaitImage}},
        {"two write one texture together", {{0, 1}, {0, 1}, {1, 2}}, {0, 1, 2}, {0, 0, kWaitFetch}},
        {"the third writes some of 1 again",
         {{0, 1}, {1, 2}, {2, 1}, {1, 3}},
         {0, 1, 2, 3},
         {0, kWaitFetch, kBoth, kWaitFetch}},
        {"the second reads 1 and writes it",
         {{0, 1}, {1, 1}, {1, 2}},
         {0, 1, 2},
         {0, kWaitFetch, kWaitFetch}}};
    for (const Case& one : cases)
        EXPECT_EQ(waits_of(chain_of(one.steps, int(one.storage.size())), one.storage), one.waits)
            << one.what;
}

TEST(Hazards, AnImageIsReadAfterItWasWrittenAndBeforeItIsWrittenAgain) {
    // The fourth step writes where the image that the third reads lay.
    Plan plan = chain_of({{0, 1}, {0, 2}, {1, 3}, {0, 4}}, 5);
    plan.steps[2].bindings[0].access = Access::read;
    EXPECT_EQ(waits_of(plan, {0, 1, 2, 3, 1}),
              (std::vector<uint32_t>{0, 0, kWaitImage, kWaitImage}));
}

TEST(Hazards, AListIsWaitedForByItsReadersAndItsLaunch) {
    Plan plan;
    plan.textures.resize(3);
    Step fill;
    fill.bindings = {{0, 0}, {0, 1, Access::list}};
    Step launched;
    launched.bindings = {{0, 1, Access::list}, {0, 2, Access::write}};
    launched.work_list = 1;
    plan.steps = {fill, launched, launched};
    EXPECT_EQ(waits_of(plan, {0, 1, 2}), (std::vector<uint32_t>{0, kWaitList | kWaitLaunch, 0}));
}

TEST(Hazards, OneStepWaitsForAllThatItsLevelNeeds) {
    // Two makers, two readers: the second reader's list was filled before the first one waited.
    Plan plan = chain_of({{0, 1}, {0, 2}, {1, 3}, {2, 4}}, 5);
    plan.steps[1].bindings[1].access = Access::list;
    plan.steps[3].bindings[0].access = Access::list;
    plan.steps[3].work_list = 2;
    EXPECT_EQ(waits_of(plan, {0, 1, 2, 3, 4}),
              (std::vector<uint32_t>{0, 0, kWaitFetch | kWaitList | kWaitLaunch, 0}));
}

TEST(Levels, StepsStandAsLateAsTheirReadersAllow) {
    // 0 -> 1 -> 2 -> 5 by the first three, 0 -> 3 -> 4 -> 5 by the others, the second branch
    // shorter.
    Plan plan = chain_of({{0, 1}, {1, 2}, {2, 3}, {0, 4}, {3, 5}}, 6);
    plan.steps[4].bindings.push_back({1, 4});
    EXPECT_EQ(levels_of(plan), (std::vector<int>{0, 1, 2, 2, 3}));
    plan.steps[3].name = "side";
    plan.outputs[Role::color] = 5;
    order_by_level(plan);
    EXPECT_EQ(plan.steps[3].name, "side");
    EXPECT_EQ(plan.textures[4].first_step, 3);
    EXPECT_EQ(plan.textures[5].last_step, 5);
}

TEST(Levels, WhatWritesOneTextureTogetherStaysInItsOrder) {
    // The first two write 2, which the last reads; the second is also read by the third.
    Plan plan = chain_of({{0, 2}, {0, 2}, {3, 4}, {4, 5}}, 6);
    plan.steps[1].bindings.push_back({1, 3, Access::write});
    plan.steps[3].bindings.push_back({1, 2});
    EXPECT_EQ(levels_of(plan), (std::vector<int>{0, 0, 1, 2}));
}

TEST(Levels, AReaderStandsBeforeWhatWritesOverIt) {
    EXPECT_EQ(levels_of(chain_of({{0, 1}, {3, 0}}, 4)), (std::vector<int>{0, 1}));
    EXPECT_EQ(levels_of(chain_of({{0, 1}, {1, 2}, {2, 1}, {1, 3}}, 4)),
              (std::vector<int>{0, 1, 2, 3}));
    EXPECT_EQ(levels_of(chain_of({{0, 1}, {1, 1}, {1, 2}}, 3)), (std::vector<int>{0, 1, 2}));
}

// Written independently: every texture that a step uses was made visible since it was written, and
// nothing is written over where it may still be read or written.
void expect_ordered(const Plan& plan, const std::vector<int>& storage) {
    const auto waits = waits_of(plan, storage);
    for (size_t later = 0; later < plan.steps.size(); ++later)
        for (size_t earlier = 0; earlier < later; ++earlier) {
            const Step &first = plan.steps[earlier], &second = plan.steps[later];
            uint32_t between = 0;
            for (size_t i = earlier + 1; i <= later; ++i) between |= waits[i];
            for (const auto& a : first.bindings)
                for (const auto& b : second.bindings) {
                    if (storage[size_t(a.texture)] != storage[size_t(b.texture)]) continue;
                    uint32_t needed = 0;
                    const bool list = a.access == Access::list;
                    if (a.texture != b.texture) {
                        if (second.writes(b))
                            needed = kWaitImage;
                        else if (first.writes(a))
                            needed = kWaitFetch;
                    } else if (first.writes(a) && !second.writes(b)) {
                        needed = list ? kWaitList : kWaitFetch;
                        if (second.work_list == b.texture) needed |= kWaitLaunch;
                    } else if (!first.writes(a) && second.writes(b) && !list) {
                        needed = kWaitImage;
                    }
                    EXPECT_EQ(between & needed, needed) << first.name << " -> " << second.name;
                }
        }
}

// Likewise: a device that knows the state of each storage. Each use is one of the state, each
// transition begins at the state that is, at a step that waits, and one lies between any two steps
// of which one writes what the other uses.
void expect_states(const Plan& plan, const std::vector<int>& storage) {
    const auto waits = waits_of(plan, storage);
    const auto transitions = transitions_of(plan, storage, waits);
    struct State {
        uint32_t uses = 0;
        TextureId texture = -1;
        int since = -1;
    };
    std::map<int, State> states;
    size_t next = 0;
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        for (; next < transitions.size() && transitions[next].step == i; ++next) {
            const Transition& one = transitions[next];
            State& state = states[storage[size_t(one.texture)]];
            EXPECT_TRUE(i == 0 || waits[size_t(i)] != 0);
            EXPECT_EQ(std::pair(one.from, one.before), std::pair(state.uses, state.texture));
            state = {one.to, one.texture, i};
        }
        const Step& step = plan.steps[size_t(i)];
        for (const Binding& b : step.bindings) {
            State& state = states[storage[size_t(b.texture)]];
            EXPECT_EQ(uses_of(step, b) & ~state.uses, 0u) << step.name;
            state.texture = b.texture;
            for (int earlier = 0; earlier < i; ++earlier)
                for (const Binding& a : plan.steps[size_t(earlier)].bindings) {
                    if (storage[size_t(a.texture)] != storage[size_t(b.texture)]) continue;
                    const bool first = plan.steps[size_t(earlier)].writes(a),
                               second = step.writes(b);
                    // Those that write one texture together write different pixels, and no list
                    // is filled after it was read.
                    if ((!first && !second) || (first && second && a.texture == b.texture) ||
                        (!first && a.access == Access::list))
                        continue;
                    EXPECT_GT(state.since, earlier) << step.name;
                }
        }
    }
    EXPECT_EQ(next, transitions.size());
}

// A frame of which nothing is known.
Plan plan_of(const Chain& chain, bool neighbors = false) {
    test::TestFrame frame = test::layered_frame(32, 20, {0, 0}, {0, 0});
    if (neighbors) test::add_neighbors(frame);
    frame.description.bounds = {};
    return test::must(make_plan(chain, frame.description));
}

Plan papers() {
    Chain chain = test::chain_of("motion_blur", {{"mode", "guertin"}});
    test::append(chain, "fxaa", {{"hint", "checkerboard"}});
    test::append(chain, "depth_of_field", {{"method", "gilham"}, {"leak", "coc"}});
    return plan_of(chain);
}

std::vector<int> own_storage(const Plan& plan) {
    std::vector<int> storage(plan.textures.size());
    for (size_t i = 0; i < storage.size(); ++i) storage[i] = int(i);
    return storage;
}

size_t waiting_steps(const Plan& plan, const std::vector<int>& storage) {
    const auto waits = waits_of(plan, storage);
    return size_t(std::count_if(waits.begin(), waits.end(), [](uint32_t w) { return w != 0; }));
}

// Textures of one storage live one after another, lists have their own, and no other step waits.
void expect_shared(const Plan& plan) {
    const std::vector<int> storage = share_storage(plan).numbers();
    expect_ordered(plan, storage);
    EXPECT_EQ(waiting_steps(plan, storage), waiting_steps(plan, own_storage(plan)));
    for (size_t a = 0; a < storage.size(); ++a)
        for (size_t b = 0; b < a; ++b) {
            if (storage[a] != storage[b]) continue;
            const PlanTexture &first = plan.textures[a], &second = plan.textures[b];
            EXPECT_TRUE(first.last_step < second.first_step || second.last_step < first.first_step)
                << first.name << " and " << second.name;
            EXPECT_NE(first.format, Format::work_list);
        }
}

// For each step and texture that it reads, the earlier steps that have written that.
std::map<std::pair<std::string, TextureId>, std::multiset<std::string>> writers_of_inputs(
    const Plan& plan) {
    std::map<std::pair<std::string, TextureId>, std::multiset<std::string>> all;
    for (size_t i = 0; i < plan.steps.size(); ++i)
        for (const auto& read : plan.steps[i].bindings) {
            if (plan.steps[i].writes(read) || plan.textures[size_t(read.texture)].imported)
                continue;
            auto& writers = all[{plan.steps[i].name, read.texture}];
            for (size_t earlier = 0; earlier < i; ++earlier)
                for (const auto& written : plan.steps[earlier].bindings)
                    if (written.texture == read.texture && plan.steps[earlier].writes(written))
                        writers.insert(plan.steps[earlier].name);
            EXPECT_FALSE(writers.empty()) << plan.steps[i].name;
        }
    return all;
}

TEST(Hazards, OfPlansOfTheBuiltInPasses) {
    using test::chain_of;
    for (Plan plan :
         {plan_of(chain_of({"motion_blur"})), plan_of(chain_of({"fxaa"})),
          plan_of(chain_of({"depth_of_field"})), plan_of(chain_of({"joint_blur", "fxaa"})),
          plan_of(chain_of({"depth_of_field", "motion_blur", "fxaa"})),
          plan_of(chain_of({"motion_blur", "motion_blur"})),
          plan_of(chain_of({"joint_blur"}), true), papers()}) {
        expect_ordered(plan, own_storage(plan));
        expect_shared(plan);
        EXPECT_EQ(waiting_steps(plan, own_storage(plan)) > 0, plan.steps.size() > 1);
        const auto names = [](const Plan& of) {
            std::multiset<std::string> all;
            for (const auto& step : of.steps) all.insert(concat(step.pass, ".", step.name));
            return all;
        };
        const Plan before = plan;
        order_by_level(plan);
        EXPECT_EQ(names(plan), names(before));
        expect_ordered(plan, own_storage(plan));
        expect_shared(plan);
        EXPECT_EQ(writers_of_inputs(plan), writers_of_inputs(before));
        // One barrier before every level but the first.
        const auto levels = levels_of(plan);
        EXPECT_TRUE(std::is_sorted(levels.begin(), levels.end()));
        EXPECT_EQ(waiting_steps(plan, own_storage(plan)), size_t(levels.back()));
    }
}

TEST(Storage, IsTakenAgainWhereAStepWaitsAfterItsLastUse) {
    const auto numbers_of = [](Plan plan) {
        plan.textures[0].imported = true;
        find_lifetimes(plan, {TextureId(plan.textures.size()) - 1});
        return share_storage(plan).of;
    };
    const Plan plan = chain_of({{0, 1}, {1, 2}, {2, 3}, {3, 4}}, 5);
    EXPECT_EQ(numbers_of(plan), (std::vector<int>{-1, 0, 1, 0, 1}));
    Plan other = plan;
    other.textures[3].format = Format::rg16f;
    EXPECT_EQ(numbers_of(other), (std::vector<int>{-1, 0, 1, 2, 0}));
    Plan lists = plan;
    for (const size_t list : {1, 3}) lists.textures[list].format = Format::work_list;
    EXPECT_EQ(numbers_of(lists), (std::vector<int>{-1, 0, 1, 2, 1})) << "their counts are read";
    // No step waits before the second, which could take the first one's.
    EXPECT_EQ(numbers_of(chain_of({{0, 1}, {0, 2}, {2, 3}}, 4)), (std::vector<int>{-1, 0, 1, 0}));
}

TEST(Storage, HasRoomForTheLargestFrame) {
    Plan plan = chain_of({{0, 1}}, 2);
    for (PlanTexture& texture : plan.textures) texture.width = texture.height = 8;
    plan.passes.emplace_back();
    find_lifetimes(plan, {1});
    const auto size = [&](const std::optional<MaxFrameSize>& room) {
        const Storage storage = share_storage(plan, room).all.at(0);
        return std::array{storage.width, storage.height};
    };
    EXPECT_EQ(size({}), (std::array{8, 8}));
    EXPECT_EQ(size(MaxFrameSize{20, 10}), (std::array{20, 10}));
}

// Random steps over textures and lists. Textures may share storage in any way, as those that a host
// hands in do; lists have their own.
TEST(Hazards, OfRandomPlansAndImports) {
    std::mt19937 random(27);
    const auto below = [&](int limit) { return int(random() % uint32_t(limit)); };
    for (int round = 0; round < 3000; ++round) {
        const int textures = 2 + below(6), lists = below(3);
        Plan plan;
        plan.textures.resize(size_t(textures + lists));
        std::vector<int> storage = own_storage(plan);
        for (int t = 0; t < textures; ++t) storage[size_t(t)] = below(textures);
        for (int i = 0; i < 2 + below(8); ++i) {
            Step step;
            step.name = concat(i);
            // A step does not write what it also reads or writes, unless it works in place.
            std::map<int, Access> used;
            for (int t = 0; t < textures + lists; ++t) {
                if (below(3) > 0) continue;
                const Access access = t >= textures   ? Access::list
                                      : below(3) == 0 ? Access::write
                                                      : Access::sample_nearest;
                const auto [place, is_new] = used.emplace(storage[size_t(t)], access);
                const bool both_read =
                    access == Access::sample_nearest && place->second == Access::sample_nearest;
                if (!is_new && !both_read) continue;
                step.bindings.push_back({t, t, access});
                if (access == Access::write && below(4) == 0)
                    step.bindings.push_back({t, t, Access::sample_nearest});
                if (access == Access::list && below(2) == 0) step.work_list = t;
            }
            plan.steps.push_back(std::move(step));
        }
        expect_ordered(plan, storage);
        expect_states(plan, storage);
        ASSERT_FALSE(HasFailure()) << "round " << round;
    }
}

// Tiles, their neighbors, blocks, gather; lumas, FXAA; downsampling, two blurs, composite. The
// steps of depth of field that need only depth are on the levels of motion blur.
TEST(Levels, ThePapersChainHasTen) {
    Plan plan = papers();
    EXPECT_GT(waiting_steps(plan, own_storage(plan)), 11u);
    order_by_level(plan);
    EXPECT_EQ(levels_of(plan).back(), 9);
    EXPECT_EQ(waiting_steps(plan, own_storage(plan)), 9u);
}

}  // namespace
}  // namespace postchain

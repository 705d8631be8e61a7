// The parts of gpu_cost: a listing whose instructions are counted by hand, a program whose rounds
// are known, and the formula.
#include "tests/bench/cost_model.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "chain/egl/context.h"
#include "tests/bench/amd_listing.h"
#include "tests/bench/visit_marks.h"

namespace postchain::bench {
namespace {

// Marks 0: main, 1: an outer loop, 2: a loop in it that is unrolled twice, 3: a branch that is
// skipped, 4: one that the compiler did not skip.
const char* kListing = R"(BB0:
	s_load_dwordx8 s[8:15], s[2:3], 0x60   ; f40c0401 fa000060
	v_mov_b32_e32 v0, 0                    ; 7e000280
	buffer_store_dword v0, off, s[4:7], 0 offset:1024 ; e0700400
BB1:
	v_add_f32_e32 v1, v1, v2
	buffer_store_dword v0, off, s[4:7], 0 offset:1028
	s_waitcnt vmcnt(0)
	buffer_store_dword v0, off, s[4:7], 0 offset:1032
	image_load v[4:7], v[2:3], s[8:15] dmask:0xf dim:SQ_RSRC_IMG_2D unorm
	buffer_store_dword v0, off, s[4:7], 0 offset:1032
	v_mul_f32_e32 v1, v1, v2
	s_and_saveexec_b64 s[20:21], vcc
	s_cbranch_execz BB3
BB2:
	buffer_store_dword v0, off, s[4:7], 0 offset:1036
	v_sub_f32_e32 v1, v1, v2
	v_sub_f32_e32 v1, v1, v2
	ds_read_b32 v1, v0
BB3:
	s_mov_b64 exec, s[20:21]
	s_cbranch_scc0 BB1
BB4:
	v_max_f32_e32 v1, v1, v2
	image_store v[4:7], v[2:3], s[8:15] dmask:0xf dim:SQ_RSRC_IMG_2D unorm
	buffer_store_dword v0, off, s[4:7], 0 offset:1040
	s_endpgm
)";

TEST(AmdListing, CountsEachPartByItsMarks) {
    const Listing listing(kListing);
    std::vector<double> visits(kMostMarks, 0);
    visits[0] = 10;
    visits[1] = 70;
    visits[2] = 140;
    visits[3] = 5;
    visits[4] = 2;
    const Instructions all = listing.total(visits);
    // BB0 and BB4: 2, BB1 and BB3: 6, BB2: 2.
    EXPECT_EQ(all.alu, 10 * 2 + 70 * 6 + 5 * 2);
    EXPECT_EQ(all.shared, 5);
    EXPECT_EQ(all.loads, 70 + 10);
    EXPECT_EQ(all.texels.at(0x60), 70);
    EXPECT_EQ(all.stored.at(0x60), 10);
    EXPECT_TRUE(listing.loads_in(1));
    EXPECT_FALSE(listing.loads_in(3));
}

TEST(AmdListing, CountsTheTestOfALoopAsItsBody) {
    const Listing listing(R"(
BB0:
	buffer_store_dword v0, off, s[4:7], 0 offset:1024
BB1:
	s_cmp_ge_i32 s6, 64
	s_cbranch_scc1 BB3
BB2:
	buffer_store_dword v0, off, s[4:7], 0 offset:1028
	v_add_f32_e32 v1, v1, v2
	s_branch BB1
BB3:
	s_endpgm
)");
    std::vector<double> visits(kMostMarks, 0);
    visits[0] = 1;
    visits[1] = 64;
    EXPECT_EQ(listing.total(visits).alu, 64 * 4);
}

// Rounds of lane i of a group of 32: i % 5 of the outer loop; in round r of it, 1 + (i + r) % 3 of
// the inner one. Lanes from 8 on leave early.
const char* kShader = R"(#version 450 core
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Out { uint results[]; };

uint inner(uint rounds) {
    uint sum = 0u;
    for (uint k = 0u; k < rounds; ++k) sum += results[k];
    return sum;
}

void main() {
    const uint i = gl_LocalInvocationIndex % 32u;
    uint sum = 0u;
    for (uint r = 0u; r < i % 5u; ++r) {
        sum += inner(1u + (i + r) % 3u);
    }
    if (i >= 8u) return;
    uint k = 0u;
    do {
        atomicAdd(results[k], sum);
    } while (++k < 3u);
}
)";

TEST(VisitMarks, CountsTheLongestLaneOfEachGroup) {
    const auto context = egl::Context::create({});
    ASSERT_TRUE(context.ok()) << context.status().message();
    std::vector<Mark> marks;
    const std::string source = mark_visits("a.comp", kShader, marks);
    const GLuint shader = glCreateShader(GL_COMPUTE_SHADER), program = glCreateProgram();
    const char* text = source.c_str();
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    glAttachShader(program, shader);
    glLinkProgram(program);
    GLint linked = 0;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    ASSERT_TRUE(linked) << source;
    GLuint results = 0;
    glCreateBuffers(1, &results);
    glNamedBufferStorage(results, 64, nullptr, 0);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, results);
    VisitCounters counters;
    counters.clear(std::vector<uint32_t>(kMostMarks, 1000));
    glUseProgram(program);
    glDispatchCompute(5, 1, 1);
    glFinish();

    std::map<std::string, double> counts;
    for (size_t m = 0; m < marks.size(); ++m)
        counts[marks[m].place] = counters.counts()[m] / 10;  // groups of 32
    const std::map<std::string, double> expected = {
        {"a.comp:7", 4 * 3},  // the inner loop: 3 rounds of some lane in each of 4
        {"a.comp:11", 1},     // main
        {"a.comp:14", 4},     // the outer loop
        {"a.comp:17", 1},     // after the early return
        {"a.comp:19", 3},
    };
    EXPECT_EQ(counts, expected) << source;
    EXPECT_NEAR(counters.longest_ms(), 21e-3, 1e-9);
    glDeleteBuffers(1, &results);
    glDeleteProgram(program);
    glDeleteShader(shader);
}

TEST(CostModel, TheSlowestUnitDecides) {
    StepCost step;
    step.waves = 1e4;
    step.instructions = {199e6};
    EXPECT_NEAR(step.ms(kRates[0]), 1, 1e-9);
    step.texels = 199e6 / 32 * 3;
    EXPECT_NEAR(step.ms(kRates[0]), 3, 1e-9);
    step.bytes = 360e6 * 5;
    EXPECT_NEAR(step.ms(kRates[0]), 5, 1e-9);
    step.longest_ms = 7;
    EXPECT_NEAR(step.ms(kRates[0]), 5, 1e-9);
    step.waves = 10;
    step.waits = true;
    EXPECT_NEAR(step.ms(kRates[0]), 7 + kLevelMs, 1e-9);
}

TEST(CostModel, TexelsByFormat) {
    EXPECT_EQ(texel_cost(Format::rgba16f), 1);
    EXPECT_EQ(texel_cost(Format::rg32f), 1);
    EXPECT_EQ(texel_cost(Format::rgba32f), 4);
    EXPECT_EQ(texel_cost(Format::rgba32ui), 4);
}

// 100 x 100 pixels: a texture at unit 2 that is sampled, and an image at unit 0.
TEST(CostModel, AStepMovesWhatItTouchesAndAtMostTheWhole) {
    Plan plan;
    plan.textures.resize(2);
    for (PlanTexture& texture : plan.textures) {
        texture.width = texture.height = 100;
        texture.format = Format::rgba32f;
    }
    Step step;
    step.bindings = {{2, 0, Access::sample_nearest}, {0, 1, Access::write}};
    const double whole = 160000;
    Instructions all;
    EXPECT_EQ(moved_bytes(plan, step, all, 1), 2 * whole);
    all.texels[2 * 96] = 10;  // of waves of 32
    EXPECT_EQ(moved_bytes(plan, step, all, 1), 10 * 32 * 16 + whole);
    all.stored[32 * 96] = 1e9;
    EXPECT_EQ(moved_bytes(plan, step, all, 0.5), 10 * 32 * 16 + whole / 2);
    all.texels[0] = 3;  // nothing is known of it
    EXPECT_EQ(fetch_cost(plan, step, all), 10 * 4 + 3);
}

TEST(CostModel, RankCorrelation) {
    EXPECT_NEAR(rank_correlation({1, 2, 3, 4}, {10, 20, 30, 400}), 1, 1e-12);
    EXPECT_NEAR(rank_correlation({1, 2, 3, 4}, {4, 3, 2, 1}), -1, 1e-12);
    EXPECT_NEAR(rank_correlation({1, 2, 3, 4}, {2, 1, 3, 4}), 0.8, 1e-12);
}

}  // namespace
}  // namespace postchain::bench

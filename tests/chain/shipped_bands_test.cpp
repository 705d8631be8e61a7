// Every shipped chain in bands gives the bits of whole dispatches.
#include <gtest/gtest.h>

#include <cmath>

#include "chain/gl/program.h"
#include "chain/gl/texture_pool.h"
#include "chain/gl/transfers.h"
#include "chain/plan/bands.h"
#include "config/chain_find.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

using Images = std::map<std::string, ImageF>;

// A frame with layers and neighbors, of 10 x 6 blocks, some of which move.
TestFrame frame_of(uint32_t seed) {
    TestFrame frame = layered_frame(150, 90, {21, 9}, {0, 0}, seed);
    add_neighbors(frame);
    add_lights(frame, 2);
    return frame;
}

// With bands of so many work groups in run(), and in filter() of few that grow.
Plan cut(Plan plan, double groups) {
    for (Step& step : plan.steps) step.group_taps = uint64_t(kBandTaps / groups);
    return plan;
}

// Takes the stages that are whole: of others than outputs, a step launched by a list may leave
// blocks out.
StageObserver into(Images& images, const Plan& plan) {
    return [&](const Step& step, const PlanTexture& texture, const ImageF& pixels) {
        if (step.work_list < 0 || texture.last_step == int(plan.steps.size()))
            images[texture.name] = pixels;
        return Status();
    };
}

// As a sequence runs: counts of lists are read, bands grow with time.
Images filtered(const Plan& plan, const TestFrame& frame) {
    Images images;
    must(executor().filter(plan, frame.planes, into(images, plan)));
    return images;
}

// As in a host: nothing is read back.
Images run(const Plan& plan, const TestFrame& frame) {
    gl::TexturePool pool;
    std::map<Role, unsigned> inputs;
    for (const PlanTexture& texture : plan.textures) {
        if (!texture.imported || !plan.reads.has(texture.role)) continue;
        const gl::Texture& made = *must(pool.acquire(texture));
        EXPECT_EQ(error_of(gl::Transfers().upload(made, frame.planes.at(texture.role))), "");
        inputs[texture.role] = made.name;
    }
    Images images;
    executor().forget_rates();  // bands of the fetches that the steps claim
    must(executor().run(plan, inputs, into(images, plan)));
    return images;
}

void expect_equal(const Images& whole, const Images& bands, const std::string& name) {
    EXPECT_EQ(whole.size(), bands.size()) << name;
    for (const auto& [texture, pixels] : whole)
        EXPECT_TRUE(bands.contains(texture) && equal_bits(pixels, bands.at(texture)))
            << name << ", " << texture;
}

// A group of a step over several layers fetches for one of them.
TEST(ShippedBands, FetchesOfAGroupAreItsPartOfTheStep) {
    TestFrame frame = frame_of(1);
    frame.description.layers = 3;
    int over_layers = 0;
    for (const std::string& name : shipped_chains()) {
        const Plan plan =
            must(make_plan(must(load_chain(name, every_pass())).chain, frame.description));
        for (const Step& step : plan.steps) {
            if (step.groups[2] == 1 || step.taps == 0) continue;
            const double groups = double(step.groups[0]) * step.groups[1] * step.groups[2];
            EXPECT_EQ(double(step.group_taps), std::ceil(double(step.taps) / groups)) << step.name;
            ++over_layers;
        }
    }
    EXPECT_GT(over_layers, 0);
}

TEST(ShippedBands, GiveTheBitsOfWholeDispatches) {
    const TestFrame frame = frame_of(1), other = frame_of(2);
    executor();  // a GL context
    gl::ProgramCache programs;
    for (const std::string& name : shipped_chains()) {
        const Plan made =
            must(make_plan(must(load_chain(name, every_pass())).chain, frame.description));
        for (const Step& step : made.steps)
            EXPECT_TRUE(must(programs.get(step.program)).in_bands)
                << name << ": " << step.program.text();
        const Plan whole = cut(made, 1e5);
        const Images images = filtered(whole, frame);
        EXPECT_FALSE(images.empty());
        for (const double groups : {1.0, 3.0, 25.0}) {
            // So that blocks which a band leaves out do not have the right values already.
            filtered(whole, other);
            expect_equal(images, run(cut(made, groups), frame), concat(name, ", host, ", groups));
        }
        filtered(whole, other);
        expect_equal(images, filtered(cut(made, 1e-3), frame), name + ", growing");
    }
}

// By the fetches that steps count: 100 ms of a small integrated GPU, also with everything at its
// maximum on the largest image.
TEST(ShippedBands, NoBandIsLong) {
    const double limit = 2 * kBandTaps;
    TestFrame frame = frame_of(1);
    const auto expect_short = [&](const Chain& chain, int width, int height,
                                  const std::string& name) {
        frame.description.width = frame.description.display_width = width;
        frame.description.height = frame.description.display_height = height;
        const Plan plan = must(make_plan(chain, frame.description));
        EXPECT_FALSE(plan.steps.empty());
        for (const Step& step : plan.steps)
            EXPECT_LE(taps_of_group(step), limit) << name << ": " << step.name;
    };
    for (const std::string& name : shipped_chains())
        expect_short(load_chain(name, every_pass())->chain, 3840, 2160, name);
    expect_short(chain_of("joint_blur", {{"samples", int64_t(1023)}, {"starts", int64_t(8)}}),
                 16384, 16384, "joint blur");
    expect_short(
        chain_of("motion_blur", {{"mode", std::string("guertin")}, {"samples", int64_t(1023)}}),
        16384, 16384, "guertin");
    expect_short(chain_of("depth_of_field", {{"method", std::string("gilham")},
                                             {"blur_sigma_px", 500.0},
                                             {"downsample", int64_t(1)}}),
                 16384, 16384, "gilham");
}

}  // namespace
}  // namespace postchain::test

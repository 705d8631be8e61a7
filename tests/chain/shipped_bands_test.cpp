// Every shipped chain in bands gives the bits of whole dispatches.
#include <gtest/gtest.h>

#include "chain/bands.h"
#include "chain/gl/program.h"
#include "chain/gl/texture_pool.h"
#include "config/chain_find.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"

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

StageObserver into(Images& images) {
    return [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
        images[texture.name] = pixels;
        return Status();
    };
}

// As a sequence runs: counts of lists are read, bands grow with time.
Images filtered(const Plan& plan, const TestFrame& frame) {
    Images images;
    const auto result = executor().filter(plan, frame.planes, into(images));
    EXPECT_TRUE(result.ok()) << result.status().message();
    return images;
}

// As in a host: nothing is read back.
Images run(const Plan& plan, const TestFrame& frame) {
    gl::TexturePool pool;
    std::map<Role, unsigned> inputs;
    for (const PlanTexture& texture : plan.textures) {
        if (!texture.imported || !plan.reads.has(texture.role)) continue;
        auto made = pool.acquire(texture.format, texture.width, texture.height, texture.layers);
        EXPECT_TRUE(made.ok() && gl::upload(**made, *frame.planes.at(texture.role)).ok());
        inputs[texture.role] = (*made)->name;
    }
    Images images;
    const auto result = executor().run(plan, inputs, into(images));
    EXPECT_TRUE(result.ok()) << result.status().message();
    return images;
}

void expect_equal(const Images& whole, const Images& bands, const std::string& name) {
    EXPECT_EQ(whole.size(), bands.size()) << name;
    for (const auto& [texture, pixels] : whole)
        EXPECT_TRUE(bands.contains(texture) && equal_bits(pixels, bands.at(texture)))
            << name << ", " << texture;
}

TEST(ShippedBands, GiveTheBitsOfWholeDispatches) {
    const TestFrame frame = frame_of(1), other = frame_of(2);
    gl::ProgramCache programs;
    for (const std::string& name : shipped_chains()) {
        const auto loaded = load_chain(name, every_pass());
        ASSERT_TRUE(loaded.ok()) << loaded.status().message();
        const auto made = make_plan(loaded->chain, frame.description);
        ASSERT_TRUE(made.ok()) << made.status().message();
        for (const Step& step : made->steps) {
            const auto program = programs.get(step.program);
            ASSERT_TRUE(program.ok()) << program.status().message();
            EXPECT_TRUE(program->in_bands) << name << ": " << step.program.text();
        }
        const Plan whole = cut(*made, 1e5);
        const Images images = filtered(whole, frame);
        EXPECT_FALSE(images.empty());
        for (const double groups : {1.0, 3.0, 25.0}) {
            // So that blocks which a band leaves out do not have the right values already.
            filtered(whole, other);
            expect_equal(images, run(cut(*made, groups), frame), concat(name, ", host, ", groups));
        }
        filtered(whole, other);
        expect_equal(images, filtered(cut(*made, 1e-3), frame), name + ", growing");
    }
}

}  // namespace
}  // namespace postchain::test

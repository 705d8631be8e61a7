// Elided run against complete run, to the bit: what every test of this folder does.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain::test {

inline constexpr Precision kPrecisions[] = {Precision::fp32, Precision::fp16};

// No rule in use but these.
PlanOptions only(std::initializer_list<std::string> rules, Precision precision = Precision::fp32);
PlanOptions no_rule(Precision precision = Precision::fp32);

// Noise in [0, 2) that a half holds, so that --precision fp16 stores color in halves.
ImageF half_noise(int width, int height, int channels, uint32_t seed);

// Color before one depth that moves alike.
FramePlanes flat_planes(const ImageF& color, std::array<float, 2> motion = {0, 0}, float w = 0.1f);
// A frame in which everything moves and is out of focus.
FramePlanes other_frame(const FramePlanes& planes);

struct Elided {
    Plan plan;
    FramePlanes outputs;
    std::vector<WorkDone> work;

    // Blocks of the list "<anything>.<name>"; fails the test if the plan has none.
    unsigned blocks(const std::string& name) const;
    // Is there an entry of this rule in plan.elisions?
    bool used(const std::string& rule) const;
};

// Runs the chain without any rule and by `options`, and expects the same planes, bit for bit. In
// between every texture is overwritten by another frame: a block that the elided run wrongly leaves
// out must not find the right values of the complete run.
Elided expect_same_bits(const Chain& chain, const FrameDescription& frame,
                        const FramePlanes& planes, const PlanOptions& options);

// The place of the first difference between two images; empty if they are equal.
std::string first_difference(const ImageF& complete, const ImageF& elided);

// The numbers before and after, `steps` away.
float neighbor(float value, int steps);

}  // namespace postchain::test

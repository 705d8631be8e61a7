// Every mode and method of every pass, and chains of several: the table of the tests that run for
// each of them.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/gpu.h"

namespace postchain::test {

struct Variant {
    struct Link {
        std::string type;
        std::vector<std::pair<std::string, ParameterValue>> settings = {};
    };
    std::string name;  // one word
    std::vector<Link> links;
    // How far the GPU may be from the reference, as a part of max(1, |value|), and the share of
    // pixels that may be farther: a tap, a tie or a decision that rounds the other way.
    double tolerance = 1e-3, share = 0.01;

    Chain chain() const;
};
void PrintTo(const Variant& variant, std::ostream* out);

// The variants whose code differs most.
const std::vector<Variant>& main_variants();
// All others: values of parameters for which programs are compiled.
const std::vector<Variant>& more_variants();

// One of the inverse warps, of the report's filters, of gilham's and of FXAA: for properties of
// what surrounds a pass.
const std::vector<Variant>& one_of_each_kind();

std::vector<Variant> variants_that(const std::vector<Variant>& all,
                                   const std::function<bool(const Chain&)>& have);
// For variants_that().
bool reads_motion(const Chain& chain);
bool warps(const Chain& chain);  // one pass, which searches by the inverse warp
bool any_chain(const Chain& chain);

}  // namespace postchain::test

// A test of this fixture is named Main/... or More/...; the default runs those of Main.
#define FOR_VARIANTS_THAT(fixture, have)                                           \
    INSTANTIATE_TEST_SUITE_P(Main, fixture,                                        \
                             ::testing::ValuesIn(::postchain::test::variants_that( \
                                 ::postchain::test::main_variants(), have)),       \
                             [](const auto& one) { return one.param.name; });      \
    INSTANTIATE_TEST_SUITE_P(More, fixture,                                        \
                             ::testing::ValuesIn(::postchain::test::variants_that( \
                                 ::postchain::test::more_variants(), have)),       \
                             [](const auto& one) { return one.param.name; })

// Knobs: the parameters of a chain that trade error for time, and the order of its passes.
//
//   chain --steps_from--> chains that differ in one knob by one step
//
// A knob is a row of a pass's parameter table with one of the keys of knob_keys(). The values are
// tried from cheap to expensive: powers of two for whole numbers, choices and booleans in the
// table's order. The code knows no pass.
#pragma once

#include <string>
#include <vector>

#include "chain/pass/chain.h"

namespace postchain::tune {

const std::vector<std::string>& knob_keys();  // samples, starts, neighbors, denoise

// How a step should change the time.
enum class Cost { less, same, more };
struct Step {
    Chain chain;
    Cost cost = Cost::same;
};

// `fixed`: knobs that stay, from fixed_knobs(). `order`: also exchange neighboring passes.
std::vector<Step> steps_from(const Chain& chain, const std::vector<std::string>& fixed, bool order);

// The knobs that arguments of --set name: "joint_blur.samples". A knob of a pass that is in the
// chain twice is fixed in both.
std::vector<std::string> fixed_knobs(const Chain& chain, const std::vector<std::string>& sets);

// Every knob at its closest to the converged image, for experiment::converge(): the most expensive
// value, and no denoising.
Chain without_shortcuts(const Chain& chain);

// "joint_blur samples 32 starts 4 neighbors both denoise true, fxaa"
std::string knobs_text(const Chain& chain);

}  // namespace postchain::tune

// What a frame's passes work with, resolved: every value of lens and shutter and where it is from,
// the longest streak, the largest circle of confusion, from where to where all is sharp. Printed by
// `plan`, and on record in sidecar and output.
#pragma once

#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

struct ResolvedValue {
    std::string key;
    ParameterValue value;  // unset: there is none, as of a far limit that is infinitely far
    std::string unit;
    Origin origin;
};

struct ResolvedPass {
    std::string type;
    bool left_out = false;
    std::vector<ResolvedValue> values;
};

struct Resolved {
    std::vector<ResolvedValue> camera;  // what is stated, whether a pass uses it or not
    std::vector<ResolvedPass> passes;   // in the order of the chain
};

// `plan` is of this chain and frame.
Resolved resolve(const Chain& chain, const SourceFrame& frame, const Plan& plan);

// {"camera": {KEY: {"value", "unit", "from", "where"}}, "passes": [{"pass", "left_out", "values":
// {KEY: ...}}]}
io::Json resolved_json(const Resolved& resolved);
// A line for each value of each pass: key, value and unit, where it is from.
std::string resolved_text(const Resolved& resolved);

}  // namespace postchain::sequence

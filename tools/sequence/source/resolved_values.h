// The resolved values of a frame's passes: every value of lens and shutter with its origin, the
// longest streak, the largest circle of confusion, the depth of field. Printed by `plan`, and
// recorded in sidecar and output.
#pragma once

#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::sequence {

struct ResolvedValue {
    std::string key;
    ParameterValue value;  // unset = none, e.g. an infinite far limit
    std::string unit;
    Origin origin;
};

struct PassValues {
    std::string type;
    bool left_out = false;
    std::vector<ResolvedValue> values;
};

struct ResolvedValues {
    std::vector<ResolvedValue> camera;  // all that is stated, used by a pass or not
    std::vector<PassValues> passes;     // in the order of the chain
};

ResolvedValues resolve_values(const Chain& chain, const SourceFrame& frame, const FramePlan& plan);

// {"camera": {KEY: {"value", "unit", "from", "where"}}, "passes": [{"pass", "left_out", "values":
// {KEY: ...}}]}
io::Json resolved_json(const ResolvedValues& resolved);
// One line for each value of each pass: key, value, unit, origin.
std::string resolved_text(const ResolvedValues& resolved);

}  // namespace postchain::sequence

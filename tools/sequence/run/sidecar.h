// The sidecar of an output frame: what was run, how long it took, what was found, as JSON.
#pragma once

#include <string>

#include "tools/sequence/run/runner.h"

namespace postchain::sequence {

// Keys: frame, outcome, inputs, output, held_from, warnings, output_bytes, work, profile, plan,
// times_ms, health, counters, write_notes, renderer, version. docs/sidecar.md describes each. One
// object, indented.
std::string sidecar_json(const FrameReport& report, const std::string& version);

// The same on one line, without the plan: for --json and --log-format json.
std::string report_line(const FrameReport& report, const RunProgress& progress);

}  // namespace postchain::sequence

// The sidecar of an output frame: what was run, how long it took, what was found, as JSON.
#pragma once

#include <string>

#include "tools/sequence/files/json.h"
#include "tools/sequence/run/frame_report.h"

namespace postchain::sequence {

// Adds "bounds" and "health", as docs/sidecar.md describes them: what sidecar and `inspect` say of
// the pixels that were read.
void add_findings(io::Json& json, const FrameBounds& bounds, const InputHealth& health,
                  const SurfaceHealth& surfaces);

// Keys: frame, outcome, inputs, output, held_from, warnings, output_bytes, work, profile, plan,
// times_ms, bounds, health, counters, write_notes, renderer, version. docs/sidecar.md describes
// each. One object, indented.
std::string sidecar_json(const FrameReport& report, const std::string& version);

// "OUT.exr.json" of OUT.exr.
std::string sidecar_path(const std::string& output);

// The same on one line, without the plan: for --json and --log-format json.
std::string report_line(const FrameReport& report, const RunProgress& progress);

}  // namespace postchain::sequence

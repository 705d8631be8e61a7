// The sidecar of an output frame: plan, times and findings as JSON.
#pragma once

#include <string>

#include "tools/sequence/files/json.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::sequence {

// Adds "bounds" and "health" (docs/sidecar.md), the pixel findings in sidecars and in `inspect`.
void add_findings(io::Json& json, const FrameBounds& bounds, const FrameFindings& findings);

// One indented object. docs/sidecar.md describes its keys: frame, outcome, inputs, output,
// held_from, warnings, output_bytes, work, profile, plan, times_ms, bounds, health, counters,
// write_notes, renderer, version.
std::string sidecar_json(const FrameReport& report, const FrameLayers& layers,
                         const std::string& version);

// "OUT.exr.json" of OUT.exr.
std::string sidecar_path(const std::string& output);

// Whether the file is a sidecar, and not another program's of the same name.
bool is_sidecar(const std::string& path);

// The sidecar without the plan, and the progress: for --json.
io::Json report_json(const FrameReport& report, const RunProgress& progress);

}  // namespace postchain::sequence

// The keys of each kind of body, with the JSON Schema of their values. The reader of bodies
// (job_request.h) refuses every other key.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "chain/parameter.h"
#include "tools/sequence/files/json.h"

namespace postchain::service {

enum class RequestKind { run, ab, bench, study, plan, preview };  // the jobs first, as in JobKind

inline constexpr int kMaxFrameTimeoutS = 86'400;
inline constexpr double kMinPreviewScale = 0.05;  // of RequestKind::preview

using BodyKeys = std::vector<std::pair<std::string, io::Json>>;
// `run_table`: the settings of a run (settings/job_settings.h).
BodyKeys body_keys(RequestKind kind, const ParameterTable& run_table);

// JSON Schema (draft 2020-12) of a job.
io::Json job_schema(const ParameterTable& run_table);

}  // namespace postchain::service

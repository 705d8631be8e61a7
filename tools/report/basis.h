// What every experiment begins with: the input looked at, the truth opened, the exposures of
// HDR-FLIP fixed, and all of it stated in the report.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "tools/report/experiment.h"
#include "tools/report/truth.h"

namespace postchain::report {

struct Basis {
    std::optional<Truth> truth;
    metrics::ExposureRange exposures;                  // the same for all variants and frames
    std::map<int, std::map<Role, std::string>> files;  // of the input, by frame
};

// Fills in all of the report but what the variants bring: folder, command, input, truth, reference,
// device, frames, size, metrics, constants, exposures. Writes nothing. Errors: those of
// survey_input() and of Truth.
Result<Basis> open_basis(Kind kind, const ExperimentSettings& settings, Report& report);

// The input's frame with color and those of `wanted` that it has. Errors (input).
Result<offline::SourceFrame> read_frame(const Basis& basis, const offline::RunSettings& run,
                                        int frame, RoleSet wanted);

}  // namespace postchain::report

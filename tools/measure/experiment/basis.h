// The start of every experiment: surveys the input, opens the ground truth, fixes HDR-FLIP's
// exposures, and records all of it in the report.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/truth.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::experiment {

struct Basis {
    std::optional<Truth> truth;
    metrics::ExposureRange exposures;                  // for all variants and frames
    std::map<int, std::map<Role, std::string>> files;  // of the input, by frame
    std::vector<io::FileStamp> stamps;  // of input and ground truth, before the first was read

    bool has_truth(int frame) const { return truth && truth->has(frame); }
    // Differences over time need consecutive frame numbers with ground truth.
    bool follows(int frame) const { return has_truth(frame) && has_truth(frame - 1); }
};

// Fills in the report except the variants: folder, command, input, truth, reference, device,
// frames, size, metrics, constants, exposures. Writes nothing. Errors: those of survey_input() and
// Truth.
Result<Basis> open_basis(report::Kind kind, const ExperimentSettings& settings,
                         report::Report& report);

// The input's frame with color and the planes of `wanted` that it and its neighbors have. Errors
// (input).
Result<sequence::SourceFrame> read_frame(const Basis& basis, const sequence::RunSettings& run,
                                         int frame, RoleSet wanted);

// "frame 1 is filtered without the frame before: ...", for the report's notes.
std::vector<std::string> notes_on_neighbors(const sequence::SourceFrame& frame);

}  // namespace postchain::experiment

// Results of `inspect`: the contents of a frame's files, how they are interpreted, whether the
// motion vectors have the profile's signs, and which frames of a sequence differ.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/frame/sign_check.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/sequence_survey.h"

namespace postchain::sequence {

// The sequences in a folder, as JSON. Errors (input): the folder cannot be read.
Result<io::Json> inspect_folder(const std::string& folder);

struct InspectedFrame {
    io::Json json;  // as `inspect --json` prints it; after a failure, the files that were opened
    Status status;
    // The rest is that of a frame without a failure.
    std::optional<SourceFrame> source;       // without planes
    std::optional<Result<SignCheck>> signs;  // against the next frame, if that is on disk
};

// Adds the frame to the survey. `files` as in io::FrameList::files.
InspectedFrame inspect_frame(const RunSettings& settings, const std::map<Role, std::string>& files,
                             int frame, SequenceSurvey& survey);

// The frames of a list that a survey reads, by the size of the first frame's files.
std::vector<int> frames_to_survey(const io::FrameList& list);

// Adds every frame after the first. `progress`: called before each frame; false ends the survey
// with StatusCode::canceled.
Status survey_others(const RunSettings& settings, const io::FrameList& list,
                     const std::vector<int>& frames, SequenceSurvey& survey,
                     const std::function<bool(size_t done)>& progress);

}  // namespace postchain::sequence

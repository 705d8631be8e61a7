// Which outputs of a sequence are whole, missing, or made with other settings; from the outputs and
// their sidecars alone.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::sequence {

enum class OutputState {
    whole,
    missing,
    damaged,  // it does not end as it should, or its data cannot be read
    other,    // made by another version, chain or settings than most of the sequence
    foreign,  // not an output of `run`, or that of another frame
};
inline constexpr OutputState kOutputStates[] = {OutputState::whole, OutputState::missing,
                                                OutputState::damaged, OutputState::other,
                                                OutputState::foreign};
const char* name_of(OutputState state);

struct CheckedOutput {
    int frame = 0;
    std::string path;
    OutputState state = OutputState::missing;
    std::string why;             // reason; set in every state but whole
    std::string settings;        // what made it, without the frame's own input; empty = unknown
    std::optional<int> made_as;  // the frame that it was made as; empty = unknown
    uint64_t bytes = 0;
    io::Json sidecar;  // null = none, or that of another image
};

// The frames of `frames`; without them, those from the first to the last on disk. `like`: an output
// whose settings all must have; empty = most of them decide. Errors (input): no frame is on disk
// and none is given; `like` is not an output of `run`.
Result<std::vector<CheckedOutput>> check_outputs(const io::PathPattern& pattern,
                                                 const std::optional<io::FrameRange>& frames,
                                                 const std::string& like);

// A sequence as `check --json` prints it: {"output": pattern, "counts": by state, "frames": [...]}.
io::Json checked_json(const std::string& pattern, const std::vector<CheckedOutput>& outputs);

}  // namespace postchain::sequence

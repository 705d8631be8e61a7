// Texts of a Tuning: the chain file, the front, JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/measure/tune/tune.h"
#include "tools/sequence/files/json.h"

namespace postchain::tune {

// The chosen chain, or the closest that was measured and the remedy.
std::string outcome_text(const Tuning& tuning);
// A line per chain of the front, the fastest first; the chosen one is marked.
std::string front_text(const Tuning& tuning);
// The limits of the figures, a line each.
std::vector<std::string> doubts_of(const Tuning& tuning);
// The chain file of the chosen chain, which must exist, with conditions and front as comments; of a
// stopped search also with every measured chain, for stopped_walk_of().
std::string tuned_chain_file(const Tuning& tuning);
// Empty if `file` is not the text of a stopped search, or has been edited since.
std::optional<StoppedWalk> stopped_walk_of(const std::string& file);
// docs/tune.md lists its keys.
io::Json tuning_json(const Tuning& tuning);

}  // namespace postchain::tune

// A plan on one screen, for people.
#pragma once

#include <optional>
#include <string>

#include "chain/chain.h"
#include "tools/sequence/run/plan_sequence.h"

namespace postchain {

// Of a frame that has a plan: its passes with the parameters that are not the default, what is left
// out of each with the rule and the reason, and what it costs. plan_as_text() has the dispatches
// and textures. The first line is of the frame's number and size; `seconds` as of seconds_of().
std::string plan_summary(const Chain& chain, const sequence::PlannedFrame& planned,
                         const std::optional<sequence::Seconds>& seconds);

// Joins frames whose summaries are the same but for the frame's number: "frame 3: as frame 1".
class PlanSummaries {
  public:
    // What to print for `summary`, as of plan_summary().
    std::string add(int frame, const std::string& summary);

  private:
    int shown_ = 0;  // the frame whose text this is
    std::string text_;
};

}  // namespace postchain

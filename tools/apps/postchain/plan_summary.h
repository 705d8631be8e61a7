// A readable plan on one screen.
#pragma once

#include <optional>
#include <string>

#include "chain/chain.h"
#include "tools/sequence/run/plan_sequence.h"

namespace postchain {

// Summary of a planned frame: the passes with their non-default parameters, what is left out of
// each with rule and reason, and the cost. (plan_as_text() shows dispatches and textures.) The
// first line has the frame's number and size. `seconds`: as from seconds_of().
std::string plan_summary(const Chain& chain, const sequence::PlannedFrame& planned,
                         const std::optional<sequence::Seconds>& seconds);

// Abbreviates a frame whose summary differs only in the number: "frame 3: as frame 1".
class PlanSummaries {
  public:
    std::string add(int frame, const std::string& summary);

  private:
    int shown_ = 0;  // frame whose text this is
    std::string text_;
};

}  // namespace postchain

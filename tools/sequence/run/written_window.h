// The data window of a filtered frame: that of its file and, where it was cropped, as far around it
// as the chain moves light. What lies further is clear before and after.
#pragma once

#include <cstdint>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// Pixels that the passes that run move light at most.
double reach_of(const Chain& chain, const Plan& plan, const SourceFrame& frame);

// As far as the passes that run spread color (Pass::reach), within what was filtered. The file's
// own where no pass runs.
io::Window written_window(const Chain& chain, const Plan& plan, const SourceFrame& frame);

// Pixels of the display window to which the passes may move light and that are not filtered: of a
// cropped frame under DataWindow::keep.
uint64_t pixels_cut_off(const Chain& chain, const Plan& plan, const SourceFrame& frame);

}  // namespace postchain::sequence

// The data window of a filtered frame: the file's, and for a cropped frame grown as far as the
// chain moves light. Pixels outside are clear before and after.
#pragma once

#include <cstdint>

#include "chain/chain.h"
#include "chain/plan.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Largest distance in pixels that the passes of the plan move light.
double reach_of(const Chain& chain, const Plan& plan, const SourceFrame& frame);

// The file's window grown by the reach of the passes that run (Pass::reach), within the filtered
// window. Unchanged if no pass runs.
io::Window written_window(const Chain& chain, const Plan& plan, const SourceFrame& frame);

// Number of display-window pixels, outside the filtered window, that the passes may move light to:
// for a cropped frame under DataWindow::keep.

uint64_t pixels_cut_off(const Chain& chain, const Plan& plan, const SourceFrame& frame);

}  // namespace postchain::sequence

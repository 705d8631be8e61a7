// Comparison with the frame before the chain, another chain, and ground truth.
#pragma once

#include "tools/apps/view/ui_context.h"

namespace postchain::view {

void draw_compare_panel(UiContext& ui);

}  // namespace postchain::view

// The viewer's state as JSON, for programs that drive it.
#pragma once

#include <string>

#include "tools/apps/view/ui.h"

namespace postchain::view {

// `presses`: keys and buttons that went down or up, as far as a frame has drawn them.
std::string state_json(const Session& session, const Ui& ui, int presses);

}  // namespace postchain::view

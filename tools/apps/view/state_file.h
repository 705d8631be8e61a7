// The viewer's state as JSON, for programs that drive it.
#pragma once

#include <array>
#include <string>

#include "tools/apps/view/ui.h"

namespace postchain::view {

// Input as far as a frame has drawn it.
struct DrawnInput {
    int presses = 0;                               // keys and buttons that went down or up
    std::array<float, 2> mouse = {}, window = {};  // place in the window, its size
    bool settled = false;                          // the session knows of it
};
std::string state_json(const Session& session, const Ui& ui, const DrawnInput& input);

}  // namespace postchain::view

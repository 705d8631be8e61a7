// The viewer's window: GLFW, OpenGL 3.3 for the interface, and the loop.
#pragma once

#include <array>
#include <functional>
#include <string>

#include "tools/apps/view/files.h"
#include "tools/apps/view/session.h"

namespace postchain::view {

struct WindowSettings {
    std::array<int, 2> size = {1280, 800};
    double ui_scale = 0;     // 0: the screen's
    std::string state_file;  // empty: none
};

// The settings of a session with other files in place of those that are open. Errors: those of
// reading them.
using SessionOpener = std::function<Result<SessionSettings>(const OpenRequest&)>;

// Shows the session until the window is closed or `stop` is set. Errors (gl): no display, no window
// with OpenGL 3.3, those of Session::open(); (output): the state file.
Status show_window(SessionSettings settings, const SessionOpener& opener,
                   const WindowSettings& window, const std::atomic<bool>& stop);

}  // namespace postchain::view

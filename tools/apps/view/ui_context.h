// Shared by the parts of the window.
#pragma once

#include <imgui.h>

#include <array>
#include <map>
#include <string>

#include "tools/apps/view/session.h"

namespace postchain::view {

struct UiContext {
    Session& session;
    float scale = 1;
    bool focus_tool = false, path = false, flipped = false;
    // Rectangles of widgets by name: x, y, width, height, pixels of the window.
    std::map<std::string, std::array<float, 4>> places = {};

    void mark(const std::string& name);  // the last widget
    void say(const Status& status);
    // The edits while the last widget is held are one step of undo.
    void gesture();
};

}  // namespace postchain::view

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

    // Records the place of the last widget.
    void mark(const std::string& name) {
        const ImVec2 from = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
        if (ImGui::IsItemVisible()) places[name] = {from.x, from.y, size.x, size.y};
    }
    // The tooltip of the last widget.
    static void tip(const std::string& text, ImGuiHoveredFlags flags = 0) {
        if (ImGui::IsItemHovered(flags)) ImGui::SetTooltip("%s", text.c_str());
    }
    void say(const Status& status) {
        if (!status.ok()) session.say(status.message(), true);
    }
    // The edits while the last widget is held are one step of undo.
    void gesture() {
        if (ImGui::IsItemActivated()) session.document().begin_gesture();
        if (ImGui::IsItemDeactivated()) session.document().end_gesture();
    }
};

}  // namespace postchain::view

// Shared by the parts of the window.
#pragma once

#include <imgui.h>

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "tools/apps/view/fonts.h"
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
    // The text is shown: its letters need a font.
    void needs(const std::string& text) { new_letters = add_letters(text, letters) || new_letters; }
    void say(const Status& status) {
        if (!status.ok()) session.messages().say(status.message(), true);
    }
    // The edits while the last widget is held are one step of undo.
    void gesture() {
        if (ImGui::IsItemActivated()) {
            session.document().begin_gesture();
            const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
            pressed = Press{{from.x, from.y, to.x, to.y}, session.document().revision()};
        }
        if (ImGui::IsItemDeactivated()) session.document().end_gesture();
    }
    // The first click of a double click has moved the slider under it: that is taken back, before
    // the widgets are drawn.
    void begin_frame() {
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        if (!pressed || !ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) return;
        const auto& [left, top, right, bottom] = pressed->rect;
        if (mouse.x >= left && mouse.x < right && mouse.y >= top && mouse.y < bottom &&
            session.document().revision() > pressed->revision)
            session.document().undo();
        pressed.reset();
    }

    std::set<ImWchar> letters = {};
    bool new_letters = false;
    // The widget that went down last, and the document's revision then.
    struct Press {
        std::array<float, 4> rect;
        uint64_t revision;
    };
    std::optional<Press> pressed = {};
};

// While this lives a double click into the next slider types its value, as Ctrl and a click do.
class TypesOnDoubleClick {
  public:
    TypesOnDoubleClick() : ctrl_(ImGui::GetIO().KeyCtrl) {
        const ImVec2 at = ImGui::GetCursorScreenPos();
        if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left) &&
            ImGui::IsMouseHoveringRect(
                at, {at.x + ImGui::CalcItemWidth(), at.y + ImGui::GetFrameHeight()}))
            ImGui::GetIO().KeyCtrl = true;
    }
    ~TypesOnDoubleClick() { ImGui::GetIO().KeyCtrl = ctrl_; }
    TypesOnDoubleClick(const TypesOnDoubleClick&) = delete;
    TypesOnDoubleClick& operator=(const TypesOnDoubleClick&) = delete;

  private:
    const bool ctrl_;
};

}  // namespace postchain::view

#include "tools/apps/view/ui_context.h"

namespace postchain::view {

void UiContext::mark(const std::string& name) {
    const ImVec2 from = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
    if (ImGui::IsItemVisible()) places[name] = {from.x, from.y, size.x, size.y};
}

void UiContext::say(const Status& status) {
    if (!status.ok()) session.say(status.message(), true);
}

void UiContext::gesture() {
    if (ImGui::IsItemActivated()) session.document().begin_gesture();
    if (ImGui::IsItemDeactivated()) session.document().end_gesture();
}

}  // namespace postchain::view

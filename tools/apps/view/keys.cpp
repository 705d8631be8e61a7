#include "tools/apps/view/keys.h"

namespace postchain::view {
namespace {

#if IMGUI_VERSION_NUM >= 18700
constexpr ImGuiKey kKeypadEnter = ImGuiKey_KeypadEnter;
#else
constexpr ImGuiKey kKeypadEnter = ImGuiKey_KeyPadEnter;
#endif

}  // namespace

bool is_pressed(ImGuiKey key) {
    return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key), false) ||
           (key == ImGuiKey_Enter && ImGui::IsKeyPressed(ImGui::GetKeyIndex(kKeypadEnter), false));
}

void take_keys(const std::vector<KeyAction>& actions) {
    const ImGuiIO& io = ImGui::GetIO();
    for (const KeyAction& action : actions)
        if (action.ctrl == io.KeyCtrl && action.shift == io.KeyShift && !io.KeyAlt &&
            ImGui::IsKeyPressed(ImGuiKey(action.key), action.repeats))
            action.act();
}

void draw_key_list(UiContext& ui, const std::vector<KeyAction>& actions, bool& open) {
    const ImVec2 whole = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({whole.x / 2, whole.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSizeConstraints({0, 0}, {whole.x * 0.95f, whole.y * 0.95f});
    ImGui::Begin("Keys", &open,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoCollapse);
    if (ImGui::BeginTable("keys", 4, ImGuiTableFlags_SizingFixedFit)) {
        std::vector<std::pair<std::string, std::string>> rows;
        for (const KeyAction& action : actions)
            if (action.what.empty())
                rows.back().first += ", " + action.name;
            else
                rows.emplace_back(action.name, action.what);
        rows.emplace_back("?", "this list");
        rows.emplace_back("wheel", "zoom to the cursor");
        rows.emplace_back("drag", "pan, or move the wipe");
        rows.emplace_back("double click", "type a slider's value");
        const size_t half = (rows.size() + 1) / 2;
        for (size_t i = 0; i < half; ++i) {
            ImGui::TableNextRow();
            for (const size_t at : {i, i + half}) {
                ImGui::TableNextColumn();
                if (at >= rows.size()) continue;
                ImGui::TextDisabled("%s  ", rows[at].first.c_str());
                ImGui::TableNextColumn();
                ImGui::Text("%s     ", rows[at].second.c_str());
            }
        }
        ImGui::EndTable();
    }
    if (is_pressed(ImGuiKey_Escape)) open = false;
    ImGui::End();
    ui.places["keys"] = {0, 0, 0, 0};
}

}  // namespace postchain::view

#include "tools/apps/view/compare_panel.h"

#include "tools/measure/metrics/compare.h"

namespace postchain::view {

void draw_compare_panel(UiContext& ui) {
    ViewChoice& view = ui.session.view();
    const auto choice = [&](const char* name, Compare compare, const char* help) {
        if (ImGui::RadioButton(name, view.compare == compare)) view.compare = compare;
        ui.mark(std::string("compare ") + name);
        if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", help);
    };
    choice("off", Compare::off, "the result alone");
    ImGui::SameLine();
    choice("wipe", Compare::wipe, "W: drag the line over the picture");
    ImGui::SameLine();
    choice("flip", Compare::flip, "X: the other picture as long as the box is checked");
    ImGui::SameLine();
    choice("difference", Compare::difference, "D: an error map");
    if (view.compare == Compare::flip) {
        ImGui::Checkbox("show the other", &ui.flipped);
        ui.mark("flipped");
    }
    ImGui::Separator();
    ImGui::TextUnformatted("the result with");
    const auto with = [&](const char* name, With what, bool can) {
        ImGui::BeginDisabled(!can);
        if (ImGui::RadioButton(name, view.with == what)) view.with = what;
        ImGui::EndDisabled();
        ui.mark(std::string("with ") + name);
    };
    with("the frame before the chain", With::before, true);
    with("chain B", With::other_chain, ui.session.has_other_chain());
    ImGui::SameLine();
    if (ImGui::SmallButton("hold this chain as B")) {
        ui.session.hold_chain();
        view.with = With::other_chain;
    }
    ui.mark("hold");
    with("ground truth", With::truth, ui.session.has_truth());
    if (!ui.session.has_truth()) ImGui::TextDisabled("ground truth: open with --truth IN");
    ImGui::Separator();
    ImGui::SetNextItemWidth(-110 * ui.scale);
    if (ImGui::BeginCombo("error map", view.map.c_str())) {
        for (const auto& row : metrics::map_rows()) {
            if (ImGui::Selectable(row.name.c_str(), row.name == view.map)) view.map = row.name;
            if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", row.help.c_str());
        }
        ImGui::EndCombo();
    }
    const Painted& painted = ui.session.painted();
    if (view.compare == Compare::off || painted.metrics.empty()) return;
    ImGui::Text("of the %d x %d pixels on screen:", view.visible.width, view.visible.height);
    for (const auto& [name, value] : painted.metrics) {
        if (value)
            ImGui::Text("%-8s %.4g", name.c_str(), *value);
        else
            ImGui::Text("%-8s equal", name.c_str());
    }
    if (!painted.legend.empty()) ImGui::TextWrapped("%s", painted.legend.c_str());
}

}  // namespace postchain::view

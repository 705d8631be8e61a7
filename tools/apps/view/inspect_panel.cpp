#include "tools/apps/view/inspect_panel.h"

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

#include "chain/plan/elision.h"
#include "tools/apps/view/session_values.h"
#include "tools/sequence/source/memory.h"

namespace postchain::view {
namespace {

constexpr size_t kHistory = 120;
constexpr size_t kInterfaceHistory = 1000;

void plot_times(const std::deque<float>& times, const char* text, ImVec2 size) {
    const std::vector<float> values(times.begin(), times.end());
    ImGui::PlotLines("##times", values.data(), int(values.size()), 0, text, 0,
                     *std::max_element(values.begin(), values.end()) * 1.1f, size);
}

}  // namespace

void InspectPanel::draw() {
    draw_view();
    ImGui::Separator();
    draw_times();
    ImGui::Separator();
    draw_plan();
}

void InspectPanel::note_times() {
    const Shown& shown = ui_.session.shown();
    if (!shown.draft && std::exchange(in_history_, shown.request) != shown.request) {
        const auto keep = [](std::deque<float>& list, double ms) {
            list.push_back(float(ms));
            if (list.size() > kHistory) list.pop_front();
        };
        keep(history_, shown.milliseconds);
        for (const PassTime& time : shown.times) keep(step_history_[time.name], time.milliseconds);
    }
}

void InspectPanel::add_interface_ms(double ms) {
    // The first ones compile the interface's own programs and answer nothing.
    if (first_ > 0) {
        --first_;
        return;
    }
    interface_ms_.push_back(ms);
    if (interface_ms_.size() > kInterfaceHistory) interface_ms_.pop_front();
    slowest_ms_ = std::max(slowest_ms_, ms);
}

void InspectPanel::draw_view() {
    ViewChoice& view = ui_.session.view();
    const auto item = [&](const std::string& name) {
        if (ImGui::Selectable(name.c_str(), name == view.plane)) view.plane = name;
        ui_.mark("view " + name);
    };
    ImGui::SetNextItemWidth(-60 * ui_.scale);
    const bool open = ImGui::BeginCombo("view", view.plane.c_str(), ImGuiComboFlags_HeightLarge);
    ui_.mark("view");
    if (open) {
        item("result");
        for (const std::string& plane : planes_of(ui_.session)) item(plane);
        item(kFillMask);
        ImGui::Separator();
        if (ui_.session.shown().plan)
            for (const PlanTexture& texture : ui_.session.shown().plan->textures)
                if (!texture.imported && texture.format != Format::work_list) item(texture.name);
        ImGui::EndCombo();
    }
    if (view.plane != "result") ImGui::TextWrapped("%s", ui_.session.painted().legend.c_str());
    auto stops = float(view.display.exposure_stops);
    ImGui::SetNextItemWidth(-60 * ui_.scale);
    if (ImGui::SliderFloat("stops", &stops, -10, 10, "exposure %+.2f"))
        view.display.exposure_stops = shortest_double(stops);
    ui_.mark("exposure");
    if (ImGui::IsItemClicked(ImGuiMouseButton_Right)) view.display.exposure_stops = 0;
    const bool has_ocio = ui_.session.settings().run.view.has_value();
    const char* curve = view.display.view                              ? "OpenColorIO"
                        : view.display.curve == io::ToneCurve::display ? "tone mapped"
                        : view.display.curve == io::ToneCurve::gamma   ? "gamma 2.2"
                                                                       : "linear";
    ImGui::SetNextItemWidth(-60 * ui_.scale);
    if (ImGui::BeginCombo("curve", curve)) {
        const auto option = [&](const char* name, io::ToneCurve chosen) {
            if (!ImGui::Selectable(name)) return;
            view.display.curve = chosen;
            view.display.view.reset();
        };
        option("tone mapped", io::ToneCurve::display);
        option("gamma 2.2", io::ToneCurve::gamma);
        option("linear", io::ToneCurve::none);
        if (has_ocio && ImGui::Selectable("OpenColorIO"))
            view.display.view = ui_.session.settings().run.view;
        ImGui::EndCombo();
    }
    ImGui::Checkbox("focus by click (T)", &ui_.focus_tool);
    ui_.mark("focus tool");
    ImGui::Checkbox("limits of sharpness (N)", &view.limits);
    ui_.mark("limits");
    ImGui::Checkbox("motion path under the cursor (M)", &ui_.path);
    ui_.mark("path");
}

void InspectPanel::draw_times() {
    const Shown& shown = ui_.session.shown();
    ImGui::Text("filter %.1f ms%s", shown.milliseconds, shown.draft ? " (draft)" : "");
    if (history_.size() > 1) {
        plot_times(history_, "ms of refined frames",
                   {ImGui::GetContentRegionAvail().x, 48 * ui_.scale});
    }
    double all = 0;
    for (const PassTime& time : shown.times) all += time.milliseconds;
    for (const PassTime& time : shown.times) {
        char text[32];
        std::snprintf(text, sizeof(text), "%.2f ms", time.milliseconds);
        ImGui::ProgressBar(all > 0 ? float(time.milliseconds / all) : 0, {90 * ui_.scale, 0}, text);
        if (ImGui::IsItemHovered() && step_history_[time.name].size() > 1) {
            ImGui::BeginTooltip();
            plot_times(step_history_[time.name], time.name.c_str(),
                       {240 * ui_.scale, 60 * ui_.scale});
            ImGui::EndTooltip();
        }
        ImGui::SameLine();
        ImGui::TextUnformatted(time.name.c_str());
    }
    const uint64_t textures = shown.counters.texture_bytes_peak;
    ImGui::TextWrapped("textures %s, %d alive; frames kept %s",
                       sequence::bytes_text(textures).c_str(), int(shown.counters.textures_alive),
                       sequence::bytes_text(ui_.session.frame_bytes()).c_str());
    if (!interface_ms_.empty())
        ImGui::Text("interface %.1f ms, slowest %.1f ms", interface_ms_.back(), slowest_ms_);
    ImGui::TextWrapped("%s", ui_.session.renderer().c_str());
}

void InspectPanel::draw_plan() {
    const auto& plan = ui_.session.shown().plan;
    if (!plan) return ImGui::TextDisabled("no plan yet");
    ImGui::Text("%d steps, %s at most", int(plan->steps.size()),
                sequence::bytes_text(plan->peak_bytes()).c_str());
    for (size_t i = 0; i < plan->passes.size(); ++i)
        ImGui::BulletText("%s%s", plan->passes[i].type.c_str(),
                          plan->passes[i].elided ? ": left out" : "");
    ImGui::TextUnformatted("left out:");
    bool any = false;
    for (const Elision& one : plan->elisions) {
        const auto found = found_in(one, *plan, ui_.session.shown().work_done);
        if (!found) continue;
        any = true;
        ImGui::Bullet();
        ImGui::TextWrapped("%s: %s", item_text(*found, *plan).c_str(),
                           text_of(found->fact).c_str());
    }
    if (!any) ImGui::TextDisabled("nothing");
    for (const auto& [neighbor, why] : plan->missing_neighbors)
        ImGui::TextWrapped("no frame %s: %s", name_of(neighbor), why.c_str());
}

}  // namespace postchain::view

// Comparison, inspection, and what is saved.
#include <imgui_stdlib.h>

#include <algorithm>
#include <cstdio>

#include "chain/elision.h"
#include "tools/apps/view/save.h"
#include "tools/apps/view/ui.h"
#include "tools/measure/metrics/compare.h"
#include "tools/sequence/run/memory.h"

namespace postchain::view {

void Ui::compare_tab() {
    ViewChoice& view = session_.view();
    const auto choice = [&](const char* name, Compare compare, const char* help) {
        if (ImGui::RadioButton(name, view.compare == compare)) view.compare = compare;
        mark(std::string("compare ") + name);
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
        ImGui::Checkbox("show the other", &flipped_);
        mark("flipped");
    }
    ImGui::Separator();
    ImGui::TextUnformatted("the result with");
    const auto with = [&](const char* name, With what, bool can) {
        ImGui::BeginDisabled(!can);
        if (ImGui::RadioButton(name, view.with == what)) view.with = what;
        ImGui::EndDisabled();
        mark(std::string("with ") + name);
    };
    with("the frame before the chain", With::before, true);
    with("chain B", With::other_chain, session_.has_other_chain());
    ImGui::SameLine();
    if (ImGui::SmallButton("hold this chain as B")) {
        session_.hold_chain();
        view.with = With::other_chain;
    }
    mark("hold");
    with("ground truth", With::truth, session_.has_truth());
    if (!session_.has_truth()) ImGui::TextDisabled("ground truth: open with --truth IN");
    ImGui::Separator();
    ImGui::SetNextItemWidth(-110 * scale_);
    if (ImGui::BeginCombo("error map", view.map.c_str())) {
        for (const auto& row : metrics::map_rows()) {
            if (ImGui::Selectable(row.name.c_str(), row.name == view.map)) view.map = row.name;
            if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", row.help.c_str());
        }
        ImGui::EndCombo();
    }
    const Painted& painted = session_.painted();
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

void Ui::inspect_tab() {
    ViewChoice& view = session_.view();
    const auto item = [&](const std::string& name) {
        if (ImGui::Selectable(name.c_str(), name == view.plane)) view.plane = name;
        mark("view " + name);
    };
    ImGui::SetNextItemWidth(-60 * scale_);
    const bool open = ImGui::BeginCombo("view", view.plane.c_str(), ImGuiComboFlags_HeightLarge);
    mark("view");
    if (open) {
        item("result");
        for (const std::string& plane : session_.planes()) item(plane);
        item(kFillMask);
        ImGui::Separator();
        if (session_.shown().plan)
            for (const PlanTexture& texture : session_.shown().plan->textures)
                if (!texture.imported && texture.format != Format::work_list) item(texture.name);
        ImGui::EndCombo();
    }
    if (view.plane != "result") ImGui::TextWrapped("%s", session_.painted().legend.c_str());
    auto stops = float(view.display.exposure_stops);
    ImGui::SetNextItemWidth(-60 * scale_);
    if (ImGui::SliderFloat("stops", &stops, -10, 10, "exposure %+.2f"))
        view.display.exposure_stops = double(stops);
    mark("exposure");
    if (ImGui::IsItemClicked(ImGuiMouseButton_Right)) view.display.exposure_stops = 0;
    const bool has_ocio = session_.settings().run.view.has_value();
    const char* curve = view.display.view                              ? "OpenColorIO"
                        : view.display.curve == io::ToneCurve::display ? "tone mapped"
                        : view.display.curve == io::ToneCurve::gamma   ? "gamma 2.2"
                                                                       : "linear";
    ImGui::SetNextItemWidth(-60 * scale_);
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
            view.display.view = session_.settings().run.view;
        ImGui::EndCombo();
    }
    if (view.display.view) ImGui::TextDisabled("OpenColorIO's view has its own exposure");
    ImGui::Checkbox("focus by click (F)", &focus_tool_);
    mark("focus tool");
    ImGui::Checkbox("limits of sharpness (L)", &view.limits);
    mark("limits");
    ImGui::Checkbox("motion path under the cursor (P)", &path_);
    mark("path");
    ImGui::Separator();
    times_view();
    ImGui::Separator();
    plan_view();
}

void Ui::times_view() {
    const Shown& shown = session_.shown();
    ImGui::Text("filter %.1f ms%s", shown.milliseconds, shown.draft ? " (draft)" : "");
    if (history_.size() > 1) {
        const std::vector<float> values(history_.begin(), history_.end());
        ImGui::PlotLines("##history", values.data(), int(values.size()), 0, "ms of refined frames",
                         0, *std::max_element(values.begin(), values.end()) * 1.1f,
                         {ImGui::GetContentRegionAvail().x, 48 * scale_});
    }
    double all = 0;
    for (const PassTime& time : shown.times) all += time.milliseconds;
    for (const PassTime& time : shown.times) {
        char text[32];
        std::snprintf(text, sizeof(text), "%.2f ms", time.milliseconds);
        ImGui::ProgressBar(all > 0 ? float(time.milliseconds / all) : 0, {90 * scale_, 0}, text);
        ImGui::SameLine();
        ImGui::TextUnformatted(time.name.c_str());
    }
    const uint64_t textures = shown.counters.texture_bytes_peak;
    ImGui::Text("textures %s, %d alive; frames kept %s", sequence::bytes_text(textures).c_str(),
                int(shown.counters.textures_alive),
                sequence::bytes_text(session_.frame_bytes()).c_str());
    if (!interface_ms_.empty())
        ImGui::Text("interface %.1f ms, slowest %.1f ms", interface_ms_.back(), slowest_ms_);
    ImGui::TextDisabled("%s", session_.renderer().c_str());
}

void Ui::plan_view() {
    const auto& plan = session_.shown().plan;
    if (!plan) return ImGui::TextDisabled("no plan yet");
    ImGui::Text("%d steps, %s at most", int(plan->steps.size()),
                sequence::bytes_text(plan->peak_bytes()).c_str());
    for (size_t i = 0; i < plan->passes.size(); ++i)
        ImGui::BulletText("%s%s", plan->passes[i].type.c_str(),
                          plan->passes[i].elided ? ": left out" : "");
    ImGui::TextUnformatted("left out:");
    bool any = false;
    for (const Elision& one : plan->elisions) {
        const auto found = found_in(one, *plan, session_.shown().work_done);
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

void Ui::save_button(const char* name, const char* label, std::string& path, const char* hint,
                     const std::function<void(const std::string&)>& save) {
    ImGui::PushID(name);
    ImGui::TextUnformatted(label);
    ImGui::SetNextItemWidth(-58 * scale_);
    ImGui::InputText("##path", &path);
    mark(std::string(name) + " path");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", hint);
    ImGui::SameLine();
    if (ImGui::Button("save")) save(path);
    mark(std::string("save ") + name);
    ImGui::PopID();
}

void Ui::start_export(ExportKind kind, const std::string& path) {
    ExportJob job;
    job.kind = kind;
    job.path = path;
    job.replace = replace_;
    const bool all = kind == ExportKind::sheet || kind == ExportKind::movie ||
                     path.find('#') != std::string::npos;
    job.frames = all ? session_.frames() : std::vector<int>{session_.frame()};
    for (const int frame : job.frames)
        job.chains[frame] = std::make_shared<const Chain>(session_.document().chain_at(frame));
    job.run = session_.settings().run;
    job.display = session_.view().display;
    job.fps = session_.fps();
    job.context = session_.settings().context;
    if (!exporter_.start(std::move(job))) session_.say("another file is being written", true);
}

void Ui::save_tab() {
    ImGui::Checkbox("replace existing files", &replace_);
    mark("replace");
    save_button("chain", "chain file (Ctrl+S)", chain_path_, "comments are kept",
                [&](const std::string& path) { say(session_.save_chain(path, replace_)); });
    Document& document = session_.document();
    if (!document.state().focus_keys.empty()) {
        ImGui::Separator();
        ImGui::TextUnformatted("focus keys");
        for (const auto& [frame, distance] : document.state().focus_keys) {
            ImGui::PushID(frame);
            ImGui::Text("frame %d: %.4g", frame, distance);
            ImGui::SameLine();
            const bool removes = ImGui::SmallButton("x");
            ImGui::PopID();
            if (removes) {
                document.remove_focus_key(frame);
                break;
            }
        }
        save_button("camera", "camera file with the keys", camera_path_,
                    "a focus distance for every frame; use it with --camera",
                    [&](const std::string& path) {
                        const Status status = session_.save_camera(path, replace_);
                        say(status);
                        if (status.ok()) session_.say(path + ": saved");
                    });
        ImGui::Separator();
    }
    save_button("frames", "frame, as postchain run writes it", frames_path_,
                "a name with #### is of all frames; without, of this one",
                [&](const std::string& path) { start_export(ExportKind::frames, path); });
    save_button("png", "frame as PNG, as shown", png_path_, "with exposure and view transform",
                [&](const std::string& path) { start_export(ExportKind::png, path); });
    save_button("sheet", "contact sheet of all frames", sheet_path_, "a PNG",
                [&](const std::string& path) { start_export(ExportKind::sheet, path); });
    auto fps = float(session_.fps());
    ImGui::SetNextItemWidth(-58 * scale_);
    if (ImGui::SliderFloat("##fps", &fps, 1, 120, "%.3g frames per second"))
        session_.set_fps(double(fps));
    save_button("movie", "movie of all frames", movie_path_, "an MP4, by the command ffmpeg",
                [&](const std::string& path) { start_export(ExportKind::movie, path); });
    const ExportState state = exporter_.state();
    if (state.running) {
        ImGui::ProgressBar(state.total > 0 ? float(state.done) / float(state.total) : 0);
        if (ImGui::Button("stop")) exporter_.cancel();
    }
    ImGui::PushTextWrapPos(0);
    ImGui::TextColored(state.failed ? ImVec4(1, 0.55f, 0.5f, 1) : ImVec4(1, 1, 1, 1), "%s",
                       state.text.c_str());
    ImGui::PopTextWrapPos();
}

}  // namespace postchain::view

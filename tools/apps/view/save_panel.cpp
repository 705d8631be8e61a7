#include "tools/apps/view/save_panel.h"

#include <imgui_stdlib.h>

#include "tools/apps/view/session_values.h"

namespace postchain::view {

SavePanel::SavePanel(UiContext& ui, FileDialog& dialog, std::function<void()> wake)
    : ui_(ui), dialog_(dialog), exporter_(std::move(wake)) {
    const OpenChain& chain = ui.session.open_chain();
    chain_path_ = chain.is_file() ? chain.name() : chain.name() + ".yaml";
}

bool SavePanel::save_chain() {
    const Status status = ui_.session.open_chain().save(chain_path_, replace_);
    ui_.say(status);
    return status.ok();
}

bool SavePanel::save_keys() {
    const Status status = save_camera(ui_.session, camera_path_, replace_);
    ui_.say(status);
    if (status.ok()) ui_.session.messages().say(camera_path_ + ": saved");
    return status.ok();
}

void SavePanel::save_button(const char* name, const char* label, std::string& path, FileKind kind,
                            const char* hint, const std::function<void(const std::string&)>& save) {
    ImGui::PushID(name);
    ImGui::TextUnformatted(label);
    const ImGuiStyle& style = ImGui::GetStyle();
    ImGui::SetNextItemWidth(-ImGui::CalcTextSize("...Save").x - 4 * style.FramePadding.x -
                            2 * style.ItemSpacing.x);
    ImGui::InputText("##path", &path);
    ui_.mark(std::string(name) + " path");
    ui_.tip(hint);
    ImGui::SameLine();
    if (ImGui::Button("..."))
        dialog_.ask(kind, true, path, [&path, save](const std::string& chosen) {
            path = chosen;
            save(chosen);
        });
    ui_.mark(std::string(name) + " dialog");
    ui_.tip("choose a folder and a name");
    ImGui::SameLine();
    if (ImGui::Button("Save")) save(path);
    ui_.mark(std::string("save ") + name);
    ImGui::PopID();
}

void SavePanel::start_export(ExportKind kind, const std::string& path) {
    ExportJob job;
    job.kind = kind;
    job.path = path;
    job.replace = replace_;
    const auto pattern = io::PathPattern::parse(path);
    const bool all = kind == ExportKind::sheet || kind == ExportKind::movie ||
                     (pattern.ok() && pattern->has_token());
    const Playback& playback = ui_.session.playback();
    job.frames = all ? playback.frames() : std::vector<int>{playback.frame()};
    for (const int frame : job.frames)
        job.chains[frame] = std::make_shared<const Chain>(ui_.session.document().chain_at(frame));
    job.run = ui_.session.settings().run;
    job.display = ui_.session.view().display;
    job.fps = playback.fps();
    job.context = ui_.session.settings().context;
    if (!exporter_.start(std::move(job)))
        ui_.session.messages().say("another file is being written", true);
}

void SavePanel::draw() {
    ImGui::Checkbox("replace existing files", &replace_);
    ui_.mark("replace");
    save_button("chain", "chain file (Ctrl+S)", chain_path_, FileKind::chain, "comments are kept",
                [&](const std::string&) { save_chain(); });
    Document& document = ui_.session.document();
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
        save_button("camera", "camera file with the keys", camera_path_, FileKind::camera,
                    "a focus distance for every frame; give it as the camera file",
                    [&](const std::string&) { save_keys(); });
        ImGui::Separator();
    }
    save_button("frames", "frame, as postchain run writes it", frames_path_, FileKind::frames,
                "a name with #### is of all frames; without, of this one",
                [&](const std::string& path) { start_export(ExportKind::frames, path); });
    save_button("png", "frame as PNG, as shown", png_path_, FileKind::frames,
                "with exposure and view transform",
                [&](const std::string& path) { start_export(ExportKind::png, path); });
    save_button("sheet", "contact sheet of all frames", sheet_path_, FileKind::frames, "a PNG",
                [&](const std::string& path) { start_export(ExportKind::sheet, path); });
    auto fps = float(ui_.session.playback().fps());
    ImGui::SetNextItemWidth(-58 * ui_.scale);
    if (ImGui::SliderFloat("##fps", &fps, 1, 120, "%.3g frames per second"))
        ui_.session.playback().set_fps(shortest_double(fps));
    save_button("movie", "movie of all frames", movie_path_, FileKind::frames,
                "an MP4, by the command ffmpeg",
                [&](const std::string& path) { start_export(ExportKind::movie, path); });
    const ExportState state = exporter_.state();
    if (state.running) {
        ImGui::ProgressBar(state.total > 0 ? float(state.done) / float(state.total) : 0);
        if (ImGui::Button("Stop")) exporter_.cancel();
    }
    ImGui::PushTextWrapPos(0);
    ImGui::TextColored(state.failed ? ImVec4(1, 0.55f, 0.5f, 1) : ImVec4(1, 1, 1, 1), "%s",
                       state.text.c_str());
    ImGui::PopTextWrapPos();
}

}  // namespace postchain::view

#include "tools/apps/view/ui.h"

#include <algorithm>

#include "tools/apps/view/session_values.h"
#include "tools/measure/metrics/compare.h"

namespace postchain::view {
namespace {

constexpr float kSide = 372, kBottom = 80;  // pixels at scale 1

// Begins a panel without decoration at a fixed place.
void begin_panel(const char* name, ImVec2 at, ImVec2 size, ImGuiWindowFlags more) {
    ImGui::SetNextWindowPos(at);
    ImGui::SetNextWindowSize(size);
    ImGui::Begin(name, nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | more);
}

// Comparison with the frame before the chain, another chain, and ground truth.
void draw_compare_panel(UiContext& ui) {
    ViewChoice& view = ui.session.view();
    const auto choice = [&](const char* name, Compare compare, const char* help) {
        if (ImGui::RadioButton(name, view.compare == compare)) view.compare = compare;
        ui.mark(std::string("compare ") + name);
        ui.tip(help);
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
    const auto with = [&](const char* name, CompareTarget what, bool can) {
        ImGui::BeginDisabled(!can);
        if (ImGui::RadioButton(name, view.target == what)) view.target = what;
        ImGui::EndDisabled();
        ui.mark(std::string("with ") + name);
    };
    with("the frame before the chain", CompareTarget::before, true);
    with("chain B", CompareTarget::other_chain, ui.session.has_other_chain());
    ImGui::SameLine();
    if (ImGui::SmallButton("keep this chain as B")) {
        ui.session.keep_as_other_chain();
        view.target = CompareTarget::other_chain;
    }
    ui.mark("keep");
    with("ground truth", CompareTarget::truth, ui.session.has_truth());
    if (!ui.session.has_truth()) ImGui::TextDisabled("ground truth: open with --truth IN");
    ImGui::Separator();
    ImGui::SetNextItemWidth(-110 * ui.scale);
    if (ImGui::BeginCombo("error map", view.map.c_str())) {
        for (const auto& row : metrics::map_rows()) {
            if (ImGui::Selectable(row.name.c_str(), row.name == view.map)) view.map = row.name;
            ui.tip(row.help);
        }
        ImGui::EndCombo();
    }
    const Painted& painted = ui.session.painted();
    if (view.compare == Compare::off || painted.metrics.empty()) return;
    ImGui::Text("of the %d x %d pixels on screen:", view.visible.width, view.visible.height);
    for (const auto& [name, value] : painted.metrics)
        if (value)
            ImGui::Text("%-8s %.4g", name.c_str(), *value);
        else
            ImGui::Text("%-8s equal", name.c_str());
    if (!painted.legend.empty()) ImGui::TextWrapped("%s", painted.legend.c_str());
}

}  // namespace

void Ui::ask_to_close() {
    const Document& document = ui_.session.document();
    closing_ = document.changed() || document.keys_changed();
    close_ = !closing_;
}

void Ui::shortcuts() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput || closing_) return;
    const auto pressed = [](ImGuiKey key, bool repeats) {
        return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key), repeats);
    };
    // GLFW's numbers of letters are those of ASCII. Held down, they count once.
    const auto letter = [](char c) { return ImGui::IsKeyPressed(c, false); };
    Document& document = ui_.session.document();
    if (io.KeyCtrl) {
        if (letter('Z')) io.KeyShift ? document.redo() : document.undo();
        if (letter('Y')) document.redo();
        if (letter('S')) save_.save_chain();
        if (letter('Q')) ask_to_close();
        return;
    }
    if (pressed(ImGuiKey_Space, false)) ui_.session.play(ui_.session.playing() == 0 ? 1 : 0);
    if (pressed(ImGuiKey_LeftArrow, true)) ui_.session.step(-1);
    if (pressed(ImGuiKey_RightArrow, true)) ui_.session.step(1);
    if (letter('0')) picture_.port().fit();
    if (letter('1')) picture_.port().one_to_one();
    if (letter('F')) ui_.focus_tool = !ui_.focus_tool;
    if (letter('L')) ui_.session.view().limits = !ui_.session.view().limits;
    if (letter('P')) ui_.path = !ui_.path;
    Compare& compare = ui_.session.view().compare;
    if (letter('W')) compare = compare == Compare::wipe ? Compare::off : Compare::wipe;
    if (letter('D')) compare = compare == Compare::difference ? Compare::off : Compare::difference;
    if (letter('X')) {
        if (compare != Compare::flip) ui_.flipped = false;
        compare = Compare::flip;
        ui_.flipped = !ui_.flipped;
    }
}

void Ui::draw(float width, float height, float scale) {
    ui_.scale = scale;
    ui_.places.clear();
    shortcuts();
    const float side = std::min(kSide * scale, width * 0.6f);
    const float bottom = std::min(kBottom * scale, height * 0.5f);
    inspect_.note_times();
    // A window of a few pixels has no room for panels.
    if (width < 4 || height < 4) return;
    picture_.draw(0, 0, width - side, height - bottom);
    draw_side(width - side, 0, side, height);
    draw_bottom(0, height - bottom, width - side, bottom);
    draw_messages(0, 0, width - side);
    if (closing_) draw_closing(width, height);
}

void Ui::draw_side(float x, float y, float width, float height) {
    begin_panel("side", {x, y}, {width, height}, ImGuiWindowFlags_NoBringToFrontOnFocus);
    Document& document = ui_.session.document();
    ImGui::BeginDisabled(!document.can_undo());
    if (ImGui::Button("undo")) document.undo();
    ui_.mark("undo");
    ui_.tip("Ctrl+Z: " + document.undo_name(), ImGuiHoveredFlags_AllowWhenDisabled);
    ImGui::EndDisabled();
    ImGui::SameLine();
    ImGui::BeginDisabled(!document.can_redo());
    if (ImGui::Button("redo")) document.redo();
    ui_.mark("redo");
    ui_.tip("Ctrl+Y: " + document.redo_name(), ImGuiHoveredFlags_AllowWhenDisabled);
    ImGui::EndDisabled();
    ImGui::SameLine();
    if (ImGui::Button(document.changed() ? "save *" : "save")) save_.save_chain();
    ui_.mark("save");
    ui_.tip("Ctrl+S: " + save_.chain_path());
    ImGui::SameLine();
    ImGui::TextDisabled("%s", ui_.session.settings().chain_name.c_str());
    if (ImGui::BeginTabBar("tabs")) {
        const auto tab = [&](const char* name, const std::function<void()>& contents) {
            const bool open = ImGui::BeginTabItem(name);
            ui_.mark(std::string("tab ") + name);
            if (!open) return;
            ImGui::BeginChild(name);
            contents();
            ImGui::EndChild();
            ImGui::EndTabItem();
        };
        tab("Chain", [&] { chain_.draw(); });
        tab("Compare", [&] { draw_compare_panel(ui_); });
        tab("Inspect", [&] { inspect_.draw(); });
        tab("Save", [&] { save_.draw(); });
        ImGui::EndTabBar();
    }
    ImGui::End();
}

void Ui::draw_bottom(float x, float y, float width, float height) {
    begin_panel("bottom", {x, y}, {width, height}, ImGuiWindowFlags_NoBringToFrontOnFocus);
    const bool narrow = width < 360 * ui_.scale;  // no room to align what is on the right
    if (ImGui::Button(ui_.session.playing() ? "stop" : "play"))
        ui_.session.play(ui_.session.playing() == 0 ? 1 : 0);
    ui_.mark("play");
    ImGui::SameLine();
    const auto frames = ui_.session.frames();
    if (!frames.empty()) {
        const auto at = std::lower_bound(frames.begin(), frames.end(), ui_.session.frame());
        int index = int(std::min(at - frames.begin(), std::ptrdiff_t(frames.size()) - 1));
        ImGui::SetNextItemWidth((narrow ? 80 : -210) * ui_.scale);
        const std::string label = concat("frame ", ui_.session.frame());
        if (ImGui::SliderInt("##frame", &index, 0, int(frames.size()) - 1, label.c_str()))
            ui_.session.go_to(frames[size_t(std::clamp(index, 0, int(frames.size()) - 1))]);
        ui_.mark("frame");
    } else {
        ImGui::TextDisabled("no frame yet");
    }
    ImGui::SameLine(narrow ? 0 : width - 205 * ui_.scale);
    if (ImGui::Button("fit")) picture_.port().fit();
    ui_.mark("fit");
    ImGui::SameLine();
    if (ImGui::Button("1:1")) picture_.port().one_to_one();
    ui_.mark("1:1");
    ImGui::SameLine();
    ImGui::Text("%3.0f%% %s", 100 * picture_.port().zoom(), ui_.session.picture_state().c_str());
    std::string values;
    if (picture_.cursor()) {
        values = concat((*picture_.cursor())[0], ", ", (*picture_.cursor())[1]);
        for (const auto& [name, value] :
             values_at(ui_.session, (*picture_.cursor())[0], (*picture_.cursor())[1]))
            values += " | " + name + " " + value;
    } else if (const SharedFrame source = ui_.session.source()) {
        values = concat(source->description.width, " x ", source->description.height, "   ",
                        ui_.session.painted().legend);
    }
    ImGui::TextWrapped("%s", values.c_str());
    ImGui::End();
}

void Ui::draw_messages(float x, float y, float width) {
    const auto& messages = ui_.session.messages();
    const std::string trouble = ui_.session.trouble();
    if (messages.empty() && trouble.empty()) return;
    ImGui::SetNextWindowBgAlpha(0.85f);
    begin_panel("messages", {x + 8 * ui_.scale, y + 8 * ui_.scale},
                {std::max(width - 16 * ui_.scale, 1.0f), 0}, ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::PushTextWrapPos(0);
    if (!trouble.empty()) ImGui::TextColored({1, 0.55f, 0.5f, 1}, "%s", trouble.c_str());
    const size_t shown = 4;
    for (size_t i = messages.size() > shown ? messages.size() - shown : 0; i < messages.size();
         ++i) {
        if (messages[i].text == trouble) continue;
        ImGui::TextColored(messages[i].error ? ImVec4(1, 0.55f, 0.5f, 1) : ImVec4(1, 1, 1, 1), "%s",
                           messages[i].text.c_str());
    }
    ImGui::PopTextWrapPos();
    if (!messages.empty()) {
        if (ImGui::SmallButton("dismiss")) ui_.session.clear_messages();
        ui_.mark("dismiss");
    }
    ImGui::End();
}

void Ui::draw_closing(float width, float height) {
    constexpr const char* kTitle = "Save before closing?";
    if (!ImGui::IsPopupOpen(kTitle)) ImGui::OpenPopup(kTitle);
    ImGui::SetNextWindowPos({width / 2, height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    if (!ImGui::BeginPopupModal(
            kTitle, nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings))
        return;
    const Document& document = ui_.session.document();
    if (document.changed()) ImGui::TextUnformatted("The chain has changes that are not saved.");
    if (document.keys_changed())
        ImGui::Text("The focus keys are not saved; their camera file: %s",
                    save_.camera_path().c_str());
    const auto pressed = [](ImGuiKey key) {
        return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key), false);
    };
    if (ImGui::Button("save and close") || pressed(ImGuiKey_Enter) ||
        pressed(ImGuiKey_KeyPadEnter)) {
        close_ = (!document.changed() || save_.save_chain()) &&
                 (!document.keys_changed() || save_.save_keys());
        closing_ = false;
    }
    ui_.mark("save and close");
    ui_.tip("Enter");
    ImGui::SameLine();
    if (ImGui::Button("close without saving")) {
        ui_.session.discard_edits();
        close_ = true;
    }
    ui_.mark("close without saving");
    ImGui::SameLine();
    if (ImGui::Button("stay") || pressed(ImGuiKey_Escape)) closing_ = false;
    ui_.mark("stay");
    ui_.tip("Escape");
    if (!closing_ || close_) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
}

}  // namespace postchain::view

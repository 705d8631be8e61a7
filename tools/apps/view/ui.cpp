#include "tools/apps/view/ui.h"

#include <algorithm>
#include <cmath>

namespace postchain::view {
namespace {

constexpr size_t kHistory = 120;
constexpr float kSide = 372, kBottom = 62;  // pixels at scale 1

}  // namespace

Ui::Ui(Session& session, std::function<void()> wake)
    : session_(session), exporter_(std::move(wake)) {
    const SessionSettings& settings = session.settings();
    chain_path_ = settings.chain_is_file ? settings.chain_name : settings.chain_name + ".yaml";
    camera_path_ = "camera.json";
    frames_path_ = "filtered.####.exr";
    png_path_ = "frame.png";
    sheet_path_ = "sheet.png";
    movie_path_ = "movie.mp4";
}

void Ui::mark(const std::string& name) {
    const ImVec2 from = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
    if (ImGui::IsItemVisible()) places_[name] = {from.x, from.y, size.x, size.y};
}

void Ui::say(const Status& status) {
    if (!status.ok()) session_.say(status.message(), true);
}

void Ui::gesture() {
    if (ImGui::IsItemActivated()) session_.document().begin_gesture();
    if (ImGui::IsItemDeactivated()) session_.document().end_gesture();
}

void Ui::add_interface_ms(double ms) {
    interface_ms_.push_back(ms);
    if (interface_ms_.size() > 1000) interface_ms_.pop_front();
    slowest_ms_ = std::max(slowest_ms_, ms);
}

bool Ui::upload() {
    const Painted& painted = session_.painted();
    if (uploaded_ != session_.painted_revision()) {
        uploaded_ = session_.painted_revision();
        image_.set(painted.image);
        other_.set(painted.other);
        map_.set(painted.map);
        limits_.set(painted.limits);
    }
    for (ScreenTexture* texture : {&image_, &other_, &map_, &limits_})
        if (texture->upload()) return true;
    return false;
}

void Ui::ask_to_close() {
    if (session_.document().changed() && !closing_)
        closing_ = true;
    else
        close_ = true;
}

void Ui::shortcuts() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput) return;
    const auto pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)); };
    // GLFW's numbers of letters are those of ASCII.
    const auto letter = [](char c) { return ImGui::IsKeyPressed(c); };
    Document& document = session_.document();
    if (io.KeyCtrl) {
        if (letter('Z')) io.KeyShift ? document.redo() : document.undo();
        if (letter('Y')) document.redo();
        if (letter('S')) say(session_.save_chain(chain_path_, replace_));
        if (letter('Q')) ask_to_close();
        return;
    }
    if (pressed(ImGuiKey_Space)) session_.play(!session_.playing());
    if (pressed(ImGuiKey_LeftArrow)) session_.step(-1);
    if (pressed(ImGuiKey_RightArrow)) session_.step(1);
    if (letter('0')) port_.fit();
    if (letter('1')) port_.one_to_one();
    if (letter('F')) focus_tool_ = !focus_tool_;
    if (letter('L')) session_.view().limits = !session_.view().limits;
    if (letter('P')) path_ = !path_;
    Compare& compare = session_.view().compare;
    if (letter('W')) compare = compare == Compare::wipe ? Compare::off : Compare::wipe;
    if (letter('D')) compare = compare == Compare::difference ? Compare::off : Compare::difference;
    if (letter('X')) {
        if (compare != Compare::flip) flipped_ = false;
        compare = Compare::flip;
        flipped_ = !flipped_;
    }
}

void Ui::draw(float width, float height, float scale) {
    scale_ = scale;
    places_.clear();
    shortcuts();
    const float side = std::min(kSide * scale, width * 0.6f);
    const float bottom = std::min(kBottom * scale, height * 0.5f);
    if (session_.shown().milliseconds != last_ms_ && !session_.shown().draft) {
        last_ms_ = session_.shown().milliseconds;
        history_.push_back(float(last_ms_));
        if (history_.size() > kHistory) history_.pop_front();
    }
    // A window of a few pixels has no room for panels.
    if (width < 4 || height < 4) return;
    draw_picture(0, 0, width - side, height - bottom);
    draw_side(width - side, 0, side, height);
    draw_bottom(0, height - bottom, width - side, bottom);
    draw_messages(0, 0, width - side);
    if (closing_) draw_closing(width, height);
}

void Ui::draw_side(float x, float y, float width, float height) {
    ImGui::SetNextWindowPos({x, y});
    ImGui::SetNextWindowSize({width, height});
    ImGui::Begin("side", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
    Document& document = session_.document();
    ImGui::BeginDisabled(!document.can_undo());
    if (ImGui::Button("undo")) document.undo();
    mark("undo");
    if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
        ImGui::SetTooltip("Ctrl+Z: %s", document.undo_name().c_str());
    ImGui::EndDisabled();
    ImGui::SameLine();
    ImGui::BeginDisabled(!document.can_redo());
    if (ImGui::Button("redo")) document.redo();
    mark("redo");
    if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
        ImGui::SetTooltip("Ctrl+Y: %s", document.redo_name().c_str());
    ImGui::EndDisabled();
    ImGui::SameLine();
    if (ImGui::Button(document.changed() ? "save *" : "save"))
        say(session_.save_chain(chain_path_, replace_));
    mark("save");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("Ctrl+S: %s", chain_path_.c_str());
    ImGui::SameLine();
    ImGui::TextDisabled("%s", session_.settings().chain_name.c_str());
    if (ImGui::BeginTabBar("tabs")) {
        const auto tab = [&](const char* name, void (Ui::*contents)()) {
            const bool open = ImGui::BeginTabItem(name);
            mark(std::string("tab ") + name);
            if (!open) return;
            ImGui::BeginChild(name);
            (this->*contents)();
            ImGui::EndChild();
            ImGui::EndTabItem();
        };
        tab("Chain", &Ui::chain_tab);
        tab("Compare", &Ui::compare_tab);
        tab("Inspect", &Ui::inspect_tab);
        tab("Save", &Ui::save_tab);
        ImGui::EndTabBar();
    }
    ImGui::End();
}

void Ui::draw_bottom(float x, float y, float width, float height) {
    ImGui::SetNextWindowPos({x, y});
    ImGui::SetNextWindowSize({width, height});
    ImGui::Begin("bottom", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
    if (ImGui::Button(session_.playing() ? "stop" : "play")) session_.play(!session_.playing());
    mark("play");
    ImGui::SameLine();
    const auto frames = session_.frames();
    if (!frames.empty()) {
        const auto at = std::lower_bound(frames.begin(), frames.end(), session_.frame());
        int index = int(std::min(at - frames.begin(), std::ptrdiff_t(frames.size()) - 1));
        ImGui::SetNextItemWidth(-210 * scale_);
        const std::string label = concat("frame ", session_.frame());
        if (ImGui::SliderInt("##frame", &index, 0, int(frames.size()) - 1, label.c_str()))
            session_.go_to(frames[size_t(std::clamp(index, 0, int(frames.size()) - 1))]);
        mark("frame");
    } else {
        ImGui::TextDisabled("no frame yet");
    }
    ImGui::SameLine(width - 205 * scale_);
    if (ImGui::Button("fit")) port_.fit();
    mark("fit");
    ImGui::SameLine();
    if (ImGui::Button("1:1")) port_.one_to_one();
    mark("1:1");
    ImGui::SameLine();
    const bool rests = session_.at_rest();
    ImGui::Text("%3.0f%% %s", 100 * port_.zoom(),
                rests                    ? "refined"
                : session_.shown().draft ? "draft"
                                         : "...");
    std::string values;
    if (cursor_) {
        values = concat((*cursor_)[0], ", ", (*cursor_)[1]);
        for (const auto& [name, value] : session_.values_at((*cursor_)[0], (*cursor_)[1]))
            values += "   " + name + " " + value;
    } else if (const SharedFrame source = session_.source()) {
        values = concat(source->description.width, " x ", source->description.height, "   ",
                        session_.painted().legend);
    }
    ImGui::TextUnformatted(values.c_str());
    ImGui::End();
}

void Ui::draw_messages(float x, float y, float width) {
    const auto& messages = session_.messages();
    const std::string trouble = session_.trouble();
    if (messages.empty() && trouble.empty()) return;
    ImGui::SetNextWindowPos({x + 8 * scale_, y + 8 * scale_});
    ImGui::SetNextWindowSize({std::max(width - 16 * scale_, 1.0f), 0});
    ImGui::SetNextWindowBgAlpha(0.85f);
    ImGui::Begin("messages", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
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
        if (ImGui::SmallButton("put away")) session_.clear_messages();
        mark("put away");
    }
    ImGui::End();
}

void Ui::draw_closing(float width, float height) {
    ImGui::SetNextWindowPos({width / 2, height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::Begin("closing", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoSavedSettings);
    ImGui::TextUnformatted("The chain has changes that are not saved.");
    if (ImGui::Button("save and close")) {
        const Status status = session_.save_chain(chain_path_, replace_);
        say(status);
        close_ = status.ok();
        closing_ = false;
    }
    ImGui::SameLine();
    if (ImGui::Button("close")) close_ = true;
    mark("close");
    ImGui::SameLine();
    if (ImGui::Button("stay")) closing_ = false;
    ImGui::End();
}

}  // namespace postchain::view

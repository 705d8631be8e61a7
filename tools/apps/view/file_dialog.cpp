#include "tools/apps/view/file_dialog.h"

#include <imgui_stdlib.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "tools/apps/view/keys.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTitle = "###file dialog";  // ImGui's name of it, whatever the title says

}  // namespace

void FileDialog::ask(FileKind kind, bool saves, const std::string& path,
                     std::function<void(const std::string&)> done) {
    kind_ = kind;
    saves_ = saves;
    done_ = std::move(done);
    open_ = focus_ = true;
    const fs::path given(path);
    std::error_code error;
    name_ = saves ? given.filename().string() : "";
    const fs::path parent = fs::absolute(given, error).parent_path();
    enter(fs::is_directory(parent, error) ? parent.string() : fs::current_path(error).string());
}

void FileDialog::enter(const std::string& folder) {
    auto rows = list_folder(folder, kind_);
    trouble_ = rows.status().message();
    if (!rows.ok()) return;
    rows_ = std::move(*rows);
    fs::path normal = fs::path(folder).lexically_normal();
    if (!normal.has_filename() && normal.has_relative_path()) normal = normal.parent_path();
    folder_ = typed_folder_ = normal.string();
    for (const FileRow& row : rows_) ui_.needs(row.name);
    ui_.needs(folder_);
}

void FileDialog::choose() {
    if (name_.empty()) return;
    const fs::path path = fs::path(folder_) / name_;
    std::error_code error;
    if (fs::is_directory(path, error)) {
        name_.clear();
        return enter(path.string());
    }
    open_ = false;
    done_(path.string());
}

void FileDialog::draw() {
    if (!open_) return;
    if (!ImGui::IsPopupOpen(kTitle)) ImGui::OpenPopup(kTitle);
    const ImVec2 whole = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({whole.x / 2, whole.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize(
        {std::min(620 * ui_.scale, whole.x), std::min(480 * ui_.scale, whole.y)});
    const std::string title =
        concat(saves_ ? "Save " : "Open ", saves_ ? "as" : name_of(kind_), kTitle);
    if (!ImGui::BeginPopupModal(title.c_str(), nullptr,
                                ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoSavedSettings))
        return;
    const bool up = ImGui::Button("Up");
    ui_.mark("dialog up");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1);
    const bool goes =
        ImGui::InputText("##folder", &typed_folder_, ImGuiInputTextFlags_EnterReturnsTrue);
    ui_.mark("dialog folder");
    const float below = 2 * ImGui::GetFrameHeightWithSpacing() +
                        (trouble_.empty() ? 0 : ImGui::GetTextLineHeightWithSpacing());
    std::string enters;
    bool chooses = false;
    ImGui::BeginChild("files", {0, -below}, true);
    for (const FileRow& row : rows_) {
        // The name of a sequence has "##", which ImGui hides in a label.
        ImGui::PushID(row.name.c_str());
        const ImVec2 at = ImGui::GetCursorScreenPos();
        const bool clicked =
            ImGui::Selectable("##file", row.name == name_, ImGuiSelectableFlags_AllowDoubleClick);
        ImGui::PopID();
        ImGui::GetWindowDrawList()->AddText(at, ImGui::GetColorU32(ImGuiCol_Text),
                                            row.name.c_str());
        if (row.frames > 1) {
            const std::string count = concat(row.frames, " frames");
            ImGui::GetWindowDrawList()->AddText(
                {ImGui::GetItemRectMax().x - ImGui::CalcTextSize(count.c_str()).x - 8 * ui_.scale,
                 at.y},
                ImGui::GetColorU32(ImGuiCol_TextDisabled), count.c_str());
        }
        ui_.mark("file " + row.name);
        if (!clicked) continue;
        if (!row.is_folder()) name_ = row.name;
        if (!ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) continue;
        if (row.is_folder())
            enters = (fs::path(folder_) / row.name).string();
        else
            chooses = true;
    }
    if (rows_.empty()) ImGui::TextDisabled("no such file here");
    ImGui::EndChild();
    if (!trouble_.empty()) ImGui::TextColored({1, 0.55f, 0.5f, 1}, "%s", trouble_.c_str());
    ImGui::SetNextItemWidth(-1);
    if (std::exchange(focus_, false) && saves_) ImGui::SetKeyboardFocusHere();
    chooses =
        ImGui::InputTextWithHint("##name", "name", &name_, ImGuiInputTextFlags_EnterReturnsTrue) ||
        chooses;
    ui_.mark("dialog name");
    chooses = ImGui::Button(saves_ ? "Save" : "Open") || chooses;
    ui_.mark("dialog choose");
    ImGui::SameLine();
    if (ImGui::Button("Cancel") || is_pressed(ImGuiKey_Escape)) open_ = false;
    ui_.mark("dialog cancel");
    if (up) enters = fs::path(folder_).parent_path().string();
    if (goes) enters = typed_folder_;
    if (!enters.empty())
        enter(enters);
    else if (open_ && (chooses || (!goes && is_pressed(ImGuiKey_Enter))))
        choose();
    if (!open_) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
}

}  // namespace postchain::view

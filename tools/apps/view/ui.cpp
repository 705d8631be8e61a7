#include "tools/apps/view/ui.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "tools/apps/view/session_values.h"
#include "tools/metrics/compare.h"

namespace postchain::view {
namespace {

constexpr float kSide = 400, kBottom = 84;  // pixels at scale 1
constexpr double kExposureStep = 0.5;       // stops
// GLFW's numbers of keys; letters and digits are those of ASCII.
constexpr int kF11 = 300;
constexpr std::array<const char*, 5> kChannels = {"all", "red", "green", "blue", "alpha"};

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
    if (!ui.session.has_truth()) ImGui::TextDisabled("Open > ground truth, to compare with it");
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
    for (const auto& [name, value] : painted.metrics) {
        ImGui::TextUnformatted(name.c_str());
        ImGui::SameLine(90 * ui.scale);
        if (value)
            ImGui::Text("%.4g", *value);
        else
            ImGui::TextUnformatted("equal");
    }
    if (!painted.legend.empty()) ImGui::TextWrapped("%s", painted.legend.c_str());
}

}  // namespace

Ui::Ui(Session& session, std::function<void()> wake)
    : ui_{session},
      dialog_(ui_),
      picture_(ui_),
      chain_(ui_),
      inspect_(ui_),
      save_(ui_, dialog_, std::move(wake)),
      timeline_(ui_) {
    const SessionSettings& settings = session.settings();
    ui_.needs(session.open_chain().name());
    ui_.needs(settings.run.input.color().text());
}

bool Ui::has_unsaved_edits() const {
    return ui_.session.document().unsaved();
}

void Ui::ask_to_close() {
    asked_ = {};
    asking_ = has_unsaved_edits();
    close_ = !asking_;
}

void Ui::open(const OpenRequest& request) {
    if (request.empty()) return;
    asked_ = request;
    asking_ = !request.chain.empty() && has_unsaved_edits();
    if (!asking_) accepted_ = request;
}

std::optional<OpenRequest> Ui::take_request() {
    if (accepted_.empty()) return {};
    return std::exchange(accepted_, {});
}

void Ui::set_range_end(size_t end) {
    Playback& playback = ui_.session.playback();
    const auto list = playback.frames();
    if (list.empty()) return;
    auto range = playback.range().value_or(std::array<int, 2>{list.front(), list.back()});
    const bool is_here = playback.range() && range[end] == playback.frame();
    range[end] = is_here ? (end == 0 ? list.front() : list.back()) : playback.frame();
    // The other end stays behind or before this one.
    if (range[0] > range[1]) range[1 - end] = end == 0 ? list.back() : list.front();
    if (range == std::array<int, 2>{list.front(), list.back()})
        playback.set_range({});
    else
        playback.set_range(range);
}

std::vector<KeyAction> Ui::key_actions() {
    Session& session = ui_.session;
    Playback& playback = session.playback();
    ViewChoice& view = session.view();
    const auto index = [](ImGuiKey key) { return ImGui::GetKeyIndex(key); };
    const auto go_to_end = [&playback](bool last) {
        const auto list = playback.frames_in_range();
        if (!list.empty()) playback.go_to(last ? list.back() : list.front());
    };
    const auto channel = [&view](Channel one) {
        return [&view, one] { view.channel = view.channel == one ? Channel::color : one; };
    };
    const auto compare = [&view](Compare one) {
        return [&view, one] { view.compare = view.compare == one ? Compare::off : one; };
    };
    const auto expose = [&view](double stops) {
        return [&view, stops] { view.display.exposure_stops += stops; };
    };
    return {
        {"Space", "play, or stop", ' ',
         [&playback] { playback.play(playback.playing() == 0 ? 1 : 0); }},
        {"J", "play backward", 'J', [&playback] { playback.play(-1); }},
        {"K", "stop", 'K', [&playback] { playback.play(0); }},
        {"L", "play forward", 'L', [&playback] { playback.play(1); }},
        {.name = "Left",
         .what = "a frame back",
         .key = index(ImGuiKey_LeftArrow),
         .act = [&playback] { playback.step(-1); },
         .repeats = true},
        {.name = "Right",
         .what = "a frame forward",
         .key = index(ImGuiKey_RightArrow),
         .act = [&playback] { playback.step(1); },
         .repeats = true},
        {"Home", "first frame of the range", index(ImGuiKey_Home),
         [go_to_end] { go_to_end(false); }},
        {"End", "last frame of the range", index(ImGuiKey_End), [go_to_end] { go_to_end(true); }},
        {"I", "the range begins here, or at the first frame", 'I', [this] { set_range_end(0); }},
        {"O", "the range ends here, or at the last frame", 'O', [this] { set_range_end(1); }},
        {"F", "fit the image into the window", 'F', [this] { picture_.port().fit(); }},
        {"1", "a pixel of the image is one of the screen", '1',
         [this] { picture_.port().one_to_one(); }},
        {.name = "E", .what = "half a stop brighter", .key = 'E', .act = expose(kExposureStep)},
        {.name = "Shift+E",
         .what = "half a stop darker",
         .key = 'E',
         .act = expose(-kExposureStep),
         .shift = true},
        {"R", "red alone, or all channels", 'R', channel(Channel::red)},
        {"G", "green alone", 'G', channel(Channel::green)},
        {"B", "blue alone", 'B', channel(Channel::blue)},
        {"A", "alpha alone", 'A', channel(Channel::alpha)},
        {"W", "wipe", 'W', compare(Compare::wipe)},
        {"D", "difference", 'D', compare(Compare::difference)},
        {"X", "flip to the other image", 'X',
         [this, &view] {
             if (view.compare != Compare::flip) ui_.flipped = false;
             view.compare = Compare::flip;
             ui_.flipped = !ui_.flipped;
         }},
        {"T", "focus by click", 'T', [this] { ui_.focus_tool = !ui_.focus_tool; }},
        {"N", "near and far limits of sharpness", 'N', [&view] { view.limits = !view.limits; }},
        {"M", "motion path under the cursor", 'M', [this] { ui_.path = !ui_.path; }},
        {"Tab", "the image alone", index(ImGuiKey_Tab), [this] { panels_ = !panels_; }},
        {"F11", "full screen", kF11, [this] { full_screen_ = !full_screen_; }},
        {.name = "Ctrl+Z",
         .what = "undo",
         .key = 'Z',
         .act = [&session] { session.document().undo(); },
         .ctrl = true},
        {.name = "Ctrl+Y",
         .what = "redo",
         .key = 'Y',
         .act = [&session] { session.document().redo(); },
         .ctrl = true},
        {.name = "Ctrl+Shift+Z",
         .what = "",
         .key = 'Z',
         .act = [&session] { session.document().redo(); },
         .ctrl = true,
         .shift = true},
        {.name = "Ctrl+O",
         .what = "open frames",
         .key = 'O',
         .act = [this] { ask_for(FileKind::frames); },
         .ctrl = true},
        {.name = "Ctrl+S",
         .what = "save the chain",
         .key = 'S',
         .act = [this] { save_.save_chain(); },
         .ctrl = true},
        {.name = "Ctrl+Q",
         .what = "close",
         .key = 'Q',
         .act = [this] { ask_to_close(); },
         .ctrl = true},
    };
}

void Ui::ask_for(FileKind kind) {
    const SessionSettings& settings = ui_.session.settings();
    const std::string beside = kind == FileKind::chain && ui_.session.open_chain().is_file()
                                   ? ui_.session.open_chain().name()
                                   : settings.run.input.color().text();
    dialog_.ask(kind, false, beside, [this, kind](const std::string& path) {
        OpenRequest request;
        request.set(kind, path);
        open(request);
    });
}

void Ui::take_input() {
    const ImGuiIO& io = ImGui::GetIO();
    for (const ImWchar letter : io.InputQueueCharacters)
        if (letter >= 0x80) ui_.new_letters = ui_.letters.insert(letter).second || ui_.new_letters;
    if (io.WantTextInput || asking_ || dialog_.is_open()) return;
    // ImGui numbers its own keys when it has a window.
    if (keys_.empty()) keys_ = key_actions();
    take_keys(keys_);
    for (const ImWchar letter : io.InputQueueCharacters)
        if (letter == '?') key_list_ = !key_list_;
}

void Ui::draw(float width, float height, float scale) {
    ui_.scale = scale;
    ui_.places.clear();
    ui_.begin_frame();
    take_input();
    inspect_.note_times();
    // A window of a few pixels has no room for panels.
    if (width < 4 || height < 4) return;
    const float side = panels_ ? std::min(kSide * scale, width * 0.6f) : 0;
    const float bottom = panels_ ? std::min(kBottom * scale, height * 0.5f) : 0;
    picture_.draw(0, 0, width - side, height - bottom);
    if (panels_) {
        draw_side(width - side, 0, side, height);
        draw_bottom(0, height - bottom, width - side, bottom);
    }
    draw_messages(0, 0, width - side);
    if (key_list_) draw_key_list(ui_, keys_, key_list_);
    dialog_.draw();
    if (asking_) draw_question(width, height);
}

void Ui::draw_open_menu() {
    if (ImGui::Button("Open")) ImGui::OpenPopup("open menu");
    ui_.mark("open");
    ui_.tip("or drop files on the window");
    if (!ImGui::BeginPopup("open menu")) return;
    for (const FileKind kind :
         {FileKind::frames, FileKind::chain, FileKind::camera, FileKind::truth}) {
        if (ImGui::MenuItem(concat(name_of(kind), " ...").c_str(),
                            kind == FileKind::frames ? "Ctrl+O" : nullptr))
            ask_for(kind);
        ui_.mark(concat("open ", name_of(kind)));
    }
    ImGui::EndPopup();
}

void Ui::draw_side(float x, float y, float width, float height) {
    begin_panel("side", {x, y}, {width, height}, ImGuiWindowFlags_NoBringToFrontOnFocus);
    Document& document = ui_.session.document();
    draw_open_menu();
    ImGui::SameLine();
    ImGui::BeginDisabled(!document.can_undo());
    if (ImGui::Button("Undo")) document.undo();
    ui_.mark("undo");
    ui_.tip("Ctrl+Z: " + document.undo_name(), ImGuiHoveredFlags_AllowWhenDisabled);
    ImGui::EndDisabled();
    ImGui::SameLine();
    ImGui::BeginDisabled(!document.can_redo());
    if (ImGui::Button("Redo")) document.redo();
    ui_.mark("redo");
    ui_.tip("Ctrl+Y: " + document.redo_name(), ImGuiHoveredFlags_AllowWhenDisabled);
    ImGui::EndDisabled();
    ImGui::SameLine();
    if (ImGui::Button(document.changed() ? "Save *###save" : "Save###save")) save_.save_chain();
    ui_.mark("save");
    ui_.tip("Ctrl+S: " + save_.chain_path());
    ImGui::SameLine();
    const std::string& chain = ui_.session.open_chain().name();
    ImGui::TextDisabled("%s", chain.substr(chain.rfind('/') + 1).c_str());
    ui_.tip(chain);
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
    const bool narrow = width < 360 * ui_.scale;  // no room for what is on the right
    Playback& playback = ui_.session.playback();
    if (ImGui::Button(playback.playing() != 0 ? "Stop###play" : "Play###play"))
        playback.play(playback.playing() == 0 ? 1 : 0);
    ui_.mark("play");
    ui_.tip("Space; backward J, stop K, forward L");
    ImGui::SameLine();
    if (ImGui::Button(playback.filling() ? "Filtering ...###fill" : "Filter all###fill"))
        playback.fill_results(!playback.filling());
    ui_.mark("fill");
    ui_.tip("filters every frame of the range once, so that play shows it as it is written");
    ImGui::SameLine();
    const ViewChoice& view = ui_.session.view();
    std::string state =
        concat(int(std::lround(100 * picture_.port().zoom())), "%  ", ui_.session.picture_state());
    if (view.channel != Channel::color) state += concat("  ", kChannels[int(view.channel)]);
    if (view.display.exposure_stops != 0) {
        char stops[32];
        std::snprintf(stops, sizeof(stops), "  %+.3g stops", view.display.exposure_stops);
        state += stops;
    }
    const ImGuiStyle& style = ImGui::GetStyle();
    const float right = narrow
                            ? 0
                            : ImGui::CalcTextSize("Fit1:1").x + 4 * style.FramePadding.x +
                                  std::max(ImGui::CalcTextSize(state.c_str()).x, 120 * ui_.scale) +
                                  3 * style.ItemSpacing.x;
    timeline_.draw(ImGui::GetContentRegionAvail().x - right);
    if (!narrow) {
        ImGui::SameLine(width - right);
        if (ImGui::Button("Fit")) picture_.port().fit();
        ui_.mark("fit");
        ui_.tip("F");
        ImGui::SameLine();
        if (ImGui::Button("1:1")) picture_.port().one_to_one();
        ui_.mark("1:1");
        ui_.tip("1");
        ImGui::SameLine();
        ImGui::TextUnformatted(state.c_str());
    }
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
    const auto& messages = ui_.session.messages().list();
    for (const Message& message : messages) ui_.needs(message.text);
    const std::string trouble = ui_.session.trouble();
    if (messages.empty() && trouble.empty()) return;
    ImGui::SetNextWindowBgAlpha(0.85f);
    begin_panel("messages", {x + 8 * ui_.scale, y + 8 * ui_.scale},
                {std::max(width - 16 * ui_.scale, 1.0f), 0}, ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::PushTextWrapPos(0);
    ui_.needs(trouble);
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
        if (ImGui::SmallButton("Dismiss")) ui_.session.messages().clear();
        ui_.mark("dismiss");
    }
    ImGui::End();
}

void Ui::draw_question(float width, float height) {
    const bool closes = asked_.empty();
    const std::string title = concat(
        closes ? "Save before closing?" : "Save before opening another chain?", "###question");
    if (!ImGui::IsPopupOpen(title.c_str())) ImGui::OpenPopup(title.c_str());
    ImGui::SetNextWindowPos({width / 2, height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    if (!ImGui::BeginPopupModal(
            title.c_str(), nullptr,
            ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings))
        return;
    const Document& document = ui_.session.document();
    if (document.changed())
        ImGui::Text("The chain has changes that are not saved: %s", save_.chain_path().c_str());
    if (document.keys_changed())
        ImGui::Text("The focus keys are not saved; their camera file: %s",
                    save_.camera_path().c_str());
    bool goes_on = false;
    if (ImGui::Button(closes ? "Save and close" : "Save and open") || is_pressed(ImGuiKey_Enter)) {
        goes_on = (!document.changed() || save_.save_chain()) &&
                  (!document.keys_changed() || save_.save_keys());
        asking_ = false;
    }
    ui_.mark("save and close");
    ui_.tip("Enter");
    ImGui::SameLine();
    if (ImGui::Button(closes ? "Close without saving" : "Open without saving")) {
        ui_.session.open_chain().discard_edits();
        goes_on = true;
        asking_ = false;
    }
    ui_.mark("close without saving");
    ImGui::SameLine();
    if (ImGui::Button("Stay") || is_pressed(ImGuiKey_Escape)) asking_ = false;
    ui_.mark("stay");
    ui_.tip("Escape");
    if (goes_on && closes) close_ = true;
    if (goes_on && !closes) accepted_ = asked_;
    if (!asking_) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
}

}  // namespace postchain::view

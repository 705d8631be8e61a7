// The widgets, by mouse and key, drawn without a window: ImGui makes the triangles, and nothing
// shows them.
#include <random>
#include <regex>
#include <set>
#include <tuple>

#include "tests/view/session_fixture.h"
#include "tools/apps/view/ui.h"

namespace postchain::view {
namespace {

class UiTest : public SessionTest {
  protected:
    void TearDown() override {
        ui_.reset();
        if (ImGui::GetCurrentContext()) ImGui::DestroyContext();
    }
    void start() {
        open();
        ImGui::CreateContext();
        ImGuiIO& io = ImGui::GetIO();
        io.IniFilename = nullptr;
        io.DisplaySize = {1280, 800};
        // As GLFW numbers them: letters as ASCII, others from 256.
        const std::pair<ImGuiKey, int> keys[] = {{ImGuiKey_Tab, kTab},
                                                 {ImGuiKey_LeftArrow, kLeft},
                                                 {ImGuiKey_RightArrow, kRight},
                                                 {ImGuiKey_Home, kHome},
                                                 {ImGuiKey_End, kEnd},
                                                 {ImGuiKey_Space, 32},
                                                 {ImGuiKey_Enter, kEnter},
                                                 {ImGuiKey_Escape, kEscape},
                                                 {ImGuiKey_Backspace, kBackspace},
                                                 {ImGuiKey_KeyPadEnter, 335},
                                                 {ImGuiKey_A, 'A'}};
        for (const auto& [key, number] : keys) io.KeyMap[key] = number;
        unsigned char* pixels = nullptr;
        int width = 0, height = 0;
        io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
        ui_ = std::make_unique<Ui>(*session_, [] {});
        draw(4);
    }
    void start_at_rest() {
        start();
        settle();
        draw(2);
    }
    void draw(int frames = 1) {
        for (int i = 0; i < frames; ++i) {
            session_->tick();
            ImGui::GetIO().DeltaTime = 1.0f / 60;
            ImGui::NewFrame();
            ui_->draw(1280, 800, 1);
            ImGui::Render();
        }
    }
    void move(float x, float y) {
        ImGui::GetIO().MousePos = {x, y};
        draw();
    }
    bool has(const std::string& place) { return ui_->context().places.contains(place); }
    void move_to(const std::string& place, double across = 0.5) {
        ASSERT_TRUE(has(place)) << place;
        const auto& [x, y, width, height] = ui_->context().places.at(place);
        move(x + float(across) * width, y + height / 2);
    }
    void button(bool down) {
        ImGui::GetIO().MouseDown[0] = down;
        draw();
    }
    void press() {
        button(true);
        button(false);
    }
    // A click long after the one before.
    void click(const std::string& place, double across = 0.5) {
        draw(30);
        move_to(place, across);
        press();
        draw();
    }
    void key(int number, bool ctrl = false, bool shift = false) {
        ImGuiIO& io = ImGui::GetIO();
        io.KeyCtrl = ctrl;
        io.KeyShift = shift;
        io.KeysDown[number] = true;
        draw();
        io.KeysDown[number] = false;
        draw();
        io.KeyCtrl = io.KeyShift = false;
    }
    // Held for many frames.
    void hold(int number, bool ctrl = false) {
        ImGuiIO& io = ImGui::GetIO();
        io.KeyCtrl = ctrl;
        io.KeysDown[number] = true;
        draw(200);
        io.KeyCtrl = io.KeysDown[number] = false;
        draw();
    }
    void ask_to_close() {
        ui_->ask_to_close();
        draw(3);
    }
    void type(const std::string& text) {
        ImGui::GetIO().AddInputCharactersUTF8(text.c_str());
        draw(2);
    }

    static constexpr int kEscape = 256, kEnter = 257, kTab = 258, kBackspace = 259, kRight = 262,
                         kLeft = 263, kHome = 268, kEnd = 269;
    std::unique_ptr<Ui> ui_;
};

TEST_F(UiTest, AChainWithoutPassesHasNoOrders) {
    start();
    while (!document().chain().links.empty()) EXPECT_TRUE(document().erase(0).ok());
    draw();
    click("order");
    draw(3);
    EXPECT_FALSE(has("order "));
}

TEST_F(UiTest, AnInheritedValueIsShownAndAnOwnOneMarked) {
    start_at_rest();
    EXPECT_FALSE(has("overridden f_stop"));
    EXPECT_TRUE(document().set(0, "f_stop", 4.0).ok());
    draw(2);
    EXPECT_TRUE(has("overridden f_stop"));
}

TEST_F(UiTest, NumbersAreSavedWithTheDigitsThatAreShown) {
    start_at_rest();
    EXPECT_EQ(shortest_double(0.941f), 0.941);
    move_to("f_stop", 0.2);
    button(true);
    for (const double at : {0.3, 0.35, 0.41}) move_to("f_stop", at);
    button(false);
    move_to("shutter_frames", 0.1);
    button(true);
    move_to("shutter_frames", 0.317);
    button(false);
    ASSERT_TRUE(session_->open_chain().save(path("chain.yaml"), false).ok());
    const std::string text = test::read_text(path("chain.yaml"));
    EXPECT_NE(text, kJoint);
    EXPECT_FALSE(std::regex_search(text, std::regex(R"(\d\.\d{7})"))) << text;
}

TEST_F(UiTest, ClosingNeverLosesEditsByAccident) {
    start();
    EXPECT_TRUE(document().set_camera("f_stop", 4.0).ok());
    ask_to_close();
    ask_to_close();
    EXPECT_FALSE(ui_->wants_to_close()) << "the second Alt+F4 asks too";
    EXPECT_TRUE(has("close without saving"));
    key(kEscape);
    EXPECT_FALSE(ui_->is_asking());
    draw(3);
    EXPECT_FALSE(has("close without saving"));
    ask_to_close();
    key(kEnter);
    EXPECT_TRUE(ui_->wants_to_close());
    EXPECT_NE(test::read_text(path("chain.yaml")).find("f_stop: 4"), std::string::npos);
}

TEST_F(UiTest, ClosingWithoutSavingLeavesTheFile) {
    settings_.open.recovery_folder = path("state");
    start();
    EXPECT_TRUE(document().set_camera("f_stop", 4.0).ok());
    ASSERT_TRUE(wait_for([&] { return std::filesystem::exists(path("state")); }));
    ask_to_close();
    click("close without saving");
    EXPECT_TRUE(ui_->wants_to_close());
    EXPECT_EQ(test::read_text(path("chain.yaml")), kJoint);
    ui_.reset();
    session_.reset();
    EXPECT_TRUE(std::filesystem::is_empty(path("state"))) << "nothing comes back";
}

TEST_F(UiTest, KeysMoveThroughTheFrames) {
    test::write_sequence(folder_.path(), {4, 5}, 64, 48);
    start();
    const auto frame_after = [&](int number) {
        key(number);
        return session_->playback().frame();
    };
    EXPECT_EQ(frame_after(kEnd), 5);
    EXPECT_EQ(frame_after(kLeft), 4);
    EXPECT_EQ(frame_after('O'), 4);
    EXPECT_EQ(frame_after(kLeft), 3);
    EXPECT_EQ(frame_after(kLeft), 2);
    key('I');
    EXPECT_EQ(session_->playback().range(), (std::array<int, 2>{2, 4}));
    EXPECT_EQ(frame_after(kEnd), 4);
    EXPECT_EQ(frame_after(kHome), 2);
    key('I');
    EXPECT_EQ(session_->playback().range(), (std::array<int, 2>{1, 4}))
        << "again: from the first frame";
    for (const auto& [number, direction] :
         {std::pair('J', -1), {'L', 1}, {'K', 0}, {' ', 1}, {' ', 0}}) {
        key(number);
        EXPECT_EQ(session_->playback().playing(), direction) << number;
    }
    // The bar of frames.
    session_->playback().set_range({});
    click("frame", 0.9);
    EXPECT_EQ(session_->playback().frame(), 5);
    click("frame", 0.5);
    EXPECT_EQ(session_->playback().frame(), 3);
}

TEST_F(UiTest, KeysChangeTheView) {
    start_at_rest();
    const ViewChoice& view = session_->view();
    key('E');
    key('E');
    EXPECT_EQ(view.display.exposure_stops, 1);
    key('E', false, true);
    EXPECT_EQ(view.display.exposure_stops, 0.5);
    const std::pair<int, Channel> channels[] = {
        {'R', Channel::red}, {'G', Channel::green}, {'B', Channel::blue}, {'A', Channel::alpha}};
    for (const auto& [number, channel] : channels) {
        key(number);
        EXPECT_EQ(view.channel, channel);
    }
    key('A');
    EXPECT_EQ(view.channel, Channel::color);
    key('1');
    EXPECT_EQ(ui_->port().zoom(), 1);
    key('F');
    EXPECT_GT(ui_->port().zoom(), 1);
    EXPECT_TRUE(has("tab Chain"));
    key(kTab);
    EXPECT_FALSE(has("tab Chain"));
    key(kTab);
    EXPECT_TRUE(has("tab Chain"));
    key(300);
    EXPECT_TRUE(ui_->wants_full_screen()) << "F11";
    type("?");
    EXPECT_TRUE(has("keys"));
    key(kEscape);
    draw(2);
    EXPECT_FALSE(has("keys"));
}

TEST_F(UiTest, AHeldKeyCountsOnce) {
    start();
    hold('W');
    EXPECT_EQ(session_->view().compare, Compare::wipe);
    for (const double stop : {2.0, 4.0}) EXPECT_TRUE(document().set_camera("f_stop", stop).ok());
    hold('Z', true);
    EXPECT_EQ(document().chain().camera.f_stop, 2.0);
    hold('Y', true);
    EXPECT_EQ(document().chain().camera.f_stop, 4.0);
}

TEST_F(UiTest, EveryKeyIsThereOnce) {
    start();
    std::set<std::string> names;
    std::set<std::tuple<int, bool, bool>> keys;
    for (const KeyAction& action : ui_->keys()) {
        EXPECT_TRUE(names.insert(action.name).second) << action.name;
        EXPECT_TRUE(keys.insert({action.key, action.ctrl, action.shift}).second) << action.name;
        EXPECT_GT(action.key, 0) << action.name;
    }
    EXPECT_GT(names.size(), 30u);
}

TEST_F(UiTest, ADoubleClickTypesAValue) {
    start_at_rest();
    draw(30);
    move_to("f_stop", 0.8);
    press();
    EXPECT_NE(document().chain().camera.f_stop, 1.4);
    press();
    EXPECT_EQ(document().chain().camera.f_stop, 1.4) << "the first click is taken back";
    EXPECT_TRUE(ImGui::GetIO().WantTextInput);
    type("5.6");
    key(kEnter);
    draw(2);
    EXPECT_EQ(document().chain().camera.f_stop, 5.6);
    document().undo();
    EXPECT_EQ(document().chain().camera.f_stop, 1.4);
}

TEST_F(UiTest, GroupsFold) {
    start_at_rest();
    EXPECT_TRUE(has("group Lens"));
    EXPECT_TRUE(has("row samples"));
    click("group Method");
    draw(2);
    EXPECT_FALSE(has("row samples"));
}

TEST_F(UiTest, FilesAreOpenedByTheDialog) {
    std::filesystem::create_directory(path("shots"));
    test::write_sequence(path("shots"), {1, 2}, 32, 24);
    start();
    key('O', true);
    draw(3);
    ASSERT_TRUE(has("file shots/"));
    click("file in.####.exr");
    click("dialog choose");
    const auto request = ui_->take_request();
    ASSERT_TRUE(request);
    EXPECT_EQ(request->input, path("in.####.exr"));
    EXPECT_FALSE(ui_->take_request());
    key('O', true);
    draw(3);
    key(kEscape);
    draw(2);
    EXPECT_FALSE(has("dialog choose"));
    EXPECT_FALSE(ui_->take_request());
    // Another chain in place of edits.
    EXPECT_TRUE(document().set_camera("f_stop", 4.0).ok());
    ui_->open({.chain = path("chain.yaml")});
    draw(3);
    EXPECT_FALSE(ui_->take_request());
    click("stay");
    EXPECT_FALSE(ui_->take_request());
    ui_->open({.chain = path("chain.yaml")});
    draw(3);
    click("close without saving");
    EXPECT_TRUE(ui_->take_request());
    EXPECT_FALSE(ui_->wants_to_close());
}

TEST_F(UiTest, TheChainIsSavedUnderAnotherName) {
    start();
    EXPECT_TRUE(document().set_camera("f_stop", 4.0).ok());
    click("tab Save");
    draw(2);
    click("chain dialog");
    draw(3);
    ASSERT_TRUE(has("dialog name"));
    key('A', true);
    type("other.yaml");
    click("dialog choose");
    EXPECT_NE(test::read_text(path("other.yaml")).find("f_stop: 4"), std::string::npos);
    EXPECT_EQ(test::read_text(path("chain.yaml")), kJoint);
    EXPECT_EQ(session_->title(), "other.yaml  in.0001.exr");
    EXPECT_TRUE(document().set_camera("f_stop", 5.0).ok());
    EXPECT_EQ(session_->title(), "other.yaml*  in.0001.exr");
}

TEST(Fonts, EveryScriptHasAFont) {
    if (font_with("Noto Sans", 'a').path.find("Noto") == std::string::npos)
        GTEST_SKIP() << "skipped: not installed: fonts-noto-core";
    std::set<ImWchar> letters;
    EXPECT_FALSE(add_letters("Größe, Ελλάδα, Москва", letters)) << "are always there";
    const std::string text = "ไทย עברית العربية हिन्दी";
    EXPECT_TRUE(add_letters(text, letters));
    EXPECT_FALSE(add_letters(text, letters)) << "not new";
    ImFontAtlas atlas;
    load_fonts(atlas, 16, letters);
    ASSERT_EQ(atlas.Fonts.size(), 1);
    const ImFont& font = *atlas.Fonts[0];
    for (const ImWchar letter :
         {ImWchar('a'), ImWchar(0xe4), ImWchar(0x3b1), ImWchar(0x416), ImWchar(0x0e44),
          ImWchar(0x05e2), ImWchar(0x0627), ImWchar(0x0939)})
        EXPECT_TRUE(font.FindGlyphNoFallback(letter)) << int(letter);
    EXPECT_NE(font.FindGlyphNoFallback('i')->AdvanceX, font.FindGlyphNoFallback('m')->AdvanceX);
}

// Random input: whatever is clicked, dragged and typed, the viewer goes on. Files are written only
// where the test says so: the dialog is left by Cancel, and the buttons that write are not clicked.
TEST_F(UiTest, AMonkeyEndsNothing) {
    constexpr int kActions = 5000;
    test::write_sequence(folder_.path(), {5, 6}, 64, 48);
    settings_.open.recovery_folder = path("state");
    start();
    std::mt19937 random(57);
    const auto below = [&](int n) { return int(random() % uint32_t(n)); };
    const std::vector<int> keys = {kEscape, kTab, kBackspace, kRight, kLeft, kHome, kEnd, ' ', 'J',
                                   'K',     'L',  'I',        'O',    'F',   '1',   'E',  'R', 'G',
                                   'B',     'A',  'W',        'D',    'X',   'T',   'N',  'M', 300};
    const std::vector<std::string> typed = {"?", "7", "0.5", "-3", "1e9", "ä", "ไ", ".", "nan"};
    const auto writes = [](const std::string& place) {
        return place.starts_with("save") || place == "dialog choose" || place.ends_with(" dialog");
    };
    int asked = 0;
    ImGuiIO& io = ImGui::GetIO();
    for (int i = 0; i < kActions; ++i) {
        const bool in_dialog = has("dialog choose");
        switch (below(8)) {
            case 0:
            case 1:
            case 2: {  // a widget
                if (ui_->context().places.empty()) break;
                auto place = ui_->context().places.begin();
                std::advance(place, below(int(ui_->context().places.size())));
                if (writes(place->first)) break;
                move_to(place->first, below(100) / 100.0);
                io.MouseDown[below(10) == 0 ? 1 : 0] = true;
                draw();
                break;
            }
            case 3:
                io.MousePos = {float(below(1280)), float(below(800))};
                io.MouseWheel = float(below(5) - 2);
                break;
            case 4:
                io.MouseDown[0] = io.MouseDown[1] = false;
                break;
            case 5:
                io.MouseDown[0] = io.MouseDown[1] = false;
                key(keys[size_t(below(int(keys.size())))], false, below(4) == 0);
                break;
            case 6:
                if (!io.WantTextInput) {
                    key(below(2) ? 'Z' : 'Y', true, below(2) == 0);
                    break;
                }
                type(typed[size_t(below(int(typed.size())))]);
                if (!in_dialog && !ui_->is_asking()) key(kEnter);
                break;
            case 7:
                if (below(20) == 0) {
                    ui_->ask_to_close();
                    ++asked;
                } else if (below(10) == 0) {
                    type("?");
                } else {
                    key('O', true);
                }
                break;
        }
        // The place that is hovered may have changed: no button that writes may be under the mouse
        // when a click ends.
        for (const auto& [name, place] : ui_->context().places) {
            const auto& [x, y, width, height] = place;
            const float across = io.MousePos.x - x, down = io.MousePos.y - y;
            if (writes(name) && across >= 0 && down >= 0 && across < width && down < height)
                io.MousePos = {640, 300};
        }
        draw();
        ui_->take_request();
        // By its own button only, or because nothing is unsaved: it begins anew.
        if (ui_->wants_to_close()) {
            ui_ = std::make_unique<Ui>(*session_, [] {});
            io.MouseDown[0] = false;
        }
        session_->messages().clear();
    }
    EXPECT_GT(asked, 5);
    io.MouseDown[0] = io.MouseDown[1] = false;
    session_->playback().play(0);
    session_->playback().fill_results(false);
    document().end_gesture();
    draw(3);
    settle();
    EXPECT_EQ(test::read_text(path("chain.yaml")), kJoint);
}

}  // namespace
}  // namespace postchain::view

// The contents of the window, drawn without a window: ImGui makes the triangles, and nothing
// shows them.
#pragma once

#include <cctype>

#include "tests/view/session_fixture.h"
#include "tools/apps/view/ui.h"

namespace postchain::view {

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

}  // namespace postchain::view

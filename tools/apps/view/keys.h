// The keys of the window: one table for what they do and for their list.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/apps/view/ui_context.h"

namespace postchain::view {

struct KeyAction {
    std::string name;  // "Ctrl+Z"
    std::string what;  // in the list; empty: another key for the line above
    int key = 0;       // GLFW's number; letters are those of ASCII
    std::function<void()> act;
    bool ctrl = false, shift = false, repeats = false;
};

// Whether the key went down; Enter: also that of the keypad.
bool is_pressed(ImGuiKey key);
// Does what the keys that went down ask for.
void take_keys(const std::vector<KeyAction>& actions);
// The list, as a window that Escape and `?` close. `open` becomes false then.
void draw_key_list(UiContext& ui, const std::vector<KeyAction>& actions, bool& open);

}  // namespace postchain::view

// Fonts of the interface: Noto Sans as fontconfig finds it, and for letters that it lacks the fonts
// that have them. Without any the interface has ImGui's own font, which knows Latin letters only.
#pragma once

#include <imgui.h>

#include <set>
#include <string>

namespace postchain::view {

struct FontFile {
    std::string path;  // empty: none
    int index = 0;     // in a collection
};
// The font of `family`, or one like it, that has this letter.
FontFile font_with(const std::string& family, ImWchar letter);

// Letters of a text that are not ASCII, added to `letters`; true if there are new ones.
bool add_letters(const std::string& text, std::set<ImWchar>& letters);

// Replaces the fonts of the atlas by those of this size that have all letters.
void load_fonts(ImFontAtlas& atlas, float size_px, const std::set<ImWchar>& letters);

}  // namespace postchain::view

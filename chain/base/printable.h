// Makes foreign text, such as file and channel names, safe for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace postchain {

enum class Lines {
    keep,    // line feeds and tabs stay
    escape,  // written as \n and \t, so that a name cannot fake a line
};

// Escapes everything that moves the cursor, changes colors or reverses writing direction: control
// characters as \x1b, C1 controls and direction marks as \u{202e}, invalid UTF-8 bytes as \xff. All
// printed text passes through it; a text of several lines escapes each of them when it is made.
std::string printable(std::string_view text, Lines lines = Lines::escape);

}  // namespace postchain

// Text of others, such as names of files and channels, made fit for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace postchain {

enum class Lines {
    keep,    // line feeds and tabs stay
    escape,  // they are written \n and \t, so that a name cannot pass for a line of its own
};

// UTF-8 in which nothing moves a cursor, changes a color or turns the direction of writing: control
// characters become \x1b and the like (C1 ones and marks of direction \u{202e}), bytes that are no
// UTF-8 \xff. Everything that is printed as text goes through it.
std::string printable(std::string_view text, Lines lines = Lines::escape);

}  // namespace postchain

// Small helpers for text that is printed or read.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace postchain {

// "a, b, c"
std::string joined(const std::vector<std::string>& words, std::string_view separator = ", ");

// In double quotes, with what JSON and YAML must have escaped: quotes, backslashes, control codes.
std::string quoted(std::string_view text);

}  // namespace postchain

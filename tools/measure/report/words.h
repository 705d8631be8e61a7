// Numbers and counts in the sentences and tables of a report.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>

namespace postchain::report {

// Significant digits: 0.3706 for 0.370626.
inline std::string figure(double v, int digits = 4) {
    char text[40];
    std::snprintf(text, sizeof(text), "%.*g", digits, v);
    return text;
}

// "1 frame", "2 frames".
inline std::string counted(size_t n, const std::string& noun) {
    return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

}  // namespace postchain::report

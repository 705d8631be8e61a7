// A JSON value for a record that is read: each object and list on one line if it fits, otherwise
// lines filled with its members.
#pragma once

#include <string>

namespace postchain::test {

template <class Json>
std::string filled_json(const Json& value, const std::string& indent = "") {
    constexpr size_t kWidth = 118;
    const std::string line = value.dump();
    if (indent.size() + line.size() <= kWidth || !value.is_structured()) return line;
    std::string text, row(1, line[0]);
    bool begins = true;
    for (const auto& [key, member] : value.items()) {
        std::string one = value.is_object() ? Json(key).dump() + ":" : "";
        one += filled_json(member, indent + " ");
        if (!begins) row += ",";
        if (!begins &&
            (indent.size() + row.size() + one.size() > kWidth || one.find('\n') != one.npos)) {
            text += row + "\n" + indent;
            row = " ";
        }
        row += one;
        begins = false;
    }
    return text + row + line.back();
}

}  // namespace postchain::test

#include "chain/text.h"

namespace postchain {

std::string joined(const std::vector<std::string>& words, std::string_view separator) {
    std::string text;
    for (size_t i = 0; i < words.size(); ++i) {
        if (i > 0) text += separator;
        text += words[i];
    }
    return text;
}

std::string quoted(std::string_view text) {
    const char* digits = "0123456789abcdef";
    std::string out = "\"";
    for (char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\') out += '\\';
        if (byte >= 0x20) out += c;
        // Graphviz knows \n but no \u000a.
        else if (c == '\n')
            out += "\\n";
        else
            out += std::string("\\u00") + digits[byte >> 4] + digits[byte & 15];
    }
    return out + "\"";
}

}  // namespace postchain

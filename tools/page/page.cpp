#include "tools/page/page.h"

#include "shaders/embedded.h"

namespace postchain {
const std::vector<EmbeddedFile>& embedded_pages();
}

namespace postchain::page {

std::string_view file(std::string_view path) {
    for (const EmbeddedFile& one : embedded_pages())
        if (one.path == path) return one.text;
    return {};
}

Halves halves_of(std::string_view path) {
    constexpr std::string_view kMark = "<!--DATA-->";
    const std::string_view text = file(path);
    const size_t at = text.find(kMark);
    if (at == std::string_view::npos) return {text, {}};
    return {text.substr(0, at), text.substr(at + kMark.size())};
}

std::string data_element(std::string_view id, std::string_view json) {
    std::string text = "<script type=\"application/json\" id=\"";
    text.append(id).append("\">");
    text.reserve(text.size() + json.size() + 16);
    for (const char c : json)
        if (c == '<')
            text += "\\u003c";
        else
            text += c;
    return text + "</script>\n";
}

std::string with_data(std::string_view path, std::string_view json) {
    const Halves halves = halves_of(path);
    return std::string(halves.before) + data_element("data", json) + std::string(halves.after);
}

}  // namespace postchain::page

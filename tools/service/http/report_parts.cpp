#include "tools/service/http/report_parts.h"

#include <fstream>
#include <iterator>
#include <string_view>

#include "chain/text.h"

namespace postchain::service {
namespace {

// As tools/measure/report/page/page.cpp writes them.
constexpr std::string_view kBegin = "<script type=\"text/plain\" id=\"image-";
constexpr std::string_view kEnd = "</script>\n";

Result<std::string> text_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file) return Status(StatusCode::input, path + ": cannot be read");
    return text;
}

}  // namespace

Result<std::string> page_without_pictures(const std::string& path) {
    auto text = text_of(path);
    if (!text.ok()) return text;
    std::string page;
    size_t at = 0;
    for (size_t begin; (begin = text->find(kBegin, at)) != text->npos;) {
        const size_t end = text->find(kEnd, begin);
        if (end == text->npos) break;
        page.append(*text, at, begin - at);
        at = end + kEnd.size();
    }
    return page.append(*text, at);
}

Result<std::string> picture_in_page(const std::string& path, const std::string& id) {
    const auto text = text_of(path);
    if (!text.ok()) return text;
    const std::string begin = concat("<script type=\"text/plain\" id=\"", id, "\">");
    const size_t at = id.starts_with("image-") ? text->find(begin) : text->npos;
    const size_t end = at == text->npos ? at : text->find(kEnd, at);
    if (end == text->npos)
        return Status(StatusCode::input, "the report does not have the picture '" + id + "'");
    return text->substr(at + begin.size(), end - at - begin.size());
}

}  // namespace postchain::service

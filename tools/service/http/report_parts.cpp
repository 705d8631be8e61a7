#include "tools/service/http/report_parts.h"

#include <fstream>
#include <optional>
#include <string_view>

#include "chain/text.h"

namespace postchain::service {
namespace {

// As tools/measure/report/page/page.cpp writes them: each on a line of its own. A page may have
// hundreds of MB, so that only one of them is in memory.
constexpr std::string_view kBegin = "<script type=\"text/plain\" id=\"image-";
constexpr std::string_view kEnd = "</script>";

// Calls `take` for each line, with its line feed, until it returns false.
template <class Take>
Status read_lines(const std::string& path, const Take& take) {
    std::ifstream file(path, std::ios::binary);
    bool more = bool(file);
    for (std::string line; more && std::getline(file, line);) {
        if (!file.eof()) line += '\n';
        more = take(line);
    }
    if (file.bad() || !file.is_open()) return Status(StatusCode::input, path + ": cannot be read");
    return Status();
}

}  // namespace

Result<std::string> page_without_pictures(const std::string& path) {
    std::string page;
    const Status status = read_lines(path, [&](const std::string& line) {
        if (!line.starts_with(kBegin)) page += line;
        return true;
    });
    if (!status.ok()) return status;
    return page;
}

Result<std::string> picture_in_page(const std::string& path, const std::string& id) {
    const std::string begin = concat("<script type=\"text/plain\" id=\"", id, "\">");
    std::optional<std::string> picture;
    const Status status = read_lines(path, [&](const std::string& line) {
        const size_t end = line.rfind(kEnd);
        if (line.starts_with(begin) && line.starts_with(kBegin) && end != line.npos)
            picture = line.substr(begin.size(), end - begin.size());
        return !picture;
    });
    if (!status.ok()) return status;
    if (picture) return *std::move(picture);
    return Status(StatusCode::input, "the report does not have the picture '" + id + "'");
}

}  // namespace postchain::service

#include "tools/service/http/message.h"

#include <algorithm>
#include <cctype>

namespace postchain::service {
namespace {

int hex(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

std::optional<std::string> decoded(std::string_view text, bool plus_is_space) {
    std::string out;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '+' && plus_is_space) {
            out += ' ';
        } else if (text[i] == '%') {
            if (i + 2 >= text.size()) return std::nullopt;
            const int high = hex(text[i + 1]), low = hex(text[i + 2]);
            if (high < 0 || low < 0) return std::nullopt;
            out += char(high * 16 + low);
            i += 2;
        } else {
            out += text[i];
        }
    }
    const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
    if (std::ranges::any_of(out, is_control)) return std::nullopt;
    return out;
}

bool is_safe_segment(const std::string& segment) {
    return segment != "." && segment != ".." && segment.find_first_of("/\\") == std::string::npos;
}

}  // namespace

bool same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
        return std::tolower(static_cast<unsigned char>(x)) ==
               std::tolower(static_cast<unsigned char>(y));
    });
}

const std::string* Request::header(std::string_view name) const {
    for (const auto& [key, value] : headers)
        if (same_word(key, name)) return &value;
    return nullptr;
}

size_t Request::count(std::string_view name) const {
    return size_t(std::ranges::count_if(
        headers, [&](const auto& one) { return same_word(one.first, name); }));
}

std::optional<Target> parse_target(std::string_view text) {
    if (text.empty() || text[0] != '/' || text.find('#') != std::string_view::npos)
        return std::nullopt;
    const size_t question = text.find('?');
    const std::string_view path =
        text.substr(1, question == std::string_view::npos ? std::string_view::npos : question - 1);
    Target target;
    for (size_t at = 0; at <= path.size();) {
        const size_t end = std::min(path.find('/', at), path.size());
        auto segment = decoded(path.substr(at, end - at), false);
        if (!segment || !is_safe_segment(*segment)) return std::nullopt;
        target.segments.push_back(std::move(*segment));
        at = end + 1;
    }
    if (question == std::string_view::npos) return target;
    const std::string_view query = text.substr(question + 1);
    for (size_t at = 0; at < query.size();) {
        const size_t end = std::min(query.find('&', at), query.size());
        const std::string_view pair = query.substr(at, end - at);
        const size_t equals = std::min(pair.find('='), pair.size());
        auto key = decoded(pair.substr(0, equals), true);
        auto value = decoded(pair.substr(std::min(equals + 1, pair.size())), true);
        if (!key || !value) return std::nullopt;
        if (!target.query.emplace(std::move(*key), std::move(*value)).second) return std::nullopt;
        at = end + 1;
    }
    return target;
}

const char* reason_of(int status) {
    static const std::map<int, const char*> reasons = {
        {200, "OK"},
        {201, "Created"},
        {202, "Accepted"},
        {204, "No Content"},
        {308, "Permanent Redirect"},
        {400, "Bad Request"},
        {401, "Unauthorized"},
        {403, "Forbidden"},
        {404, "Not Found"},
        {405, "Method Not Allowed"},
        {406, "Not Acceptable"},
        {408, "Request Timeout"},
        {409, "Conflict"},
        {413, "Content Too Large"},
        {414, "URI Too Long"},
        {415, "Unsupported Media Type"},
        {421, "Misdirected Request"},
        {422, "Unprocessable Content"},
        {429, "Too Many Requests"},
        {431, "Request Header Fields Too Large"},
        {500, "Internal Server Error"},
        {501, "Not Implemented"},
        {503, "Service Unavailable"},
        {505, "HTTP Version Not Supported"},
    };
    const auto found = reasons.find(status);
    return found == reasons.end() ? "Unknown" : found->second;
}

}  // namespace postchain::service

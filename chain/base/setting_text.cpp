#include "chain/base/setting_text.h"

#include <algorithm>

namespace postchain {
namespace {

constexpr std::string_view kBegin = "\xEF\xB7\x90", kEnd = "\xEF\xB7\x91";  // U+FDD0, U+FDD1

}  // namespace

std::string operator""_keyed(const char* text, size_t size) {
    std::string out;
    for (const char c : std::string_view(text, size))
        out += c == '{' ? kBegin : c == '}' ? kEnd : std::string_view(&c, 1);
    return out;
}

std::string setting(const std::string& key, const std::string& value) {
    return std::string(kBegin).append(key + (value.empty() ? "" : "=" + value)).append(kEnd);
}

std::string option_name(const std::string& key) {
    std::string name = "--" + key;
    std::ranges::replace(name, '_', '-');
    return name;
}

std::string as_options(std::string_view text) {
    return with_settings(text, [](const std::string& key, const std::string& value) {
        if (value == "false") return option_name("no_" + key);
        return option_name(key) + (value.empty() || value == "true" ? "" : " " + value);
    });
}

std::string as_keys(std::string_view text) {
    return with_settings(text, [](const std::string& key, const std::string& value) {
        return value.empty() ? key : key + ": " + value;
    });
}

std::string with_settings(std::string_view text, NameSetting name) {
    std::string out;
    size_t at = 0;
    for (size_t begin; (begin = text.find(kBegin, at)) != text.npos;) {
        out += text.substr(at, begin - at);
        begin += kBegin.size();
        const size_t end = std::min(text.find(kEnd, begin), text.size());
        const std::string inner(text.substr(begin, end - begin));
        const size_t equals = std::min(inner.find('='), inner.size());
        out += name(inner.substr(0, equals), inner.substr(std::min(equals + 1, inner.size())));
        at = std::min(end + kEnd.size(), text.size());
    }
    return out.append(text.substr(at));
}

std::pair<std::string, std::string> split_key(const std::string& message) {
    const size_t end = message.find(kEnd), rest = end + kEnd.size();
    if (!message.starts_with(kBegin) || end == message.npos || message.substr(rest, 2) != ": ")
        return {"", message};
    const std::string key = message.substr(kBegin.size(), end - kBegin.size());
    return {key.substr(0, key.find('=')), message.substr(rest + 2)};
}

}  // namespace postchain

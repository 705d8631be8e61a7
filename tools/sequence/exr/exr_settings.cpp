#include "tools/sequence/exr/exr_settings.h"

#include <algorithm>

namespace postchain::io {

bool matches(std::string_view pattern, std::string_view name) {
    const size_t star = pattern.find('*');
    if (star == std::string_view::npos) return pattern == name;
    if (!name.starts_with(pattern.substr(0, star))) return false;
    const std::string_view rest = pattern.substr(star + 1);
    for (size_t at = star; at <= name.size(); ++at)
        if (matches(rest, name.substr(at))) return true;
    return false;
}

bool ExrSettings::takes(std::string_view channel) const {
    return channels.empty() ||
           std::any_of(channels.begin(), channels.end(),
                       [&](const std::string& pattern) { return matches(pattern, channel); });
}

}  // namespace postchain::io

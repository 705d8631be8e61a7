#include "tools/sequence/exr/exr_settings.h"

#include <algorithm>
#include <charconv>

namespace postchain::io {
namespace {

constexpr const char* kNames[] = {"none",  "rle", "zips", "zip",  "piz",
                                  "pxr24", "b44", "b44a", "dwaa", "dwab"};

Status refuse(std::string_view text, const std::string& why) {
    return Status(StatusCode::usage, concat("'", std::string(text), "': ", why));
}

}  // namespace

const char* name_of(ExrMethod method) {
    return kNames[size_t(method)];
}

Result<ExrCompression> ExrCompression::parse(std::string_view text) {
    const size_t colon = text.find(':');
    const std::string_view name = text.substr(0, colon);
    const auto* found = std::find(std::begin(kNames), std::end(kNames), name);
    if (found == std::end(kNames)) {
        std::string known;
        for (const char* one : kNames) known += concat(known.empty() ? "" : ", ", one);
        return refuse(text, concat("no such compression; known are ", known,
                                   ", with a level as zip:4 or dwaa:45"));
    }
    ExrCompression compression{ExrMethod(found - std::begin(kNames))};
    if (colon == std::string_view::npos) return compression;
    if (!compression.is_zip() && !compression.is_dwa())
        return refuse(text, concat(*found, " has no level; zips, zip, dwaa and dwab have one"));
    const std::string_view digits = text.substr(colon + 1);
    float level = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), level);
    const bool number = read.ec == std::errc() && read.ptr == digits.data() + digits.size();
    if (compression.is_zip() && !(number && level >= 1 && level <= 9 && level == int(level)))
        return refuse(text, "the level of zip is a whole number of 1 to 9");
    if (compression.is_dwa() && !(number && level >= 0 && level <= 1000))
        return refuse(text, "the level of dwa is a number of 0 to 1000");
    compression.level = level;
    return compression;
}

bool ExrCompression::changes(const ExrChannel& channel) const {
    switch (method) {
        case ExrMethod::pxr24:
            return channel.type == PixelType::float32;
        case ExrMethod::b44:
        case ExrMethod::b44a:
            return channel.type == PixelType::half;
        case ExrMethod::dwaa:
        case ExrMethod::dwab: {
            const std::string& name = channel.name;
            const std::string last = name.substr(name.rfind('.') + 1);
            static const char* const kColors[] = {"R", "G", "B", "Y", "RY", "BY"};
            return channel.type != PixelType::uint32 &&
                   std::find(std::begin(kColors), std::end(kColors), last) != std::end(kColors);
        }
        default:
            return false;
    }
}

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

#include "tools/sequence/exr/exr_layout.h"

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>

#include <algorithm>

namespace postchain::io {
namespace {

bool is_in(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// "Z, Vector.X, ... (9 in all)"
std::string listed(const std::vector<std::string>& names) {
    constexpr size_t kShown = 12;
    std::string text;
    for (size_t i = 0; i < std::min(names.size(), kShown); ++i) text += (i ? ", " : "") + names[i];
    return names.size() > kShown ? concat(text, ", ... (", names.size(), " in all)") : text;
}

Status usage(const std::string& what) {
    return Status(StatusCode::usage, what);
}

Status check_channels(const std::vector<ExrPart>& parts, int color_part,
                      const std::vector<std::string>& color, const ExrSettings& settings) {
    std::vector<std::string> all;
    for (const ExrPart& part : parts)
        for (const ExrChannel& channel : part.channels) all.push_back(channel.name);
    for (const std::string& pattern : settings.channels)
        if (std::none_of(all.begin(), all.end(),
                         [&](const std::string& name) { return matches(pattern, name); }))
            return usage(concat("--channels: no channel ", pattern, "; there are ", listed(all)));
    if (std::none_of(color.begin(), color.end(),
                     [&](const std::string& name) { return settings.takes(name); }))
        return usage(concat("--channels names no channel of color, which alone is filtered; add ",
                            listed(color)));
    for (size_t i = 0; i < parts.size(); ++i) {
        if (int(i) == color_part) continue;
        const auto& channels = parts[i].channels;
        const auto taken =
            std::count_if(channels.begin(), channels.end(),
                          [&](const ExrChannel& c) { return settings.takes(c.name); });
        if (taken != 0 && size_t(taken) != channels.size())
            return usage(concat("--channels names some channels of part ", i, " '", parts[i].name,
                                "', which is copied as it is; name all of them or none"));
    }
    return {};
}

}  // namespace

Result<std::vector<std::string>> check_settings(const std::vector<ExrPart>& parts, int color_part,
                                                const std::vector<std::string>& color,
                                                const ExrSettings& settings) {
    if (!settings.channels.empty())
        RETURN_IF_ERROR(check_channels(parts, color_part, color, settings));
    std::vector<std::string> notes;
    if (!settings.compression) return notes;
    std::vector<std::string> data, layers;
    for (const ExrChannel& channel : parts[size_t(color_part)].channels) {
        if (is_in(color, channel.name) || !settings.takes(channel.name) ||
            !settings.compression->changes(channel))
            continue;
        (channel.type == PixelType::half ? layers : data).push_back(channel.name);
    }
    const char* name = name_of(settings.compression->method);
    if (!data.empty())
        return usage(concat("--compression ", name, " would change ", listed(data),
                            ", which may be depth, vectors or ids; use a lossless one (zip, zips, "
                            "piz, rle, none), or leave them out (--channels)"));
    if (!layers.empty())
        notes.push_back(
            concat("compression ", name, " changes channels besides color: ", listed(layers)));
    return notes;
}

void apply_settings(const ExrSettings& settings, const std::vector<std::string>& color,
                    Imf::Header& header) {
    Imf::ChannelList channels;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        if (!settings.takes(it.name())) continue;
        Imf::Channel channel = it.channel();
        if (settings.half && channel.type == Imf::FLOAT && is_in(color, it.name()))
            channel.type = Imf::HALF;
        channels.insert(it.name(), channel);
    }
    header.channels() = channels;
    if (!settings.compression) return;
    const ExrCompression& compression = *settings.compression;
    header.compression() = Imf::Compression(compression.method);
    if (!compression.level) return;
    if (compression.is_zip()) header.zipCompressionLevel() = int(*compression.level);
    if (compression.is_dwa()) {
        header.dwaCompressionLevel() = *compression.level;
        header.insert("dwaCompressionLevel", Imf::FloatAttribute(*compression.level));
    }
}

std::vector<int> written_parts(const std::vector<ExrPart>& parts, const ExrSettings& settings) {
    std::vector<int> written;
    for (size_t i = 0; i < parts.size(); ++i) {
        const auto& channels = parts[i].channels;
        if (std::any_of(channels.begin(), channels.end(),
                        [&](const ExrChannel& c) { return settings.takes(c.name); }))
            written.push_back(int(i));
    }
    return written;
}

}  // namespace postchain::io

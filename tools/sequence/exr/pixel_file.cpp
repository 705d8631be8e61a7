#include "tools/sequence/exr/pixel_file.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <memory>
#include <numeric>

namespace postchain::io {

namespace {

// The part after the last dot: "BY" of "left.BY".
std::string_view base_name(std::string_view channel) {
    const size_t dot = channel.rfind('.');
    return dot == std::string_view::npos ? channel : channel.substr(dot + 1);
}

std::string channel_names(const std::vector<ExrChannel>& channels) {
    std::string text;
    for (const ExrChannel& c : channels) text += (text.empty() ? "" : ", ") + c.name;
    return text;
}

// Errors (input), without the place.
Status check_deep(const ExrPart& part, const Flattening& flattening) {
    if (std::endian::native != std::endian::little)
        return input_error("is deep, which is read on little-endian machines only; flatten it");
    for (const ExrChannel& c : part.channels)
        if (c.x_sampling != 1 || c.y_sampling != 1)
            return input_error(concat("channel ", c.name,
                                      " of deep samples is subsampled; write it "
                                      "at full size"));
    if (part.find(flattening.depth) == nullptr)
        return input_error(concat("is deep without a channel ", flattening.depth,
                                  ", by which samples are sorted; write the distance of each "
                                  "sample, or flatten the file; it has: ",
                                  channel_names(part.channels)));
    if (part.find(flattening.alpha) == nullptr)
        for (const char* name : {"AR", "AG", "AB", "RA", "GA", "BA"})
            if (part.find(name))
                return input_error(concat("is deep with an alpha for each color (", name,
                                          "), which cannot be read; write one alpha, A"));
    if (part.compression != "none" && part.compression != "rle" && part.compression != "zips")
        return input_error(concat("is deep with compression ", part.compression,
                                  "; deep samples are packed with none, rle or zips"));
    return {};
}

}  // namespace

const ExrChannel* ExrPart::find(std::string_view channel) const {
    for (const ExrChannel& c : channels)
        if (c.name == channel) return &c;
    return nullptr;
}

bool ExrPart::luminance_chroma() const {
    return std::any_of(channels.begin(), channels.end(), [](const ExrChannel& c) {
        return base_name(c.name) == "RY" || base_name(c.name) == "BY";
    });
}

Status PixelFile::check_channels(int part, const std::vector<std::string>& channels) const try {
    if (part < 0 || size_t(part) >= parts().size())
        return input_error(path(), concat("has no part ", part));
    const ExrPart& p = parts()[size_t(part)];
    const std::string place =
        p.name.empty() ? path() : concat(path(), ": part ", part, " '", p.name, "'");
    if (p.deep) RETURN_IF_ERROR(check_deep(p, flattening).at(place));
    for (const std::string& name : channels) {
        const ExrChannel* c = p.find(name);
        if (c == nullptr) {
            return input_error(
                place, concat("has no channel ", name, "; it has: ", channel_names(p.channels)));
        }
        if (p.luminance_chroma() &&
            (base_name(name) == "Y" || base_name(name) == "RY" || base_name(name) == "BY")) {
            return input_error(place,
                               concat("channel ", name,
                                      " is luminance-chroma (Y, RY, BY); convert it to R, G, B"));
        }
        if (c->x_sampling != 1 || c->y_sampling != 1) {
            return input_error(place, concat("channel ", name, " is subsampled ", c->x_sampling,
                                             "x", c->y_sampling, "; write it at full size"));
        }
    }
    return {};
} catch (...) {
    return status_of_exception(path());
}

Status PixelFile::explain_no_color() const try {
    // If there is other color, it is not the reason.
    for (const ExrPart& p : parts()) {
        if (p.luminance_chroma()) continue;
        for (const ExrChannel& c : p.channels)
            if (base_name(c.name) == "R") return {};
    }
    for (const ExrPart& p : parts()) {
        if (p.luminance_chroma()) {
            return input_error(path(), concat("is luminance-chroma (", channel_names(p.channels),
                                              "); convert it to R, G, B before filtering"));
        }
    }
    return {};
} catch (...) {
    return status_of_exception(path());
}

Result<PartPixels> PixelFile::read_part(int part, const std::vector<std::string>& channels,
                                        const std::optional<Window>& area) try {
    if (part < 0 || size_t(part) >= parts().size() || parts()[size_t(part)].deep)
        RETURN_IF_ERROR(check_channels(part, {}));
    const ExrPart& info = parts()[size_t(part)];
    PartPixels pixels;
    pixels.part = part;
    pixels.window = info.data_window;
    if (area) {
        // Extend to whole tiles and to whole samples of subsampled channels.
        int step = info.tiled ? rows_at_once(part) : 1;
        for (const ExrChannel& c : info.channels) step = std::lcm(step, c.y_sampling);
        const int top = info.data_window.min_y, last = info.data_window.max_y;
        const int first_row = std::clamp(area->min_y, top, last) - top;
        const int last_row = std::clamp(area->max_y, top, last) - top;
        pixels.window.min_y = top + first_row / step * step;
        pixels.window.max_y = std::min(last, top + (last_row / step + 1) * step - 1);
    }
    for (const ExrChannel& c : info.channels) {
        const bool wanted = channels.empty() ||
                            std::find(channels.begin(), channels.end(), c.name) != channels.end();
        if (wanted) pixels.planes.emplace_back(c, pixels.window);
    }
    for (const std::string& name : channels)
        if (pixels.find(name) == nullptr) return check_channels(part, {name});
    RETURN_IF_ERROR(read_planes(pixels));
    return pixels;
} catch (...) {
    return status_of_exception(path());
}

Result<ImageF> PixelFile::read_channels(int part, const std::vector<std::string>& channels) try {
    RETURN_IF_ERROR(check_channels(part, channels));
    ASSIGN_OR_RETURN(PartPixels pixels, read_part(part, channels));
    return pixels.interleaved(channels, pixels.window);
} catch (...) {
    return status_of_exception(path());
}

}  // namespace postchain::io

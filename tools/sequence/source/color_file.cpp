#include "tools/sequence/source/color_file.h"

#include "tools/sequence/source/memory.h"

namespace postchain::sequence {

Result<ColorFile> read_color(const SourceSettings& settings, const std::string& path, int frame) {
    ASSIGN_OR_RETURN(auto header, open_source_frame(settings, {{Role::color, path}}, frame));
    // Two images and their copies; error maps are not counted.
    const uint64_t bytes =
        frame_bytes(header, {Role::color}, io::Keep::nothing, header.window.height());
    RETURN_IF_ERROR(check_memory(path, 2 * bytes, settings.max_memory));
    ASSIGN_OR_RETURN(auto input, io::read_frame(header.files, header.assignment, {Role::color},
                                                io::Keep::nothing));
    ColorFile color{std::move(input), header.match.profile};
    if (header.match.options.unpremultiplied) {
        ImageF& rgba = color.rgba();
        for (size_t i = 0; i < rgba.pixels(); ++i)
            for (size_t c = 0; c < 3; ++c) rgba.data[4 * i + c] *= rgba.data[4 * i + 3];
    }
    return color;
}

}  // namespace postchain::sequence

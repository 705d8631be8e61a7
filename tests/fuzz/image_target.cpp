// The target `picture`: a complete non-EXR file, read for its color and written again as by `run`.
#include <fstream>

#include "guarantees.h"
#include "targets.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/image_writer.h"

// OpenImageIO 2.4 leaks its error string, some 30 bytes, for each PNG that ends too early, because
// libpng jumps out.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:ImageInput::geterror\n";
}

namespace postchain::fuzz {
namespace {

// A file name whose extension matches the first bytes.
std::string name_for(std::string_view bytes) {
    const std::string_view first = bytes.substr(0, 2);
    if (first == "II" || first == "MM") return "in.tif";
    if (first == "SD" || first == "XP") return "in.dpx";
    if (first == "\xff\xd8") return "in.jpg";
    if (first == "#?") return "in.hdr";
    return "in.png";
}

// Written in its own format and bits it holds what it held.
void ask_copy(const io::ImageFile& file, const std::string& copy, const ImageF& color) {
    const size_t channels = file.parts()[0].channels.size();
    const auto encoding = io::image_encoding(copy, file, channels, {});
    require(encoding.ok(), "a picture can be written as it was read");
    const auto report = io::write_picture(
        copy, color, *encoding, file.path(), 0,
        {.on_existing = io::OnExisting::overwrite, .overflow = io::HalfOverflow::clamp});
    require_reason(report.status());
    if (!report.ok()) return;
    auto again = io::ImageFile::open(copy, {}, file.transfer());
    require(again.ok(), "a copy can be read");
    const auto pixels = again->read_part(0);
    require(pixels.ok(), "a copy has its pixels");
    const ImageF back = pixels->interleaved({"R", "G", "B"}, pixels->window, 4, 1);
    require(back.width == color.width && back.height == color.height, "a copy has its size");
    if (encoding->format->lossy || file.info().is_float) return;
    for (size_t i = 0; i < color.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c)
            require(back.data[4 * i + c] == color.data[4 * i + c], "a copy has the same values");
}

}  // namespace

bool picture(std::string_view bytes) {
    const OutputFolder folder;
    const std::string name = name_for(bytes);
    std::ofstream(folder.path(name), std::ios::binary) << bytes;
    Result<io::ImageFile> file = io::ImageFile::open(folder.path(name), kLimits);
    require_reason(file.status());
    if (!file.ok()) return false;
    require(file->parts().size() == 1, "a picture is one part");
    const io::ExrPart& part = file->parts()[0];
    const auto is_side = [](int side) { return side >= 1 && side <= kLimits.max_side; };
    require(is_side(part.data_window.width()) && is_side(part.data_window.height()) &&
                is_side(part.display_window.width()) && is_side(part.display_window.height()),
            "a side is within its limit");
    require(part.channels.size() == 3 || part.channels.size() == 4, "color has three or four");
    const Result<io::PartPixels> pixels = file->read_part(0);
    require_reason(pixels.status());
    if (!pixels.ok()) return false;
    std::vector<std::string> names;
    for (const io::ExrChannel& channel : part.channels) names.push_back(channel.name);
    const ImageF color = pixels->interleaved(names, pixels->window, 4, 1);
    require(color.width == part.data_window.width() && color.height == part.data_window.height(),
            "pixels fill the data window");
    ask_copy(*file, folder.path("copy." + name.substr(3)), color);
    return true;
}

}  // namespace postchain::fuzz

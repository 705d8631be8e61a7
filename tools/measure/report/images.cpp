#include "tools/measure/report/images.h"

#include <algorithm>

#include "tools/sequence/exr/planes_writer.h"

namespace postchain::report {
namespace {

void replace(std::vector<StoredImage>& images, StoredImage entry) {
    const auto same = std::ranges::find_if(images, [&](const StoredImage& image) {
        return image.path == entry.path && image.variant == entry.variant;
    });
    if (same != images.end())
        *same = std::move(entry);
    else
        images.push_back(std::move(entry));
}

ImageF first_three(const ImageF& image) {
    ImageF rgb(image.width, image.height, 3);
    for (size_t i = 0; i < image.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c)
            rgb.data[3 * i + c] = image.data[size_t(image.channels) * i + c];
    return rgb;
}

}  // namespace

StoredImage stored_image(ImageKind kind, int variant, int frame, const std::string& name,
                         const std::string& map) {
    char number[32];
    std::snprintf(number, sizeof(number), ".%04d.exr", frame);
    return {kind, variant, frame, map, concat(kImageFolder, "/", name, number)};
}

Status store_image(Report& report, StoredImage entry, const ImageF& pixels) {
    RETURN_IF_ERROR(io::make_folder(report.folder + "/" + kImageFolder));
    const bool rgb = pixels.channels >= 3;
    const std::string path = report.folder + "/" + entry.path;
    ASSIGN_OR_RETURN(const auto permit, report.files.permit(path));
    ASSIGN_OR_RETURN(
        const auto written,
        rgb ? io::write_planes_exr(path, pixels.channels == 3 ? pixels : first_three(pixels),
                                   {"R", "G", "B"}, permit)
            : io::write_planes_exr(path, pixels, {"Y"}, permit));
    entry.width = pixels.width;
    entry.height = pixels.height;
    entry.channels = rgb ? 3 : 1;
    replace(report.images, std::move(entry));
    return Status();
}

bool take_stored_image(Report& report, StoredImage entry) {
    auto file = io::ExrFile::open(report.folder + "/" + entry.path);
    if (!file.ok() || file->parts().size() != 1) return false;
    const io::ExrPart& part = file->parts()[0];
    entry.width = part.data_window.width();
    entry.height = part.data_window.height();
    entry.channels = int(part.channels.size());
    replace(report.images, std::move(entry));
    return true;
}

Result<ImageF> load_image(const Report& report, const StoredImage& image) {
    ASSIGN_OR_RETURN(auto file, io::ExrFile::open(report.folder + "/" + image.path));
    if (image.channels == 1) return file.read_channels(0, {"Y"});
    return file.read_channels(0, {"R", "G", "B"});
}

}  // namespace postchain::report

#include "tools/sequence/io/aperture_file.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "chain/image.h"

namespace postchain::io {
namespace {

Status refuse(const std::string& why) {
    return Status(StatusCode::input, why);
}

// Which channels are color or gray, at most three.
std::vector<int> shown_channels(const OIIO::ImageSpec& spec) {
    std::vector<int> channels;
    for (int c = 0; c < spec.nchannels && channels.size() < 3; ++c)
        if (c != spec.alpha_channel && c != spec.z_channel) channels.push_back(c);
    if (channels.size() == 2) channels.pop_back();
    return channels;
}

Status check(const OIIO::ImageSpec& spec) {
    const int width = spec.full_width, height = spec.full_height;
    if (spec.deep) return refuse("is a deep picture; flatten it");
    if (spec.depth > 1 || spec.full_depth > 1)
        return refuse("is a volume; one flat picture is needed");
    if (shown_channels(spec).empty()) return refuse("has no channel of color or gray");
    for (const int side : {width, height, spec.width, spec.height})
        if (side > kMaxApertureSide)
            return refuse(concat("has ", side, " pixels on a side; at most ", kMaxApertureSide,
                                 " are read: make it smaller (", ApertureImage::kSide,
                                 " are used)"));
    if (width != height || width < 1 || spec.width < 1 || spec.height < 1)
        return refuse(concat("is ", width, "x", height,
                             " pixels; the picture of an aperture is square: crop it, or add black "
                             "at its sides"));
    return Status();
}

// The display window in gray; black where the file has no pixels.
Result<ImageF> gray_of(OIIO::ImageInput& file, const OIIO::ImageSpec& spec) {
    const std::vector<int> shown = shown_channels(spec);
    const int channels = shown.back() + 1;
    ImageF data(spec.width, spec.height, channels);
    if (!file.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, data.data.data()))
        return refuse("cannot be read: " + file.geterror());
    ImageF gray(spec.full_width, spec.full_height, 1);
    for (int y = 0; y < gray.height; ++y)
        for (int x = 0; x < gray.width; ++x) {
            // A file states where its windows are.
            const int64_t from_x = int64_t(x) + spec.full_x - spec.x;
            const int64_t from_y = int64_t(y) + spec.full_y - spec.y;
            if (from_x < 0 || from_y < 0 || from_x >= data.width || from_y >= data.height) continue;
            const auto value = [&](size_t i) {
                return data.at(int(from_x), int(from_y), shown[i]);
            };
            gray.at(x, y) = shown.size() == 3
                                ? 0.2126f * value(0) + 0.7152f * value(1) + 0.0722f * value(2)
                                : value(0);
            for (size_t i = 0; i < shown.size(); ++i)
                if (!std::isfinite(value(i)) || value(i) < 0)
                    return refuse(concat("pixel ", x, ", ", y, " is ", value(i),
                                         "; the light that passes is a finite number >= 0"));
        }
    return gray;
}

// Mean of a line of pixels over each cell of the table.
std::vector<double> cell_means(const std::vector<double>& pixels) {
    constexpr int kCells = ApertureImage::kSide;
    const double per_cell = double(pixels.size()) / kCells;
    std::vector<double> means;
    for (int cell = 0; cell < kCells; ++cell) {
        const double from = cell * per_cell, to = (cell + 1) * per_cell;
        double sum = 0;
        for (size_t i = size_t(from); i < pixels.size() && double(i) < to; ++i)
            sum += pixels[i] * std::max(std::min(to, i + 1.0) - std::max(from, double(i)), 0.0);
        means.push_back(sum / per_cell);
    }
    return means;
}

std::vector<float> table_of(const ImageF& gray) {
    constexpr size_t kCells = ApertureImage::kSide;
    std::vector<std::vector<double>> columns(kCells);  // of cells, from the top
    for (int y = 0; y < gray.height; ++y) {
        const float* row = &gray.data[size_t(y) * size_t(gray.width)];
        const auto means = cell_means({row, row + gray.width});
        for (size_t x = 0; x < kCells; ++x) columns[x].push_back(means[x]);
    }
    std::vector<float> table(kCells * kCells);
    for (size_t x = 0; x < kCells; ++x) {
        const auto means = cell_means(columns[x]);
        for (size_t y = 0; y < kCells; ++y) table[y * kCells + x] = float(means[y]);
    }
    return table;
}

Result<ApertureImage> read(const std::string& path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return refuse("no such file");
    if (!std::filesystem::is_regular_file(path, error)) return refuse("is not a file");
    const auto file = OIIO::ImageInput::open(path);
    if (!file) return refuse("cannot be read: " + OIIO::geterror());
    const OIIO::ImageSpec spec = file->spec();
    if (Status status = check(spec); !status.ok()) return status;
    const auto gray = gray_of(*file, spec);
    if (!gray.ok()) return gray.status();
    return ApertureImage::make(table_of(*gray), path);
}

}  // namespace

Result<ApertureImage> read_aperture_image(const std::string& path) try {
    auto image = read(path);
    if (!image.ok()) return image.status().at(path);
    return image;
} catch (...) {
    return status_of_exception(path);
}

std::vector<InputFile> inputs_of(const Camera& camera) {
    if (camera.aperture_image.file().empty()) return {};
    return {{camera.aperture_image.file(), "the picture of the aperture"}};
}

Status ApertureFiles::read(Camera& camera) try {
    const std::string& path = camera.aperture_image.file();
    if (camera.aperture_image.is_read() || path.empty()) return Status();
    auto known = read_.find(path);
    if (known == read_.end()) {
        auto image = read_aperture_image(path);
        if (!image.ok()) return image.status();
        known = read_.emplace(path, std::move(*image)).first;
    }
    camera.aperture_image = known->second;
    return Status();
} catch (...) {
    return status_of_exception(camera.aperture_image.file());
}

}  // namespace postchain::io

#include "tools/sequence/image/bokeh_kernel_file.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "chain/base/image.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::io {
namespace {

// Mean of a line of pixels over each cell of the table.
std::vector<double> cell_means(const std::vector<double>& pixels) {
    constexpr int kCells = BokehKernel::kSide;
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
    constexpr size_t kCells = BokehKernel::kSide;
    std::vector<std::vector<double>> columns(kCells);  // one per column of cells, from the top
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

Result<BokehKernel> read(const std::string& path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        return input_error("no such file; name an image that exists");
    if (!std::filesystem::is_regular_file(path, error))
        return input_error("is not a file; name an image");
    ASSIGN_OR_RETURN(const auto pictures, image_module(StatusCode::input));
    ASSIGN_OR_RETURN(const auto gray, pictures->read_gray(path, kMaxApertureSide));
    return BokehKernel::make(table_of(gray), path);
}

}  // namespace

Result<BokehKernel> read_aperture_image(const std::string& path) try {
    return read(path).at(path);
} catch (...) {
    return status_of_exception(path);
}

std::vector<InputFile> inputs_of(const Camera& camera) {
    if (camera.aperture_image.file().empty()) return {};
    return {{camera.aperture_image.file(), "the bokeh kernel"}};
}

Status ApertureFiles::read(Camera& camera) try {
    const std::string& path = camera.aperture_image.file();
    if (camera.aperture_image.is_read() || path.empty()) return Status();
    auto known = read_.find(path);
    if (known == read_.end()) {
        ASSIGN_OR_RETURN(auto image, read_aperture_image(path));
        known = read_.emplace(path, std::move(image)).first;
    }
    camera.aperture_image = known->second;
    return Status();
} catch (...) {
    return status_of_exception(camera.aperture_image.file());
}

}  // namespace postchain::io

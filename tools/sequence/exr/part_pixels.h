// Pixels of one part in the file's own number types, and windows: where pixels are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "chain/image.h"

namespace postchain::io {

enum class PixelType { half, float32, uint32 };
const char* name_of(PixelType type);  // "half", "float", "uint"
int bytes_of(PixelType type);

// Inclusive pixel bounds, x to the right, y down.
struct Window {
    int min_x = 0;
    int min_y = 0;
    int max_x = -1;
    int max_y = -1;

    int width() const { return max_x - min_x + 1; }
    int height() const { return max_y - min_y + 1; }
    bool contains(const Window& o) const {
        return o.min_x >= min_x && o.min_y >= min_y && o.max_x <= max_x && o.max_y <= max_y;
    }
    bool empty() const { return max_x < min_x || max_y < min_y; }
    uint64_t pixels() const { return empty() ? 0 : uint64_t(width()) * uint64_t(height()); }
    Window united(const Window& o) const;       // the smallest that holds both
    Window intersected(const Window& o) const;  // empty() where they share no pixel
    Window grown(int px) const;                 // by as much on every side
    std::string text() const;                   // "(0, 0)-(639, 359)"
    bool operator==(const Window&) const = default;
};

struct ExrChannel {
    std::string name;  // full: "ViewLayer.Combined.R"
    PixelType type = PixelType::half;
    int x_sampling = 1;
    int y_sampling = 1;
    bool operator==(const ExrChannel&) const = default;
};

// Planes of one part as they lie in the file: rows top-down, tightly packed.
class PartPixels {
  public:
    struct Plane {
        ExrChannel channel;
        int width = 0;  // samples; less than the data window's where subsampled
        int height = 0;
        std::unique_ptr<std::byte[]> bytes;
        size_t row_bytes() const { return size_t(width) * size_t(bytes_of(channel.type)); }
        size_t total_bytes() const { return row_bytes() * size_t(height); }
    };

    int part = 0;
    Window window;
    std::vector<Plane> planes;

    const Plane* find(std::string_view channel) const;
    // The named channels interleaved, as float, of the pixels in `area`. Those that are not in the
    // data window are `outside` in every named channel. A channel count above the names' is filled
    // with `fill`. Names must be here, not subsampled.
    ImageF interleaved(const std::vector<std::string>& names, const Window& area, int channels = 0,
                       float fill = 1, float outside = 0) const;
    // The same planes of another data window, whose corners divide by every sampling. Samples that
    // are not here are 0, or what `outside` says of their channel.
    PartPixels placed(const Window& to, const std::map<std::string, float>& outside) const;
};

// Samples of a channel between two coordinates, both included: they lie where the coordinate
// divides by the sampling. Source: ImfChannelList.h of OpenEXR.
int samples_between(int low, int high, int sampling);

// An image that covers `from`, as one that covers `to`: what is not there is 0.
ImageF placed(const ImageF& image, const Window& from, const Window& to);

}  // namespace postchain::io

// Pixels of one part in the file's own number types, and windows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/image.h"

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
    Window united(const Window& o) const;       // the smallest window that contains both
    Window intersected(const Window& o) const;  // empty() if they share no pixel
    Window grown(int px) const;                 // by `px` on every side
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

// Planes of one part in the file's number types: rows top-down, tightly packed.
class PartPixels {
  public:
    struct Plane {
        // Its bytes are not set, so that a damaged file does not touch all of its pages.
        Plane(const ExrChannel& its_channel, const Window& window);

        ExrChannel channel;
        int width = 0;  // samples; fewer than the data window's if subsampled
        int height = 0;
        std::unique_ptr<std::byte[]> bytes;
        size_t row_bytes() const { return size_t(width) * size_t(bytes_of(channel.type)); }
        size_t total_bytes() const { return row_bytes() * size_t(height); }
    };

    int part = 0;
    Window window;
    std::vector<Plane> planes;

    const Plane* find(std::string_view channel) const;
    // The named channels of the pixels in `area`, interleaved, as float. Pixels outside the data
    // window are `outside` in every named channel. If `channels` exceeds the number of names, the
    // rest is `fill`. Every name must be a plane that is not subsampled.
    ImageF interleaved(const std::vector<std::string>& names, const Window& area, int channels = 0,
                       float fill = 1, float outside = 0) const;
    // The planes for another data window, whose corners are multiples of every sampling. Samples
    // outside the old window are 0, or the value in `outside` for their channel.
    PartPixels placed(const Window& to, const std::map<std::string, float>& outside) const;
};

// Number of samples of a channel between two coordinates, both included. Samples exist at multiples
// of the sampling. Source: ImfChannelList.h of OpenEXR.
int samples_between(int low, int high, int sampling);

// Crops or extends an image that covers `from` so that it covers `to`; new pixels are 0.
ImageF placed(const ImageF& image, const Window& from, const Window& to);

}  // namespace postchain::io

// Makes the images that the window shows: color through the view transform, other textures by a
// legend, error maps. No window.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/image/preview.h"

namespace postchain::view {

using SharedImage = std::shared_ptr<const ImageF>;
using Rgba = Image<uint8_t>;  // 4 channels, rows from the top

enum class Look {
    color,    // through the view transform
    values,   // one channel as gray between its least and its largest value
    vectors,  // direction as hue, length as brightness
    shares,   // red, green and blue as they are, 0..1
};
// The channels of a color image that are shown: all, one channel as the view transform shows it, or
// alpha.
enum class Channel { color, red, green, blue, alpha };
// How a texture with this many channels is shown.
Look look_of(int channels);

struct Rect {
    int x = 0, y = 0, width = 0, height = 0;
    bool empty() const { return width <= 0 || height <= 0; }
    bool operator==(const Rect&) const = default;
};

struct PaintJob {
    uint64_t id = 0;
    SharedImage image;
    Look look = Look::color;
    SharedImage other;  // compared with `image`; null: none
    std::string map;    // error map of the two, a name of metrics::map_rows(); empty: none
    Channel channel = Channel::color;
    Rect visible;  // the part of `image` that the metrics measure; empty: all
    io::PreviewOptions view;
    // The limits of sharpness, drawn over an image with these depths.
    SharedImage inverse_depth;
    double sharp_from = 0, sharp_to = 0;  // scene units; infinite: no limit
    bool operator==(const PaintJob&) const = default;
};

struct Painted {
    uint64_t id = 0;
    Status status;  // of the view transform, the map or the metrics; the rest is valid
    std::shared_ptr<const Rgba> image, other, map, limits;
    std::string legend;  // "0 .. 12.5"
    std::vector<std::pair<std::string, std::optional<double>>> metrics;
};

// Errors: those of io::shown_image().
Result<Rgba> painted(const ImageF& image, Look look, const io::PreviewOptions& view,
                     std::string* legend = nullptr);
// Replaces the pixels by one channel as gray. `image`: what `shown` was painted of; one without
// alpha is opaque.
void show_channel(Rgba& shown, const ImageF& image, Channel channel);
// Lines between pixels that are sharp and those before them (orange) and behind them (cyan);
// elsewhere clear.
Rgba sharpness_limits(const ImageF& inverse_depth, double from, double to);
// The part of an image.
ImageF part_of(const ImageF& image, const Rect& rect);

Painted paint(const PaintJob& job);

// Paints on a thread. A new job replaces one that has not begun.
class Painter {
  public:
    explicit Painter(std::function<void()> wake);
    ~Painter();
    Painter(const Painter&) = delete;
    Painter& operator=(const Painter&) = delete;

    void submit(PaintJob job);
    std::optional<Painted> take();  // the newest
    bool idle() const;

  private:
    void work();

    const std::function<void()> wake_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool end_ = false, running_ = false;
    std::optional<PaintJob> next_;
    std::optional<Painted> done_;
    std::thread thread_;
};

}  // namespace postchain::view

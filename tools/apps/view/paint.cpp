#include "tools/apps/view/paint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "tools/apps/view/frame_store.h"
#include "tools/metrics/compare.h"
#include "tools/sequence/image/png.h"

namespace postchain::view {
namespace {

const std::vector<std::string>& shown_metrics() {
    static const std::vector<std::string> names = {"psnr", "ssim", "flip", "relmse"};
    return names;
}

uint8_t byte_of(double value) {
    return uint8_t(std::lround(std::clamp(std::isfinite(value) ? value : 0.0, 0.0, 1.0) * 255));
}

Rgba with_alpha(const Image<uint8_t>& bytes) {
    Rgba rgba(bytes.width, bytes.height, 4, 255);
    for (size_t i = 0; i < bytes.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c)
            rgba.data[4 * i + c] =
                bytes.data[size_t(bytes.channels) * i + (bytes.channels == 3 ? c : 0)];
    return rgba;
}

struct Range {
    float least = std::numeric_limits<float>::infinity();
    float most = -std::numeric_limits<float>::infinity();
};

Range range_of(const ImageF& image, const std::function<float(const float*)>& value) {
    Range range;
    for (size_t i = 0; i < image.pixels(); ++i) {
        const float v = value(image.data.data() + i * size_t(image.channels));
        if (!std::isfinite(v)) continue;
        range.least = std::min(range.least, v);
        range.most = std::max(range.most, v);
    }
    if (range.least > range.most) range = {0, 0};
    return range;
}

Rgba gray_of(const ImageF& image, std::string* legend) {
    const auto first = [](const float* pixel) { return pixel[0]; };
    const Range range = range_of(image, first);
    const float span = range.most > range.least ? range.most - range.least : 1;
    Rgba rgba(image.width, image.height, 4, 255);
    for (size_t i = 0; i < image.pixels(); ++i) {
        const float value = image.data[i * size_t(image.channels)];
        std::fill_n(rgba.data.begin() + std::ptrdiff_t(4 * i), 3,
                    byte_of((value - range.least) / span));
    }
    if (legend) *legend = concat("black ", range.least, " .. white ", range.most);
    return rgba;
}

Rgba hues_of(const ImageF& image, std::string* legend) {
    const auto length = [](const float* v) { return std::hypot(v[0], v[1]); };
    const Range range = range_of(image, length);
    Rgba rgba(image.width, image.height, 4, 255);
    for (size_t i = 0; i < image.pixels(); ++i) {
        const float* v = image.data.data() + i * size_t(image.channels);
        const double brightness = range.most > 0 ? length(v) / range.most : 0;
        const double turn = std::atan2(v[1], v[0]) / (2 * std::numbers::pi);
        for (size_t c = 0; c < 3; ++c) {
            const double hue = turn + double(c == 0 ? 0 : c == 1 ? 2 : 1) / 3;
            const double wave = std::abs((hue - std::floor(hue)) * 6 - 3) - 1;
            rgba.data[4 * i + c] = byte_of(brightness * std::clamp(wave, 0.0, 1.0));
        }
    }
    if (legend) *legend = concat("direction: red right, hue turns with it; brightest ", range.most);
    return rgba;
}

Rgba shares_of(const ImageF& image, std::string* legend) {
    Rgba rgba(image.width, image.height, 4, 255);
    for (size_t i = 0; i < image.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c)
            rgba.data[4 * i + c] = byte_of(image.data[i * size_t(image.channels) + c]);
    if (legend) *legend = "red: this frame, green: a neighbor, blue: an estimate";
    return rgba;
}

Status compare_images(const PaintJob& job, Painted& painted) {
    // A draft has fewer pixels: metrics and maps wait for the refined picture.
    if (job.image->width != job.other->width || job.image->height != job.other->height)
        return Status();
    const bool part = !job.visible.empty();
    ASSIGN_OR_RETURN(auto pair, part ? metrics::pair_of(part_of(*job.image, job.visible),
                                                        part_of(*job.other, job.visible))
                                     : metrics::pair_of(*job.image, *job.other));
    metrics::CompareSettings settings;
    settings.metrics = {shown_metrics().begin(), shown_metrics().end()};
    ASSIGN_OR_RETURN(auto measured, metrics::compare(pair, settings));
    painted.metrics = std::move(measured.values);
    const metrics::MapRow* row = metrics::find_map(job.map);
    if (!row) return Status();
    ASSIGN_OR_RETURN(auto whole, metrics::pair_of(*job.image, *job.other));
    settings.metrics = {"psnr"};
    settings.map = job.map;
    ASSIGN_OR_RETURN(auto mapped, metrics::compare(whole, settings));
    for (float& value : mapped.map.data) value /= float(row->shown_max);
    ASSIGN_OR_RETURN(const auto colors, io::magma_of(mapped.map));
    painted.map = std::make_shared<const Rgba>(with_alpha(colors));
    painted.legend = concat(row->name, ": black 0 .. bright ", row->shown_max);
    return Status();
}

}  // namespace

Look look_of(int channels) {
    return channels >= 3 ? Look::color : channels == 2 ? Look::vectors : Look::values;
}

Result<Rgba> painted(const ImageF& image, Look look, const io::PreviewOptions& view,
                     std::string* legend) {
    if (look == Look::values) return gray_of(image, legend);
    if (look == Look::vectors) return hues_of(image, legend);
    if (look == Look::shares) return shares_of(image, legend);
    ASSIGN_OR_RETURN(const auto bytes, io::shown_image(image, view));
    return with_alpha(bytes);
}

Rgba sharpness_limits(const ImageF& inverse_depth, double from, double to) {
    const float near_w = float(from > 0 ? 1 / from : std::numeric_limits<double>::infinity());
    const float far_w = float(std::isfinite(to) ? 1 / to : -1);
    // 0: before the sharp depths, 1: sharp, 2: behind them
    const auto place = [&](int x, int y) {
        const float w = inverse_depth.at(x, y);
        return w > near_w ? 0 : w < far_w ? 2 : 1;
    };
    Rgba rgba(inverse_depth.width, inverse_depth.height, 4, 0);
    for (int y = 0; y < inverse_depth.height; ++y)
        for (int x = 0; x < inverse_depth.width; ++x) {
            const int here = place(x, y);
            const int right = x + 1 < inverse_depth.width ? place(x + 1, y) : here;
            const int below = y + 1 < inverse_depth.height ? place(x, y + 1) : here;
            // A line is drawn where sharp pixels end.
            const auto ends = [&](int other) { return here != other && (here == 1 || other == 1); };
            if (!ends(right) && !ends(below)) continue;
            const int blurred = here != 1 ? here : ends(right) ? right : below;
            const std::array<uint8_t, 4> color = blurred == 0
                                                     ? std::array<uint8_t, 4>{255, 150, 40, 255}
                                                     : std::array<uint8_t, 4>{40, 220, 255, 255};
            std::copy(color.begin(), color.end(), rgba.pixel(x, y));
        }
    return rgba;
}

ImageF part_of(const ImageF& image, const Rect& rect) {
    const int x0 = std::clamp(rect.x, 0, image.width), y0 = std::clamp(rect.y, 0, image.height);
    const int x1 = std::clamp(rect.x + rect.width, x0, image.width);
    const int y1 = std::clamp(rect.y + rect.height, y0, image.height);
    ImageF part(x1 - x0, y1 - y0, image.channels);
    for (int y = y0; y < y1 && x1 > x0; ++y)
        std::copy_n(image.pixel(x0, y), size_t(x1 - x0) * size_t(image.channels),
                    part.pixel(0, y - y0));
    return part;
}

void show_channel(Rgba& shown, const ImageF& image, Channel channel) {
    if (channel == Channel::color) return;
    for (size_t i = 0; i < shown.pixels(); ++i) {
        uint8_t* pixel = shown.data.data() + 4 * i;
        const uint8_t value = channel != Channel::alpha ? pixel[int(channel) - int(Channel::red)]
                              : image.channels < 4
                                  ? 255
                                  : byte_of(double(image.data[i * size_t(image.channels) + 3]));
        std::fill_n(pixel, 3, value);
    }
}

Painted paint(const PaintJob& job) {
    Painted result;
    result.id = job.id;
    try {
        auto image = painted(*job.image, job.look, job.view, &result.legend);
        result.status = image.status();
        if (!image.ok()) return result;
        const Channel channel = job.look == Look::color ? job.channel : Channel::color;
        show_channel(*image, *job.image, channel);
        result.image = std::make_shared<const Rgba>(std::move(*image));
        if (job.inverse_depth)
            result.limits = std::make_shared<const Rgba>(
                sharpness_limits(*job.inverse_depth, job.sharp_from, job.sharp_to));
        if (!job.other) return result;
        auto other = painted(*job.other, job.look, job.view);
        result.status = other.status();
        if (!other.ok()) return result;
        show_channel(*other, *job.other, channel);
        result.other = std::make_shared<const Rgba>(std::move(*other));
        if (job.look == Look::color) result.status = compare_images(job, result);
    } catch (...) {
        result.status = status_of_exception("view");
    }
    return result;
}

Painter::Painter(std::function<void()> wake) : wake_(std::move(wake)) {
    thread_ = std::thread([this] { work(); });
}

Painter::~Painter() {
    {
        const std::lock_guard lock(mutex_);
        end_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void Painter::submit(PaintJob job) {
    {
        const std::lock_guard lock(mutex_);
        next_ = std::move(job);
    }
    changed_.notify_all();
}

std::optional<Painted> Painter::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(done_, std::nullopt);
}

bool Painter::idle() const {
    const std::lock_guard lock(mutex_);
    return !next_ && !running_ && !done_;
}

void Painter::work() {
    give_way();
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return end_ || next_; });
        if (end_) return;
        const PaintJob job = std::move(*next_);
        next_.reset();
        running_ = true;
        lock.unlock();
        Painted result = paint(job);
        lock.lock();
        done_ = std::move(result);
        running_ = false;
        lock.unlock();
        wake_();
        lock.lock();
    }
}

}  // namespace postchain::view

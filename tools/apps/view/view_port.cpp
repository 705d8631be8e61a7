#include "tools/apps/view/view_port.h"

#include <algorithm>
#include <cmath>

namespace postchain::view {
namespace {

constexpr double kMaxZoom = 64, kMinZoom = 1.0 / 64;

}  // namespace

void ViewPort::set(int width, int height, double pixel_aspect, const ScreenArea& area) {
    const bool resized = width != width_ || height != height_;
    width_ = width;
    height_ = height;
    aspect_ = pixel_aspect > 0 ? pixel_aspect : 1;
    area_ = {std::max(area.width, 1.0), std::max(area.height, 1.0)};
    if (fitted_ || resized) fit();
}

void ViewPort::fit() {
    fitted_ = true;
    center_ = {width_ / 2.0, height_ / 2.0};
    if (width_ <= 0 || height_ <= 0) return;
    zoom_ = std::min(area_.width / (width_ * aspect_), area_.height / height_);
}

void ViewPort::one_to_one() {
    fitted_ = false;
    zoom_ = 1;
}

void ViewPort::zoom_at(const Point& at, double factor) {
    const Point before = to_image(at);
    fitted_ = false;
    // A fitted image of unusual size may be beyond the limits.
    const double least = std::min(kMinZoom, zoom_), most = std::max(kMaxZoom, zoom_);
    zoom_ = std::clamp(zoom_ * factor, least, most);
    const Point after = to_image(at);
    center_ = {center_[0] + before[0] - after[0], center_[1] + before[1] - after[1]};
    limit();
}

void ViewPort::pan(double dx, double dy) {
    fitted_ = false;
    center_ = {center_[0] - dx / (zoom_ * aspect_), center_[1] - dy / zoom_};
    limit();
}

// The middle of the area shows the image, so that it cannot get lost.
void ViewPort::limit() {
    center_ = {std::clamp(center_[0], 0.0, double(width_)),
               std::clamp(center_[1], 0.0, double(height_))};
}

Point ViewPort::to_screen(const Point& image) const {
    return {area_.width / 2 + (image[0] - center_[0]) * zoom_ * aspect_,
            area_.height / 2 + (image[1] - center_[1]) * zoom_};
}

Point ViewPort::to_image(const Point& screen) const {
    return {center_[0] + (screen[0] - area_.width / 2) / (zoom_ * aspect_),
            center_[1] + (screen[1] - area_.height / 2) / zoom_};
}

Rect ViewPort::visible() const {
    const Point from = to_image({0, 0}), to = to_image({area_.width, area_.height});
    const int x0 = std::clamp(int(std::floor(from[0])), 0, width_);
    const int y0 = std::clamp(int(std::floor(from[1])), 0, height_);
    const int x1 = std::clamp(int(std::ceil(to[0])), x0, width_);
    const int y1 = std::clamp(int(std::ceil(to[1])), y0, height_);
    return {x0, y0, x1 - x0, y1 - y0};
}

}  // namespace postchain::view

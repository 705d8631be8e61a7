// Place of the image in the window: zoom, pan, and the pixel under the cursor.
#pragma once

#include <array>

#include "tools/apps/view/paint.h"

namespace postchain::view {

using Point = std::array<double, 2>;

// The area that shows the image; places in it are pixels from its top left corner.
struct ScreenArea {
    double width = 1, height = 1;
};

class ViewPort {
  public:
    // The size of the image and of its pixels; and of the area. A fitted image stays fitted.
    void set(int width, int height, double pixel_aspect, const ScreenArea& area);
    void fit();
    // One pixel of the image is one of the screen, about the middle of the area.
    void one_to_one();
    // The point of the image at `at` stays there.
    void zoom_at(const Point& at, double factor);
    void pan(double dx, double dy);

    double zoom() const { return zoom_; }  // pixels of the screen along y for one of the image
    bool fitted() const { return fitted_; }
    Point to_screen(const Point& image) const;
    Point to_image(const Point& screen) const;
    // Whole pixels of the image that are on screen.
    Rect visible() const;

  private:
    void limit();

    int width_ = 0, height_ = 0;
    double aspect_ = 1;
    ScreenArea area_;
    double zoom_ = 1;
    Point center_ = {0, 0};  // of the area, in the image
    bool fitted_ = true;
};

}  // namespace postchain::view

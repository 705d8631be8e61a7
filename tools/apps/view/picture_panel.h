// The picture, the mouse over it, and what is drawn over it.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "tools/apps/view/paint.h"
#include "tools/apps/view/ui_context.h"
#include "tools/apps/view/view_port.h"

namespace postchain::view {

// An image as a GL texture, uploaded in parts so that no frame of the interface waits for it.
class ScreenTexture {
  public:
    ScreenTexture() = default;
    ~ScreenTexture();
    ScreenTexture(const ScreenTexture&) = delete;
    ScreenTexture& operator=(const ScreenTexture&) = delete;

    // Null: no image.
    void set(std::shared_ptr<const Rgba> image);
    // Uploads a part; true while more is left. The former image is shown until then.
    bool upload();

    unsigned name() const { return shown_.name; }  // 0: none
    int width() const { return shown_.width; }
    int height() const { return shown_.height; }
    void set_filter(bool nearest) const;

  private:
    struct Texture {
        unsigned name = 0;
        int width = 0, height = 0;
    };
    Texture shown_, next_;
    std::shared_ptr<const Rgba> image_;
    int row_ = 0;
};

class PicturePanel {
  public:
    explicit PicturePanel(UiContext& ui) : ui_(ui) {}

    void draw(float x, float y, float width, float height);
    // Textures are uploaded in parts; true while one is left.
    bool upload();
    ViewPort& port() { return port_; }
    const ViewPort& port() const { return port_; }
    // The pixel of the frame under the cursor.
    const std::optional<std::array<int, 2>>& cursor() const { return cursor_; }

  private:
    void draw_image(ImDrawList& list, const ScreenTexture& texture, float from, float to);
    void draw_overlays(ImDrawList& list);
    void pointer(float x, float y);

    UiContext& ui_;
    ViewPort port_;
    ImVec2 picture_at_ = {0, 0}, picture_size_ = {1, 1};
    ScreenTexture image_, other_, map_, limits_;
    uint64_t uploaded_ = 0;
    double wipe_ = 0.5;
    bool dragging_wipe_ = false;
    std::optional<std::array<int, 2>> cursor_, pressed_;
};

}  // namespace postchain::view

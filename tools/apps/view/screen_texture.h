// An image as a GL texture, uploaded in parts so that no frame of the interface waits for it.
#pragma once

#include <memory>

#include "tools/apps/view/paint.h"

namespace postchain::view {

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

}  // namespace postchain::view

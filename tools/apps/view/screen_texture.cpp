#include "tools/apps/view/screen_texture.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <utility>

namespace postchain::view {
namespace {

constexpr int kBytesAtOnce = 8 << 20;

}  // namespace

ScreenTexture::~ScreenTexture() {
    for (const unsigned name : {shown_.name, next_.name})
        if (name) glDeleteTextures(1, &name);
}

void ScreenTexture::set(std::shared_ptr<const Rgba> image) {
    if (image == image_) return;
    image_ = std::move(image);
    row_ = 0;
    if (image_) return;
    if (shown_.name) glDeleteTextures(1, &shown_.name);
    shown_ = {};
}

bool ScreenTexture::upload() {
    if (!image_ || row_ >= image_->height) return false;
    if (row_ == 0) {
        if (!next_.name) {
            glGenTextures(1, &next_.name);
            glBindTexture(GL_TEXTURE_2D, next_.name);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
            glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        }
        glBindTexture(GL_TEXTURE_2D, next_.name);
        if (next_.width != image_->width || next_.height != image_->height)
            glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image_->width, image_->height, 0, GL_RGBA,
                         GL_UNSIGNED_BYTE, nullptr);
        next_.width = image_->width;
        next_.height = image_->height;
    }
    const int rows = std::clamp(kBytesAtOnce / (4 * image_->width), 1, image_->height - row_);
    glBindTexture(GL_TEXTURE_2D, next_.name);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, row_, image_->width, rows, GL_RGBA, GL_UNSIGNED_BYTE,
                    image_->pixel(0, row_));
    row_ += rows;
    if (row_ < image_->height) return true;
    std::swap(shown_, next_);
    return false;
}

void ScreenTexture::set_filter(bool nearest) const {
    glBindTexture(GL_TEXTURE_2D, shown_.name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, nearest ? GL_NEAREST : GL_LINEAR);
}

}  // namespace postchain::view

#include "chain/guest/motion_check.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>

#include "chain/gl/debug.h"
#include "chain/guest/frame_check.h"
#include "chain/guest/host_frame.h"
#include "chain/guest/validate.h"
#include "chain/sign_check.h"

namespace postchain::guest {
namespace {

// Sets dense pixel packing for reads, and restores the host's values.
class DensePacking {
  public:
    DensePacking() {
        glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &buffer_);
        glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
        for (size_t i = 0; i < kNames.size(); ++i) {
            glGetIntegerv(kNames[i], &values_[i]);
            glPixelStorei(kNames[i], kNames[i] == GL_PACK_ALIGNMENT ? 4 : 0);
        }
    }
    ~DensePacking() {
        for (size_t i = 0; i < kNames.size(); ++i) glPixelStorei(kNames[i], values_[i]);
        glBindBuffer(GL_PIXEL_PACK_BUFFER, GLuint(buffer_));
    }
    DensePacking(const DensePacking&) = delete;
    DensePacking& operator=(const DensePacking&) = delete;

  private:
    static constexpr std::array<GLenum, 8> kNames = {
        GL_PACK_ALIGNMENT,   GL_PACK_ROW_LENGTH,  GL_PACK_IMAGE_HEIGHT, GL_PACK_SKIP_ROWS,
        GL_PACK_SKIP_PIXELS, GL_PACK_SKIP_IMAGES, GL_PACK_SWAP_BYTES,   GL_PACK_LSB_FIRST};
    GLint buffer_ = 0;
    std::array<GLint, kNames.size()> values_;
};

// The frame's rectangle of a texture, row 0 at the top, at the frame's size.
ImageF read(const pc_texture& texture, const HostTexture& checked, const HostFrame& frame,
            int channels) {
    ImageF stored(checked.width, checked.height, channels);
    glGetTextureSubImage(texture.name, checked.image.level, texture.x, texture.y,
                         checked.image.layer, stored.width, stored.height, 1,
                         channels == 2 ? GL_RG : GL_RGBA, GL_FLOAT,
                         GLsizei(stored.data.size() * sizeof(float)), stored.data.data());
    ImageF plane(frame.width, frame.height, channels);
    const auto texel_of = [](int p, int stored_side, int side) {
        return (2 * p + 1) * stored_side / (2 * side);
    };
    for (int y = 0; y < frame.height; ++y) {
        const int row = texel_of(y, stored.height, frame.height);
        for (int x = 0; x < frame.width; ++x)
            std::copy_n(stored.pixel(texel_of(x, stored.width, frame.width),
                                     frame.top_left() ? row : stored.height - 1 - row),
                        channels, plane.pixel(x, y));
    }
    return plane;
}

}  // namespace

Failure check_motion(const pc_frame* of_host, const pc_texture& other_color, int signs[2],
                     float& margin) {
    pc_frame whole = *of_host;
    whole.flags &= ~uint32_t(PC_HALF_RESOLUTION);
    const pc_frame* given = &whole;
    HostFrame frame;
    if (Failure failure = check_frame(given, frame); !failure.ok()) return failure;
    if (frame.motion.name == 0)
        return {PC_ERROR_INPUT, "motion: name 0; give the texture to check"};
    if (other_color.name == 0 || other_color.x < 0 || other_color.y < 0 ||
        other_color.width < frame.width || other_color.x > other_color.width - frame.width ||
        other_color.height < frame.height || other_color.y > other_color.height - frame.height)
        return {PC_ERROR_INPUT, "other_color: not given, or it does not cover the frame"};
    gl::forget_errors();  // the host's, which would look like those of the queries
    if (Failure failure = validate(frame); !failure.ok()) return failure;
    if (Failure failure = validate("other_color", other_color, frame.color, false); !failure.ok())
        return failure;
    const shared::GuestUniforms uniforms = uniforms_of(frame);
    const DensePacking packing;
    FramePlanes planes;
    planes[Role::color] = read(given->color, frame.color, frame, 4);
    ImageF motion = read(given->motion, frame.motion, frame, 2);
    // Points vectors to the other frame; vectors of this minus previous point away from it.
    const float way = frame.flag(PC_MOTION_TO_NEXT) ? 1.0f : -1.0f;
    for (size_t pixel = 0; pixel < motion.pixels(); ++pixel)
        for (int c = 0; c < 2; ++c) {
            float& v = motion.data[2 * pixel + size_t(c)];
            v = uniforms.motion_scale[c] * (v - uniforms.motion_bias[c]) -
                uniforms.motion_jitter[c];
            v *= c == 1 && uniforms.bottom_up ? -way : way;
        }
    planes[Role::motion] = std::move(motion);
    const SignCheck check = check_signs(planes, read(other_color, frame.color, frame, 4));
    signs[0] = signs[1] = 1;
    margin = float(check.margin());
    if (margin >= 1) return {};
    for (const SignCandidate& candidate : check.candidates) {
        if (!check.told_apart(candidate) || candidate.margin > check.margin()) continue;
        signs[0] = candidate.sign_x;
        signs[1] = candidate.sign_y;
    }
    margin = 1 / margin;
    return {};
}

}  // namespace postchain::guest

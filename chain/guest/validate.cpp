#include "chain/guest/validate.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>

#include "chain/frame/sign_check.h"
#include "chain/gl/debug.h"
#include "chain/guest/frame_check.h"
#include "chain/guest/host_frame.h"

namespace postchain::guest {
namespace {

struct Target {
    GLenum target, binding;
    const char* name;
};
constexpr Target kTargets[] = {
    {GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D, "a GL_TEXTURE_2D"},
    {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY, "a GL_TEXTURE_2D_ARRAY"},
    {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_BINDING_2D_MULTISAMPLE, "a GL_TEXTURE_2D_MULTISAMPLE"},
    {GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BINDING_CUBE_MAP, "a GL_TEXTURE_CUBE_MAP"},
    {GL_TEXTURE_3D, GL_TEXTURE_BINDING_3D, "a GL_TEXTURE_3D"},
    {GL_TEXTURE_RECTANGLE, GL_TEXTURE_BINDING_RECTANGLE, "a GL_TEXTURE_RECTANGLE"}};

// By GL_TEXTURE_TARGET or, where a driver has no such query (Mesa in a compatibility profile), by
// binding it, which needs a clear error flag and leaves one.
Target target_of(unsigned name) {
    const Target other = {0, 0, "of another target"};
    GLint found = 0;
    glGetTextureParameteriv(name, GL_TEXTURE_TARGET, &found);
    if (found != 0) {
        const auto* one = std::ranges::find(kTargets, GLenum(found), &Target::target);
        return one == std::end(kTargets) ? other : *one;
    }
    gl::forget_errors();
    for (const Target& one : kTargets) {
        GLint bound = 0;
        glGetIntegerv(one.binding, &bound);
        glBindTexture(one.target, name);
        const bool fits = glGetError() == GL_NO_ERROR;
        glBindTexture(one.target, GLuint(bound));
        if (fits) return one;
    }
    return other;
}

// Formats whose precision the driver chooses; null for others.
const char* name_of_unsized(int format) {
    switch (format) {
        case GL_RED:
            return "GL_RED";
        case GL_RG:
            return "GL_RG";
        case GL_RGB:
            return "GL_RGB";
        case GL_RGBA:
            return "GL_RGBA";
        case GL_DEPTH_COMPONENT:
            return "GL_DEPTH_COMPONENT";
        case GL_DEPTH_STENCIL:
            return "GL_DEPTH_STENCIL";
    }
    return nullptr;
}

// True if GL may take the texture for incomplete: one of glTexImage2D() that lacks levels which its
// own minifying filter would read. Reads are not concerned, because they have their own sampler.
bool lacks_levels(unsigned name, int width, int height) {
    GLint immutable = 0, filter = 0, last = 0;
    glGetTextureParameteriv(name, GL_TEXTURE_IMMUTABLE_FORMAT, &immutable);
    glGetTextureParameteriv(name, GL_TEXTURE_MIN_FILTER, &filter);
    glGetTextureParameteriv(name, GL_TEXTURE_MAX_LEVEL, &last);
    if (immutable || filter == GL_NEAREST || filter == GL_LINEAR) return false;
    const int side = std::max(width, height);
    for (int level = 1; level <= last && side >> level > 0; ++level) {
        GLint found = 0;
        glGetTextureLevelParameteriv(name, level, GL_TEXTURE_WIDTH, &found);
        if (found != std::max(width >> level, 1)) return true;
    }
    return false;
}

int last_possible_level() {
    GLint side = 1;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    return int(std::bit_width(unsigned(side))) - 1;
}

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
                         checked.image.slice, stored.width, stored.height, 1,
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

Failure validate(const char* member, const pc_texture& given, const HostTexture& checked,
                 bool written) {
    if (given.name == 0) return {};
    const ImageOf image = checked.image;
    const auto fault = [&](const std::string& text) {
        return Failure(PC_ERROR_INPUT, concat(member, ": texture ", given.name, " ", text));
    };
    if (!glIsTexture(given.name)) return fault("is not one of this context; was it deleted?");
    GLint width = 0, height = 0, depth = 0, format = 0, base = 0, last = 0;
    const Target found = target_of(given.name);
    if (found.target != (checked.array ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D))
        return fault(concat("is ", found.name, "; ",
                            found.target == GL_TEXTURE_2D || found.target == GL_TEXTURE_2D_ARRAY
                                ? concat("set ", member, "_slice.target to it")
                                : "only GL_TEXTURE_2D and GL_TEXTURE_2D_ARRAY can be read"));
    // Beyond the last level that any texture can have, a query would be an error of GL.
    const std::string no_level =
        concat("has no level ", image.level, "; set ", member, "_slice.level to one of its levels");
    if (image.level > last_possible_level()) return fault(no_level);
    glGetTextureLevelParameteriv(given.name, image.level, GL_TEXTURE_WIDTH, &width);
    glGetTextureLevelParameteriv(given.name, image.level, GL_TEXTURE_HEIGHT, &height);
    glGetTextureLevelParameteriv(given.name, image.level, GL_TEXTURE_DEPTH, &depth);
    glGetTextureLevelParameteriv(given.name, image.level, GL_TEXTURE_INTERNAL_FORMAT, &format);
    if (width == 0) return fault(no_level);
    if (image.slice >= depth)
        return fault(
            concat("has ", depth, " layers, and ", member, "_slice.layer is ", image.slice));
    if (width != given.width || height != given.height)
        return fault(concat("is ", width, "x", height, ", not ", given.width, "x", given.height));
    if (const char* unsized = name_of_unsized(format))
        return fault(concat("is of the unsized format ", unsized, ", not ",
                            text_of_format(given.internal_format),
                            "; name that format when the texture is created"));
    if (GLenum(format) != given.internal_format)
        return fault(concat("is ", text_of_format(GLenum(format)), ", not ",
                            text_of_format(given.internal_format)));
    glGetTextureParameteriv(given.name, GL_TEXTURE_BASE_LEVEL, &base);
    if (base != 0)
        return fault(concat("has GL_TEXTURE_BASE_LEVEL ", base, "; set 0, the level of the frame"));
    glGetTextureParameteriv(given.name, GL_TEXTURE_MAX_LEVEL, &last);
    if (last < image.level)
        return fault(concat("has GL_TEXTURE_MAX_LEVEL ", last, ", below ", member, "_slice.level ",
                            image.level, "; raise it to that level"));
    if (format == GL_DEPTH24_STENCIL8 || format == GL_DEPTH32F_STENCIL8) {
        GLint mode = 0;
        glGetTextureParameteriv(given.name, GL_DEPTH_STENCIL_TEXTURE_MODE, &mode);
        if (mode != GL_DEPTH_COMPONENT)
            return fault(
                "is read as stencil; set GL_DEPTH_STENCIL_TEXTURE_MODE to GL_DEPTH_COMPONENT");
    }
    if (written && lacks_levels(given.name, width, height))
        return fault(
            "lacks levels that its GL_TEXTURE_MIN_FILTER needs, and drivers may ignore what is "
            "stored in it; set the filter to GL_LINEAR or GL_NEAREST, or use glTextureStorage2D()");
    return {};
}

Failure validate(const HostFrame& frame) {
    const pc_frame& given = *frame.given;
    const struct {
        const char* member;
        const pc_texture& texture;
        const HostTexture& checked;
    } all[] = {
        {"color", given.color, frame.color},          {"depth", given.depth, frame.depth},
        {"motion", given.motion, frame.motion},       {"mask", given.mask, frame.mask},
        {"exposure", given.exposure, frame.exposure}, {"output", given.output, frame.output}};
    for (const auto& [member, texture, checked] : all)
        RETURN_IF_ERROR(validate(member, texture, checked, &texture == &given.output));
    for (const Neighbor neighbor : kNeighbors) {
        const HostPlanes& planes = frame.neighbors[size_t(neighbor)];
        if (!planes.given) continue;
        const auto check = [&](const char* member, const pc_texture& texture,
                               const HostTexture& checked) {
            return validate(concat(name_of(neighbor), ".", member).c_str(), texture, checked,
                            false);
        };
        RETURN_IF_ERROR(check("color", planes.given->color, planes.color));
        RETURN_IF_ERROR(check("depth", planes.given->depth, planes.depth));
        RETURN_IF_ERROR(check("motion", planes.given->motion, planes.motion));
        RETURN_IF_ERROR(check("exposure", planes.given->exposure, planes.exposure));
    }
    return {};
}

Failure check_motion(const pc_frame* of_host, const pc_texture& other_color, int signs[2],
                     float& margin) {
    pc_frame whole = *of_host;
    whole.flags &= ~uint32_t(PC_HALF_RESOLUTION);
    const pc_frame* given = &whole;
    HostFrame frame;
    RETURN_IF_ERROR(check_frame(given, frame));
    if (frame.motion.name == 0)
        return {PC_ERROR_INPUT, "motion: name 0; give the texture to check"};
    if (other_color.name == 0 || other_color.x < 0 || other_color.y < 0 ||
        other_color.width < frame.width || other_color.x > other_color.width - frame.width ||
        other_color.height < frame.height || other_color.y > other_color.height - frame.height)
        return {PC_ERROR_INPUT, "other_color: not given, or it does not cover the frame"};
    gl::forget_errors();  // the host's, which would look like those of the queries
    RETURN_IF_ERROR(validate(frame));
    RETURN_IF_ERROR(validate("other_color", other_color, frame.color, false));
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

#include "chain/guest/host_format.h"

#include <epoxy/gl.h>

#include "chain/status.h"

namespace postchain::guest {
namespace {

#define FORMAT(name, ...) \
    { name, #name, __VA_ARGS__ }
// Format, channels, depth, image, half. A half has 11 bits: 8 normalized bits are no halves.
constexpr HostFormat kFormats[] = {
    FORMAT(GL_RGBA32F, 4, false, true, false),
    FORMAT(GL_RGBA16F, 4, false, true, true),
    FORMAT(GL_RGB32F, 3, false, false, false),
    FORMAT(GL_RGB16F, 3, false, false, true),
    FORMAT(GL_R11F_G11F_B10F, 3, false, true, true),
    FORMAT(GL_RGB9_E5, 3, false, false, false),
    FORMAT(GL_RGBA16, 4, false, true, false),
    FORMAT(GL_RGBA8, 4, false, true, false),
    FORMAT(GL_RGB10_A2, 4, false, true, false),
    FORMAT(GL_RGB8, 3, false, false, false),
    FORMAT(GL_SRGB8_ALPHA8, 4, false, false, false),
    FORMAT(GL_SRGB8, 3, false, false, false),
    FORMAT(GL_RGBA16_SNORM, 4, false, true, false),
    FORMAT(GL_RGBA8_SNORM, 4, false, true, false),
    FORMAT(GL_RG32F, 2, false, true, false),
    FORMAT(GL_RG16F, 2, false, true, true),
    FORMAT(GL_RG16, 2, false, true, false),
    FORMAT(GL_RG8, 2, false, true, false),
    FORMAT(GL_RG16_SNORM, 2, false, true, false),
    FORMAT(GL_RG8_SNORM, 2, false, true, false),
    FORMAT(GL_R32F, 1, false, true, false),
    FORMAT(GL_R16F, 1, false, true, true),
    FORMAT(GL_R16, 1, false, true, false),
    FORMAT(GL_R8, 1, false, true, false),
    FORMAT(GL_DEPTH_COMPONENT32F, 1, true, false, false),
    FORMAT(GL_DEPTH_COMPONENT32, 1, true, false, false),
    FORMAT(GL_DEPTH_COMPONENT24, 1, true, false, false),
    FORMAT(GL_DEPTH_COMPONENT16, 1, true, false, false),
    FORMAT(GL_DEPTH32F_STENCIL8, 1, true, false, false),
    FORMAT(GL_DEPTH24_STENCIL8, 1, true, false, false),
};
#undef FORMAT

}  // namespace

float HostFormat::largest() const {
    if (name == GL_R11F_G11F_B10F) return 64512;  // of 10 bits
    return half ? 65504 : 0;
}

const HostFormat* find_format(unsigned internal_format) {
    for (const auto& format : kFormats)
        if (format.name == internal_format) return &format;
    return nullptr;
}

std::string text_of_format(unsigned internal_format) {
    if (const HostFormat* format = find_format(internal_format)) return format->text;
    return concat("0x", std::hex, internal_format);
}

}  // namespace postchain::guest

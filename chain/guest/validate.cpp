#include "chain/guest/validate.h"

#include <epoxy/gl.h>

namespace postchain::guest {
namespace {

const char* name_of_target(int target) {
    switch (target) {
        case GL_TEXTURE_2D_ARRAY:
            return "GL_TEXTURE_2D_ARRAY";
        case GL_TEXTURE_2D_MULTISAMPLE:
            return "GL_TEXTURE_2D_MULTISAMPLE";
        case GL_TEXTURE_CUBE_MAP:
            return "GL_TEXTURE_CUBE_MAP";
        case GL_TEXTURE_3D:
            return "GL_TEXTURE_3D";
        case GL_TEXTURE_RECTANGLE:
            return "GL_TEXTURE_RECTANGLE";
    }
    return "another target";
}

Failure check(const char* member, const pc_texture& given) {
    if (given.name == 0) return {};
    const auto fault = [&](const std::string& text) {
        return Failure(PC_ERROR_INPUT, concat(member, ": texture ", given.name, " ", text));
    };
    if (!glIsTexture(given.name)) return fault("is not one of this context; was it deleted?");
    GLint target = 0, width = 0, height = 0, format = 0;
    glGetTextureParameteriv(given.name, GL_TEXTURE_TARGET, &target);
    if (target != GL_TEXTURE_2D)
        return fault(concat("is a ", name_of_target(target), "; only GL_TEXTURE_2D can be read"));
    glGetTextureLevelParameteriv(given.name, 0, GL_TEXTURE_WIDTH, &width);
    glGetTextureLevelParameteriv(given.name, 0, GL_TEXTURE_HEIGHT, &height);
    glGetTextureLevelParameteriv(given.name, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
    if (width != given.width || height != given.height)
        return fault(concat("is ", width, "x", height, ", not ", given.width, "x", given.height));
    if (GLenum(format) != given.internal_format)
        return fault(concat("is ", text_of_format(GLenum(format)), ", not ",
                            text_of_format(given.internal_format)));
    return {};
}

}  // namespace

Failure validate(const HostFrame& frame) {
    const pc_frame& given = *frame.given;
    const std::pair<const char*, const pc_texture*> all[] = {{"color", &given.color},
                                                             {"depth", &given.depth},
                                                             {"motion", &given.motion},
                                                             {"exposure", &given.exposure},
                                                             {"output", &given.output}};
    for (const auto& [member, texture] : all)
        if (Failure failure = check(member, *texture); !failure.ok()) return failure;
    return {};
}

}  // namespace postchain::guest

#include "chain/egl/setup.h"

#include <epoxy/gl.h>

namespace postchain::egl {
namespace {

void APIENTRY on_message(GLenum, GLenum, GLuint, GLenum severity, GLsizei length,
                         const GLchar* text, const void* device) {
    if (severity == GL_DEBUG_SEVERITY_NOTIFICATION) return;  // our own debug groups
    static_cast<const gl::Device*>(device)->log("GL: " + std::string(text, size_t(length)));
}

}  // namespace

void set_up_current(const gl::Device& device, bool debug) {
    if (epoxy_has_gl_extension("GL_KHR_parallel_shader_compile"))
        glMaxShaderCompilerThreadsKHR(~0u);  // as many as the driver likes
    if (debug && device.log) {
        glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        glDebugMessageCallback(on_message, &device);
    }
}

}  // namespace postchain::egl

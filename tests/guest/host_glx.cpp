// The host's context: GLX, of a GLFW window on X11.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cstdio>
#include <cstdlib>

#include "tests/guest/host.h"

namespace postchain::test {
namespace {

GLFWwindow* window = nullptr;
GLFWwindow* other = nullptr;

GLFWwindow* make(int profile = GLFW_OPENGL_CORE_PROFILE) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, profile);
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    GLFWwindow* made = glfwCreateWindow(64, 64, "host", nullptr, nullptr);
    if (!made) {
        const char* text = nullptr;
        glfwGetError(&text);
        std::fprintf(stderr, "no GLX context of OpenGL 4.5: %s\n", text ? text : "unknown");
        std::exit(1);
    }
    glfwMakeContextCurrent(made);
    return made;
}

}  // namespace

void make_host_context() {
    if (window) return;
    if (!glfwInit()) {
        std::fprintf(stderr, "GLFW finds no display: run this by with_display.sh\n");
        std::exit(1);
    }
    window = make();
}
void release_host_context() {
    glfwMakeContextCurrent(nullptr);
}
void regain_host_context() {
    glfwMakeContextCurrent(window);
}
void other_context() {
    other = make();
}
void other_context_of_compatibility() {
    other = make(GLFW_OPENGL_COMPAT_PROFILE);
}
void other_context_done() {
    glfwDestroyWindow(other);
    regain_host_context();
}

}  // namespace postchain::test

// The list of a work group's pixels.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "chain/plan/program_source.h"
#include "tests/support/gpu.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

// The bits come from a texture, which may hold any.
TEST(PixelList, HasRoomForAllBitsOfAllSquares) {
    executor();  // a GL context
    const std::string source = concat("#version 450 core\n#define SOFTWARE_RENDERER 1\n",
                                      must(resolve_includes("inverse_warp/square.glsl", "")), R"(
layout(std430, binding = 0) buffer Listed { uint listed; };
void main() {
    begin_list();
    int k = int(gl_LocalInvocationIndex);
    do add_to_list(k, 0xffffffffu);
    while ((k += kThreads) < kSquares);
    barrier();
    if (gl_LocalInvocationIndex == 0u) listed = list_length <= list.length() ? list_length : 0u;
}
)");
    const char* text = source.c_str();
    const GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &text);
    GLint linked = GL_FALSE;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    ASSERT_TRUE(linked);
    GLuint buffer = 0, listed = 0;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, sizeof(listed), nullptr, 0);
    glUseProgram(program);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer);
    glDispatchCompute(1, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(buffer, 0, sizeof(listed), &listed);
    glDeleteBuffers(1, &buffer);
    glUseProgram(0);
    glDeleteProgram(program);
    EXPECT_EQ(listed, 16u * 256u);
}

}  // namespace
}  // namespace postchain::test

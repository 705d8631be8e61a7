// Functions of the shaders, called alone.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/plan/program_source.h"
#include "tests/support/gpu.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

// The numbers that a work group stores in `found`. `main`: a shader's, after that file.
std::vector<float> found_by(const std::string& file, const std::string& main, size_t count) {
    executor();  // a GL context
    const std::string source =
        concat("#version 450 core\n#define SOFTWARE_RENDERER 1\n", must(resolve_includes(file, "")),
               "layout(std430, binding = 0) buffer Found { float found[]; };\n", main);
    const char* text = source.c_str();
    const GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &text);
    GLint linked = GL_FALSE;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    EXPECT_TRUE(linked);
    std::vector<float> found(count);
    const auto bytes = GLsizeiptr(count * sizeof(float));
    GLuint buffer = 0;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, bytes, nullptr, 0);
    glUseProgram(program);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer);
    glDispatchCompute(1, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(buffer, 0, bytes, found.data());
    glDeleteBuffers(1, &buffer);
    glUseProgram(0);
    glDeleteProgram(program);
    return found;
}

// The bits come from a texture, which may hold any.
TEST(PixelList, HasRoomForAllBitsOfAllSquares) {
    EXPECT_THAT(found_by("inverse_warp/square.glsl", R"(
void main() {
    begin_list();
    int k = int(gl_LocalInvocationIndex);
    do add_to_list(k, 0xffffffffu);
    while ((k += kThreads) < kSquares);
    barrier();
    if (gl_LocalInvocationIndex == 0u)
        found[0] = list_length <= list.length() ? float(list_length) : 0.0;
}
)",
                         1),
                testing::ElementsAre(16 * 256));
}

// Also of weights whose sum is below 1, as those of a tile that gets few more samples.
TEST(Means, OfAnyWeights) {
    EXPECT_THAT(found_by("inverse_warp/mean.glsl", R"(
layout(local_size_x = 1) in;
void main() {
    const vec4 own = vec4(7.0);
    Mean mean = no_mean();
    found[0] = value_of(mean, own).x;
    add(mean, vec4(2.0), 0.25);
    found[1] = value_of(mean, own).x;
    add(mean, vec4(6.0), 0.25);
    found[2] = value_of(mean, own).w;
    add(mean, vec4(1.0), 1.5);
    found[3] = value_of(mean, own).x;
    for (int i = 0; i < 3; ++i) found[4 + i] = faded_in(own, vec4(3.0), 0.5 * float(i)).x;
}
)",
                         7),
                testing::ElementsAre(7, 2, 4, 1.75f, 7, 5, 3));
}

}  // namespace
}  // namespace postchain::test

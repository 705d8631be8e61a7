// CPU time of one read of each pixel on the software renderer: texelFetch(), imageLoad(), shared
// memory, a storage buffer. docs/benchmarks.md has the table.
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>

#include "chain/egl/context.h"
#include "chain/gl/program.h"
#include "tests/bench/bench_frame.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

constexpr int kReads = 32;  // of each pixel, as in shaders/bench/access.comp
constexpr const char* kKinds[] = {"none", "texelFetch()", "imageLoad()", "shared memory",
                                  "storage buffer"};

GLuint make_texture(GLenum format, const Settings& settings) {
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, format, settings.width, settings.height);
    return texture;
}

// Least CPU time of a dispatch, milliseconds.
double measure(unsigned program, const Settings& settings) {
    glUseProgram(program);
    const auto groups = [](int px) { return GLuint((px + kBlockPx - 1) / kBlockPx); };
    double least = 1e9;
    for (int i = 0; i <= settings.iterations; ++i) {
        const double begin = cpu_milliseconds();
        glDispatchCompute(groups(settings.width), groups(settings.height), 1);
        glFinish();
        if (i > 0) least = std::min(least, cpu_milliseconds() - begin);  // the first one compiles
    }
    return least;
}

}  // namespace

int main(int argc, char** argv) {
    const Settings settings = parse_settings(argc, argv, 11);
    const auto context = require(egl::Context::create({.device = egl::ContextOptions::kSoftware}));
    const GLuint source = make_texture(GL_RGBA32F, settings);
    const GLuint result = make_texture(GL_R32F, settings);
    GLuint buffer = 0;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, GLsizeiptr(16) * settings.width * settings.height, nullptr, 0);
    glBindTextureUnit(0, source);
    glBindImageTexture(1, source, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
    glBindImageTexture(0, result, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_R32F);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer);
    gl::ProgramCache programs;
    std::printf("%s; %dx%d, four floats\n\n| read | ms for one of each pixel |\n|---|---|\n",
                context->device().renderer.c_str(), settings.width, settings.height);
    double none = 0;
    for (int kind = 0; kind < int(std::size(kKinds)); ++kind) {
        const auto program =
            require(programs.get({"bench/access.comp", {{"ACCESS", std::to_string(kind)}}}));
        const double ms = measure(program.name, settings);
        if (kind == 0)
            none = ms;
        else
            std::printf("| %s | %.2f |\n", kKinds[kind], (ms - none) / kReads);
    }
    return 0;
}

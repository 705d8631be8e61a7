// A library for LD_PRELOAD that makes llvmpipe behave as GPUs may. POSTCHAIN_GPU_LIKE lists the
// behaviors by name, separated by commas:
//
//   half      stores to half floats round toward zero
//   nan       textures that programs write are NaN when a frame begins
//   align     uniform blocks begin at multiples of 256 bytes
//   limits    GL 4.5's smallest limits: 8 image units, 8 storage blocks, 16 textures in a program
//   late      the device finishes later than it is asked to: a fence passes at the 8th question,
//             when it is waited for, or with a later one. The renderer is none that computes on the
//             CPU
//   order     what llvmpipe does in order by chance has to be asked for: a texture or list that a
//             dispatch wrote is used after glMemoryBarrier with the bit of that use, and written
//             over after one if a dispatch read it; buffers that stay mapped are filled again after
//             a fence, and pixels that are read back are NaN until theirs has passed. Nothing waits
//             as on a renderer that computes on the CPU
//   reverse   the last work group and the last invocation of each come first
//
// Filters of samplers and fused products differ too, but no program has any (tests/programs).
//
// libepoxy calls GL through a variable for each function. The ones below are replaced. What a
// device would refuse ends the program. POSTCHAIN_GPU_LIKE_TRACE names a file that gets a line for
// each upload, dispatch, reading and wait.
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "chain/base/status.h"
#include "tests/gpu_like/order.h"

namespace postchain::test {
namespace {

constexpr GLint kImages = 8, kLists = 8, kTextures = 16, kBlockBytes = 16384;
constexpr GLint64 kListBytes = 1 << 24;
constexpr GLint kAlignment = 256;

bool behaves(const char* name) {
    static const std::string names = [] {
        const char* text = std::getenv("POSTCHAIN_GPU_LIKE");
        return "," + std::string(text ? text : "") + ",";
    }();
    return names.find("," + std::string(name) + ",") != std::string::npos;
}

void refuse(bool refused, const char* why, long value) {
    if (!refused) return;
    std::fprintf(stderr, "gpu_like: %s: %ld\n", why, value);
    std::abort();
}

void trace(const char* what) {
    static FILE* const file = [] {
        const char* name = std::getenv("POSTCHAIN_GPU_LIKE_TRACE");
        return name ? std::fopen(name, "w") : nullptr;
    }();
    if (!file) return;
    std::fprintf(file, "%s\n", what);
    std::fflush(file);
}

// The driver's function of the name.
#define REAL(name)                                                              \
    ([] {                                                                       \
        static const auto driver =                                              \
            reinterpret_cast<decltype(epoxy_##name)>(eglGetProcAddress(#name)); \
        return driver;                                                          \
    }())

constexpr const char* kHalfStores = R"(
layout(location = 100) uniform int gpu_like_half;  // a bit for each image unit whose format is half floats
vec4 gpu_like_stored(vec4 value, int unit) {
    if ((gpu_like_half >> unit & 1) == 0) return value;
    const vec4 size = min(abs(value), vec4(65504.0));
    const vec4 small = trunc(size * 16777216.0) / 16777216.0;
    const vec4 normal = uintBitsToFloat(floatBitsToUint(size) & 0xffffe000u);
    const vec4 kept = mix(normal, small, lessThan(size, vec4(6.103515625e-5)));
    const uvec4 bits = floatBitsToUint(value) & 0x7fffffffu;
    const vec4 rounded = mix(kept, -kept, lessThan(value, vec4(0.0)));
    return mix(rounded, value, greaterThanEqual(bits, uvec4(0x7f800000u)));
}
uvec4 gpu_like_stored(uvec4 value, int unit) { return value; }
#define imageStore(image, at, value) \
    imageStore(image, at, gpu_like_stored(value, gpu_like_unit_##image))
)";

std::string reversed(std::string source) {
    constexpr const char* kSize = "gl_WorkGroupSize.x * gl_WorkGroupSize.y * gl_WorkGroupSize.z";
    for (const auto& [id, count] :
         {std::pair("gl_WorkGroupID", std::string("gl_NumWorkGroups")),
          {"gl_LocalInvocationID", "gl_WorkGroupSize"},
          {"gl_LocalInvocationIndex", kSize},
          {"gl_GlobalInvocationID", "gl_NumWorkGroups * gl_WorkGroupSize"}})
        source = std::regex_replace(source, std::regex(concat("\\b", id, "\\b")),
                                    concat("(", count, " - 1u - ", id, ")"));
    return source;
}

std::string with_behaviors(std::string source) {
    if (behaves("reverse")) source = reversed(std::move(source));
    std::string prelude;
    if (behaves("half") && source.find("imageStore(") != std::string::npos) {
        static const std::regex declared(
            R"(layout\(binding = (\w+)\) (?:coherent )?writeonly uniform u?image2D(?:Array)? (\w+);)");
        std::set<std::string> known;
        for (std::sregex_iterator at(source.begin(), source.end(), declared), end; at != end; ++at)
            if (known.insert((*at)[2]).second)
                prelude += "#define gpu_like_unit_" + (*at)[2].str() + " " + (*at)[1].str() + "\n";
        prelude += kHalfStores;
    }
    if (prelude.empty()) return source;
    const size_t line = source.find('\n') + 1;  // #version comes first
    return source.substr(0, line) + prelude + "#line 2 0\n" + source.substr(line);
}

std::map<GLuint, std::string> sources;  // by shader

std::string source_of(GLuint program) {
    GLuint shader = 0;
    GLsizei shaders = 0;
    glGetAttachedShaders(program, 1, &shaders, &shader);
    const auto found = sources.find(shaders == 1 ? shader : 0);
    return found == sources.end() ? "" : found->second;
}

void APIENTRY shader_source(GLuint shader, GLsizei count, const GLchar* const* texts,
                            const GLint* lengths) {
    std::string source;
    for (GLsizei i = 0; i < count; ++i)
        source += lengths && lengths[i] >= 0 ? std::string(texts[i], size_t(lengths[i])) : texts[i];
    source = with_behaviors(source);
    sources[shader] = source;
    const char* text = source.c_str();
    REAL(glShaderSource)(shader, 1, &text, nullptr);
}

void APIENTRY link_program(GLuint program) {
    trace("link");
    REAL(glLinkProgram)(program);
    if (behaves("order")) order::linked(program, source_of(program));
    if (!behaves("limits")) return;
    GLint uniforms = 0, lists = 0, images = 0, textures = 0;
    glGetProgramInterfaceiv(program, GL_UNIFORM, GL_ACTIVE_RESOURCES, &uniforms);
    glGetProgramInterfaceiv(program, GL_SHADER_STORAGE_BLOCK, GL_ACTIVE_RESOURCES, &lists);
    for (GLint i = 0; i < uniforms; ++i) {
        const GLenum what = GL_TYPE;
        GLint type = 0;
        glGetProgramResourceiv(program, GL_UNIFORM, GLuint(i), 1, &what, 1, nullptr, &type);
        images += order::is_image(type);
        textures += order::texture_binding(type) != GL_NONE;
    }
    refuse(images > kImages, "images of a program", images);
    refuse(textures > kTextures, "textures of a program", textures);
    refuse(lists > kLists, "storage blocks of a program", lists);
}

void APIENTRY get_program(GLuint program, GLenum name, GLint* value) {
    if (name == GL_LINK_STATUS || name == GL_INFO_LOG_LENGTH) trace("status");
    REAL(glGetProgramiv)(program, name, value);
}

void APIENTRY use_program(GLuint program) {
    if (behaves("order")) order::step_begins();
    REAL(glUseProgram)(program);
}

void APIENTRY delete_shader(GLuint shader) {
    sources.erase(shader);
    REAL(glDeleteShader)(shader);
}

struct Storage {
    GLenum format = GL_NONE;
    bool written = false;  // by a program, and not uploaded since
};
std::map<GLuint, Storage> storages;
std::map<GLuint, GLenum> bound_images;  // unit -> format

bool is_half(GLenum format) {
    return format == GL_RGBA16F || format == GL_RG16F || format == GL_R16F;
}

void fill_with_nan(GLuint texture, GLenum format) {
    if (format == GL_RGBA32UI || format == GL_R32UI) {
        const GLuint ones[] = {~0u, ~0u, ~0u, ~0u};
        glClearTexImage(texture, 0, format == GL_R32UI ? GL_RED_INTEGER : GL_RGBA_INTEGER,
                        GL_UNSIGNED_INT, ones);
        return;
    }
    const GLuint nan[] = {0x7fc00000u, 0x7fc00000u, 0x7fc00000u, 0x7fc00000u};
    glClearTexImage(texture, 0, GL_RGBA, GL_FLOAT, nan);
}

void made(GLuint texture, GLenum format) {
    storages[texture] = {format, false};
    if (behaves("nan")) fill_with_nan(texture, format);
}

void APIENTRY texture_storage_2d(GLuint texture, GLsizei levels, GLenum format, GLsizei width,
                                 GLsizei height) {
    REAL(glTextureStorage2D)(texture, levels, format, width, height);
    made(texture, format);
}

void APIENTRY texture_storage_3d(GLuint texture, GLsizei levels, GLenum format, GLsizei width,
                                 GLsizei height, GLsizei depth) {
    REAL(glTextureStorage3D)(texture, levels, format, width, height, depth);
    made(texture, format);
}

GLsizeiptr bytes_of(GLenum format, GLenum type, GLsizeiptr texels) {
    const bool one = format == GL_RED || format == GL_RED_INTEGER, two = format == GL_RG;
    return texels * (one ? 1 : two ? 2 : 4) * (type == GL_HALF_FLOAT ? 2 : 4);
}

void APIENTRY texture_sub_image_2d(GLuint texture, GLint level, GLint x, GLint y, GLsizei width,
                                   GLsizei height, GLenum format, GLenum type, const void* pixels) {
    trace("upload");
    storages[texture].written = false;
    if (behaves("order")) {
        order::writes_texture(texture);
        order::takes_pixels(pixels, bytes_of(format, type, GLsizeiptr(width) * height));
    }
    REAL(glTextureSubImage2D)(texture, level, x, y, width, height, format, type, pixels);
}

void APIENTRY texture_sub_image_3d(GLuint texture, GLint level, GLint x, GLint y, GLint z,
                                   GLsizei width, GLsizei height, GLsizei depth, GLenum format,
                                   GLenum type, const void* pixels) {
    trace("upload");
    storages[texture].written = false;
    if (behaves("order")) {
        order::writes_texture(texture);
        order::takes_pixels(pixels, bytes_of(format, type, GLsizeiptr(width) * height * depth));
    }
    REAL(glTextureSubImage3D)
    (texture, level, x, y, z, width, height, depth, format, type, pixels);
}

void APIENTRY delete_textures(GLsizei count, const GLuint* textures) {
    for (GLsizei i = 0; i < count; ++i) {
        storages.erase(textures[i]);
        order::deletes_texture(textures[i]);
    }
    REAL(glDeleteTextures)(count, textures);
}

void APIENTRY bind_image_texture(GLuint unit, GLuint texture, GLint level, GLboolean layered,
                                 GLint layer, GLenum access, GLenum format) {
    refuse(behaves("limits") && GLint(unit) >= kImages, "image unit", long(unit));
    if (access != GL_READ_ONLY && texture) storages[texture].written = true;
    bound_images[unit] = format;
    REAL(glBindImageTexture)(unit, texture, level, layered, layer, access, format);
}

// The uniform blocks of a frame: it begins.
void APIENTRY flush_mapped(GLuint buffer, GLintptr offset, GLsizeiptr size) {
    trace("frame");
    if (behaves("order")) order::fills_range(buffer, offset, size);
    if (behaves("nan"))
        for (const auto& [texture, storage] : storages)
            if (storage.written && storage.format != GL_NONE)
                fill_with_nan(texture, storage.format);
    REAL(glFlushMappedNamedBufferRange)(buffer, offset, size);
}

void APIENTRY get_texture(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width,
                          GLsizei height, GLsizei depth, GLenum format, GLenum type, GLsizei bytes,
                          void* pixels) {
    trace("read");
    if (behaves("order")) order::reads_texture(texture);
    REAL(glGetTextureSubImage)
    (texture, level, x, y, z, width, height, depth, format, type, bytes, pixels);
    if (!behaves("order")) return;
    REAL(glFinish)();
    order::brings_pixels(pixels, bytes_of(format, type, GLsizeiptr(width) * height * depth));
}

void APIENTRY clear_buffer(GLuint buffer, GLenum internal, GLintptr offset, GLsizeiptr size,
                           GLenum format, GLenum type, const void* value) {
    if (behaves("order")) order::writes_buffer(buffer);
    REAL(glClearNamedBufferSubData)(buffer, internal, offset, size, format, type, value);
}

void APIENTRY get_buffer(GLuint buffer, GLintptr offset, GLsizeiptr size, void* bytes) {
    if (behaves("order")) order::reads_buffer(buffer);
    REAL(glGetNamedBufferSubData)(buffer, offset, size, bytes);
}

void* APIENTRY map_buffer(GLuint buffer, GLintptr offset, GLsizeiptr size, GLbitfield access) {
    void* const memory = REAL(glMapNamedBufferRange)(buffer, offset, size, access);
    order::maps(buffer, memory);
    return memory;
}

void APIENTRY delete_buffers(GLsizei count, const GLuint* buffers) {
    for (GLsizei i = 0; i < count; ++i) order::deletes_buffer(buffers[i]);
    REAL(glDeleteBuffers)(count, buffers);
}

constexpr int kQuestions = 8;
struct FenceState {
    uint64_t number;
    int asked = 0;
};
std::map<GLsync, FenceState> fences;
uint64_t made_fences = 0, passed_fences = 0;  // a device passes them in order

void pass_fences(uint64_t count) {
    passed_fences = std::max(passed_fences, count);
    order::passes_fences(passed_fences);
}

GLsync APIENTRY fence_sync(GLenum condition, GLbitfield flags) {
    const GLsync fence = REAL(glFenceSync)(condition, flags);
    fences[fence] = {++made_fences};
    order::makes_fence();
    return fence;
}

GLenum APIENTRY client_wait(GLsync fence, GLbitfield flags, GLuint64 timeout) {
    if (timeout > 0) trace("wait");
    if (const auto own = fences.find(fence); own != fences.end()) {
        auto& [number, asked] = own->second;
        if (behaves("late") && timeout == 0 && number > passed_fences && ++asked < kQuestions)
            return GL_TIMEOUT_EXPIRED;
        pass_fences(number);
    }
    return REAL(glClientWaitSync)(fence, flags, GL_TIMEOUT_IGNORED);
}

void APIENTRY delete_sync(GLsync fence) {
    fences.erase(fence);
    REAL(glDeleteSync)(fence);
}

void APIENTRY finish() {
    REAL(glFinish)();
    order::makes_fence();
    pass_fences(++made_fences);
}

const GLubyte* APIENTRY get_string(GLenum name) {
    if ((behaves("late") || behaves("order")) && name == GL_RENDERER)
        return reinterpret_cast<const GLubyte*>("gpu_like");
    return REAL(glGetString)(name);
}

void APIENTRY bind_buffer_base(GLenum target, GLuint index, GLuint buffer) {
    refuse(behaves("limits") && target == GL_SHADER_STORAGE_BUFFER && GLint(index) >= kLists,
           "storage buffer", long(index));
    REAL(glBindBufferBase)(target, index, buffer);
}

void APIENTRY bind_buffer_range(GLenum target, GLuint index, GLuint buffer, GLintptr offset,
                                GLsizeiptr size) {
    if (target == GL_UNIFORM_BUFFER) {
        refuse(behaves("align") && offset % kAlignment != 0, "offset of a uniform block",
               long(offset));
        refuse(behaves("limits") && size > kBlockBytes, "bytes of a uniform block", long(size));
    }
    REAL(glBindBufferRange)(target, index, buffer, offset, size);
}

void APIENTRY get_integer(GLenum name, GLint* value) {
    REAL(glGetIntegerv)(name, value);
    if (behaves("align") && name == GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT) *value = kAlignment;
    // Under every behavior: with more, a software renderer reads textures as images
    // (chain/gl/image_reads.h), which no GPU does.
    if (name == GL_MAX_COMPUTE_IMAGE_UNIFORMS) *value = kImages;
    if (!behaves("limits")) return;
    if (name == GL_MAX_IMAGE_UNITS) *value = kImages;
    if (name == GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS ||
        name == GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS)
        *value = kLists;
    if (name == GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS) *value = kTextures;
    if (name == GL_MAX_UNIFORM_BLOCK_SIZE) *value = kBlockBytes;
}

void APIENTRY get_integer_64(GLenum name, GLint64* value) {
    REAL(glGetInteger64v)(name, value);
    if (behaves("limits") && name == GL_MAX_SHADER_STORAGE_BLOCK_SIZE) *value = kListBytes;
}

GLuint current_program() {
    GLint program = 0;
    REAL(glGetIntegerv)(GL_CURRENT_PROGRAM, &program);
    return GLuint(program);
}

void tell_half_images() {
    if (!behaves("half")) return;
    const GLuint program = current_program();
    GLint half = 0;
    for (const auto& [unit, format] : bound_images)
        if (is_half(format)) half |= 1 << unit;
    const GLint location = glGetUniformLocation(program, "gpu_like_half");
    if (location >= 0) glProgramUniform1i(program, location, half);
}

void APIENTRY dispatch(GLuint x, GLuint y, GLuint z) {
    trace("dispatch");
    tell_half_images();
    if (behaves("order")) order::dispatches(current_program(), false);
    REAL(glDispatchCompute)(x, y, z);
}

void APIENTRY dispatch_indirect(GLintptr offset) {
    trace("dispatch");
    tell_half_images();
    if (behaves("order")) order::dispatches(current_program(), true);
    REAL(glDispatchComputeIndirect)(offset);
}

void APIENTRY memory_barrier(GLbitfield bits) {
    order::passes_barrier(bits);
    REAL(glMemoryBarrier)(bits);
}

__attribute__((constructor)) void replace() {
    epoxy_glShaderSource = shader_source;
    epoxy_glLinkProgram = link_program;
    epoxy_glGetProgramiv = get_program;
    epoxy_glUseProgram = use_program;
    epoxy_glDeleteShader = delete_shader;
    epoxy_glTextureStorage2D = texture_storage_2d;
    epoxy_glTextureStorage3D = texture_storage_3d;
    epoxy_glTextureSubImage2D = texture_sub_image_2d;
    epoxy_glTextureSubImage3D = texture_sub_image_3d;
    epoxy_glDeleteTextures = delete_textures;
    epoxy_glBindImageTexture = bind_image_texture;
    epoxy_glFlushMappedNamedBufferRange = flush_mapped;
    epoxy_glGetTextureSubImage = get_texture;
    epoxy_glClearNamedBufferSubData = clear_buffer;
    epoxy_glGetNamedBufferSubData = get_buffer;
    epoxy_glMapNamedBufferRange = map_buffer;
    epoxy_glDeleteBuffers = delete_buffers;
    epoxy_glFenceSync = fence_sync;
    epoxy_glClientWaitSync = client_wait;
    epoxy_glDeleteSync = delete_sync;
    epoxy_glFinish = finish;
    epoxy_glMemoryBarrier = memory_barrier;
    epoxy_glGetString = get_string;
    epoxy_glBindBufferBase = bind_buffer_base;
    epoxy_glBindBufferRange = bind_buffer_range;
    epoxy_glGetIntegerv = get_integer;
    epoxy_glGetInteger64v = get_integer_64;
    epoxy_glDispatchCompute = dispatch;
    epoxy_glDispatchComputeIndirect = dispatch_indirect;
}

}  // namespace
}  // namespace postchain::test

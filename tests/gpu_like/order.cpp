#include "tests/gpu_like/order.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

namespace postchain::test::order {
namespace {

enum class Kind { texture, buffer };
using Object = std::pair<Kind, GLuint>;

[[noreturn]] void fail(const Object& object, const char* what, const char* missing) {
    std::fprintf(stderr, "gpu_like: %s %u is %s without %s\n",
                 object.first == Kind::texture ? "texture" : "buffer", object.second, what,
                 missing);
    std::abort();
}

// The last step that used an object so, and the barriers since.
struct Use {
    uint64_t step = 0;
    GLbitfield barriers = 0;
};
std::map<Object, Use> written, read;
uint64_t step = 1;

// Dispatches of the step `own` work on different pixels.
void need_barrier(const std::map<Object, Use>& uses, const Object& object, uint64_t own,
                  const char* what, GLbitfield bit, const char* name) {
    const auto use = uses.find(object);
    if (use != uses.end() && use->second.step != own && !(use->second.barriers & bit))
        fail(object, what, name);
}
#define NEED_BARRIER(uses, object, own, what, bit) need_barrier(uses, object, own, what, bit, #bit)

void forget(const Object& object) {
    written.erase(object);
    read.erase(object);
}

struct Program {
    struct Texture {
        GLuint unit;
        GLenum binding;  // glGet's name for what is bound
    };
    struct List {
        GLuint binding;
        bool readonly;
    };
    std::vector<Texture> textures;
    std::vector<GLuint> images;
    std::vector<List> lists;
    std::vector<GLuint> blocks;
};
std::map<GLuint, Program> programs;

GLuint resources(GLuint program, GLenum interface) {
    GLint count = 0;
    glGetProgramInterfaceiv(program, interface, GL_ACTIVE_RESOURCES, &count);
    return GLuint(count);
}

GLint property(GLuint program, GLenum interface, GLuint index, GLenum what) {
    GLint value = 0;
    glGetProgramResourceiv(program, interface, index, 1, &what, 1, nullptr, &value);
    return value;
}

GLuint bound(GLenum what) {
    GLint name = 0;
    glGetIntegerv(what, &name);
    return GLuint(name);
}

GLuint bound(GLenum what, GLuint unit) {
    GLint name = 0;
    glGetIntegeri_v(what, unit, &name);
    return GLuint(name);
}

struct Range {
    GLuint buffer;
    GLintptr begin, end;
    uint64_t fence;  // the first after its use
};
std::vector<Range> ranges;
struct Coming {
    Range range;
    std::vector<char> pixels;
};
std::vector<Coming> coming;
std::map<GLuint, char*> memory;
uint64_t fences = 0;

void use_range(GLuint buffer, GLintptr begin, GLsizeiptr bytes) {
    ranges.push_back({buffer, begin, begin + bytes, fences + 1});
}

void need_unused(GLuint buffer, GLintptr begin, GLsizeiptr bytes) {
    for (const Range& range : ranges)
        if (range.buffer == buffer && range.begin < begin + bytes && begin < range.end)
            fail({Kind::buffer, buffer}, "used again", "a wait for a fence after its last use");
}

}  // namespace

GLenum texture_binding(GLint type) {
    switch (type) {
        case GL_SAMPLER_2D:
        case GL_UNSIGNED_INT_SAMPLER_2D:
            return GL_TEXTURE_BINDING_2D;
        case GL_SAMPLER_2D_ARRAY:
        case GL_UNSIGNED_INT_SAMPLER_2D_ARRAY:
            return GL_TEXTURE_BINDING_2D_ARRAY;
        default:
            return GL_NONE;
    }
}

bool is_image(GLint type) {
    return type == GL_IMAGE_2D || type == GL_IMAGE_2D_ARRAY || type == GL_UNSIGNED_INT_IMAGE_2D ||
           type == GL_UNSIGNED_INT_IMAGE_2D_ARRAY;
}

void linked(GLuint program, const std::string& source) {
    Program made;
    for (GLuint i = 0; i < resources(program, GL_UNIFORM); ++i) {
        const GLint type = property(program, GL_UNIFORM, i, GL_TYPE);
        const GLenum binding = texture_binding(type);
        if (binding == GL_NONE && !is_image(type)) continue;
        GLint unit = 0;
        glGetUniformiv(program, property(program, GL_UNIFORM, i, GL_LOCATION), &unit);
        if (binding == GL_NONE)
            made.images.push_back(GLuint(unit));
        else
            made.textures.push_back({GLuint(unit), binding});
    }
    for (GLuint i = 0; i < resources(program, GL_SHADER_STORAGE_BLOCK); ++i) {
        char name[256] = {};
        glGetProgramResourceName(program, GL_SHADER_STORAGE_BLOCK, i, sizeof(name), nullptr, name);
        const std::string readonly = std::string("readonly buffer ") + name + " ";
        made.lists.push_back(
            {GLuint(property(program, GL_SHADER_STORAGE_BLOCK, i, GL_BUFFER_BINDING)),
             source.find(readonly) != source.npos});
    }
    for (GLuint i = 0; i < resources(program, GL_UNIFORM_BLOCK); ++i)
        made.blocks.push_back(GLuint(property(program, GL_UNIFORM_BLOCK, i, GL_BUFFER_BINDING)));
    programs[program] = std::move(made);
}

void step_begins() {
    ++step;
}

void dispatches(GLuint program, bool indirect) {
    const Program& used = programs[program];
    std::vector<Object> reads, writes;
    for (const auto& [unit, binding] : used.textures) {
        const Object texture = {Kind::texture, bound(binding, unit)};
        NEED_BARRIER(written, texture, step, "fetched", GL_TEXTURE_FETCH_BARRIER_BIT);
        reads.push_back(texture);
    }
    for (const GLuint unit : used.images) {
        const Object texture = {Kind::texture, bound(GL_IMAGE_BINDING_NAME, unit)};
        const GLuint access = bound(GL_IMAGE_BINDING_ACCESS, unit);
        if (access != GL_WRITE_ONLY) {
            NEED_BARRIER(written, texture, step, "read", GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
            reads.push_back(texture);
        }
        if (access != GL_READ_ONLY) {
            NEED_BARRIER(read, texture, step, "written over", GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
            writes.push_back(texture);
        }
    }
    for (const auto& [binding, readonly] : used.lists) {
        const Object list = {Kind::buffer, bound(GL_SHADER_STORAGE_BUFFER_BINDING, binding)};
        NEED_BARRIER(written, list, step, "used", GL_SHADER_STORAGE_BARRIER_BIT);
        if (!readonly) writes.push_back(list);
    }
    if (indirect) {
        const Object list = {Kind::buffer, bound(GL_DISPATCH_INDIRECT_BUFFER_BINDING)};
        NEED_BARRIER(written, list, step, "the size of a dispatch", GL_COMMAND_BARRIER_BIT);
    }
    for (const Object& object : reads) read[object] = {step, 0};
    for (const Object& object : writes) written[object] = {step, 0};
    for (const GLuint block : used.blocks) {
        GLint64 begin = 0, bytes = 0;
        glGetInteger64i_v(GL_UNIFORM_BUFFER_START, block, &begin);
        glGetInteger64i_v(GL_UNIFORM_BUFFER_SIZE, block, &bytes);
        use_range(bound(GL_UNIFORM_BUFFER_BINDING, block), begin, bytes);
    }
}

void passes_barrier(GLbitfield bits) {
    for (auto* uses : {&written, &read})
        for (auto& [object, use] : *uses) use.barriers |= bits;
}

void writes_texture(GLuint texture) {
    const Object object = {Kind::texture, texture};
    NEED_BARRIER(written, object, 0, "uploaded", GL_TEXTURE_UPDATE_BARRIER_BIT);
    forget(object);
}

void reads_texture(GLuint texture) {
    const Object object = {Kind::texture, texture};
    NEED_BARRIER(written, object, 0, "read back", GL_TEXTURE_UPDATE_BARRIER_BIT);
}

void writes_buffer(GLuint buffer) {
    const Object object = {Kind::buffer, buffer};
    NEED_BARRIER(written, object, 0, "cleared", GL_BUFFER_UPDATE_BARRIER_BIT);
    forget(object);
}

void reads_buffer(GLuint buffer) {
    const Object object = {Kind::buffer, buffer};
    NEED_BARRIER(written, object, 0, "read back", GL_BUFFER_UPDATE_BARRIER_BIT);
}

void deletes_texture(GLuint texture) {
    forget({Kind::texture, texture});
}

void deletes_buffer(GLuint buffer) {
    forget({Kind::buffer, buffer});
    memory.erase(buffer);
    std::erase_if(ranges, [&](const Range& range) { return range.buffer == buffer; });
    std::erase_if(coming, [&](const Coming& one) { return one.range.buffer == buffer; });
}

void maps(GLuint buffer, void* place) {
    memory[buffer] = static_cast<char*>(place);
}

void fills_range(GLuint buffer, GLintptr offset, GLsizeiptr bytes) {
    need_unused(buffer, offset, bytes);
}

void takes_pixels(const void* place, GLsizeiptr bytes) {
    const GLuint buffer = bound(GL_PIXEL_UNPACK_BUFFER_BINDING);
    if (buffer == 0) return;
    const auto offset = reinterpret_cast<GLintptr>(place);
    need_unused(buffer, offset, bytes);
    use_range(buffer, offset, bytes);
}

void brings_pixels(void* place, GLsizeiptr bytes) {
    const GLuint buffer = bound(GL_PIXEL_PACK_BUFFER_BINDING);
    if (buffer == 0) return;
    const auto offset = reinterpret_cast<GLintptr>(place);
    need_unused(buffer, offset, bytes);
    use_range(buffer, offset, bytes);
    char* const pixels = memory.at(buffer) + offset;
    coming.push_back({ranges.back(), {pixels, pixels + bytes}});
    std::memset(pixels, 0xff, size_t(bytes));  // NaN
}

void makes_fence() {
    ++fences;
}

void passes_fences(uint64_t count) {
    for (const auto& [range, pixels] : coming)
        if (range.fence <= count)
            std::memcpy(memory.at(range.buffer) + range.begin, pixels.data(), pixels.size());
    std::erase_if(coming, [&](const Coming& one) { return one.range.fence <= count; });
    std::erase_if(ranges, [&](const Range& range) { return range.fence <= count; });
}

}  // namespace postchain::test::order

#include "tests/guest/gl_calls.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

namespace postchain::test {
namespace {

bool counting = false, silent = false;
GlFaults faults;
GLbitfield newest_barrier = 0;
int64_t alive = 0;

// Compared as types, because with sanitizers a comparison of addresses is not a constant
// expression.
template <auto*>
struct Variable;
template <auto* kVariable, auto* kOther>
constexpr bool is_same = std::is_same_v<Variable<kVariable>, Variable<kOther>>;

// Objects that a call makes, less those that it deletes.
template <auto* kVariable, class... A>
int64_t made_by(A... arguments) {
    [[maybe_unused]] const std::tuple given(arguments...);
    const auto deleted = [](GLsizei count, const GLuint* names) {
        return std::count_if(names, names + count, [](GLuint name) { return name != 0; });
    };
    if constexpr (is_same<kVariable, &epoxy_glCreateBuffers> ||
                  is_same<kVariable, &epoxy_glCreateSamplers>) {
        return std::get<0>(given);
    } else if constexpr (is_same<kVariable, &epoxy_glCreateTextures> ||
                         is_same<kVariable, &epoxy_glCreateQueries>) {
        return std::get<1>(given);
    } else if constexpr (is_same<kVariable, &epoxy_glCreateProgram> ||
                         is_same<kVariable, &epoxy_glCreateShader> ||
                         is_same<kVariable, &epoxy_glFenceSync>) {
        return 1;
    } else if constexpr (is_same<kVariable, &epoxy_glDeleteBuffers> ||
                         is_same<kVariable, &epoxy_glDeleteSamplers> ||
                         is_same<kVariable, &epoxy_glDeleteTextures> ||
                         is_same<kVariable, &epoxy_glDeleteQueries>) {
        return -deleted(std::get<0>(given), std::get<1>(given));
    } else if constexpr (is_same<kVariable, &epoxy_glDeleteProgram> ||
                         is_same<kVariable, &epoxy_glDeleteShader> ||
                         is_same<kVariable, &epoxy_glDeleteSync>) {
        return std::get<0>(given) ? -1 : 0;
    }
    return 0;
}

// Replaces the function in one of epoxy's variables.
template <auto* kVariable>
struct Counted;
template <class R, class... A, R (**kVariable)(A...)>
struct Counted<kVariable> {
    static inline R (*original)(A...) = nullptr;
    static inline uint64_t count = 0;

    static R call(A... arguments) {
        count += counting;
        alive += made_by<kVariable>(arguments...);
        if constexpr (is_same<kVariable, &epoxy_glMemoryBarrier>)
            newest_barrier = std::get<0>(std::tuple(arguments...));
        if (silent) return R();
        if constexpr (is_same<kVariable, &epoxy_glDispatchCompute> ||
                      is_same<kVariable, &epoxy_glDispatchComputeIndirect>) {
            if (faults.silent_dispatches) return;
            // Its own dispatches, if there are any, are not seen.
            if (const auto call_first = std::exchange(faults.before_dispatch, nullptr)) {
                call_first();
                faults.before_dispatch = call_first;
            }
        }
        if constexpr (is_same<kVariable, &epoxy_glTextureStorage2D>) {
            if (faults.refuses_storage) return glEnable(0xffff);  // an error, as GL would leave one
        } else if constexpr (is_same<kVariable, &epoxy_glGetIntegerv>) {
            const auto [name, value] = std::tuple(arguments...);
            if (faults.tells_loss && name == GL_RESET_NOTIFICATION_STRATEGY) {
                *value = GL_LOSE_CONTEXT_ON_RESET;
                return;
            }
        } else if constexpr (is_same<kVariable, &epoxy_glClientWaitSync>) {
            if (faults.late_fences && std::get<2>(std::tuple(arguments...)) == 0)
                return GL_TIMEOUT_EXPIRED;
        } else if constexpr (is_same<kVariable, &epoxy_glGetGraphicsResetStatus>) {
            if (faults.is_lost) return GL_UNKNOWN_CONTEXT_RESET;
        } else if constexpr (is_same<kVariable, &epoxy_glGetString>) {
            if (const GLenum name = std::get<0>(std::tuple(arguments...)); name == faults.renamed) {
                static std::string other;
                faults.renamed = 0;
                other = std::string(reinterpret_cast<const char*>(glGetString(name))) + "'";
                faults.renamed = name;
                return reinterpret_cast<const GLubyte*>(other.c_str());
            }
        }
        // The first call of a function makes epoxy look it up by its variable.
        const struct Again {
            Again() { *kVariable = original; }
            ~Again() { install(); }
        } again;
        if constexpr (is_same<kVariable, &epoxy_glTextureStorage2D>)
            return faults.fills_textures ? make_filled(arguments...) : original(arguments...);
        else
            return original(arguments...);
    }
    // Stands for glTextureStorage2D.
    static void make_filled(A... arguments) {
        original(arguments...);
        const auto [texture, levels, format, width, height] = std::tuple(arguments...);
        const bool one = format == GL_R32UI, whole = one || format == GL_RGBA32UI;
        const GLuint ones[] = {~0u, ~0u, ~0u, ~0u};
        glClearTexImage(texture, 0,
                        one     ? GL_RED_INTEGER
                        : whole ? GL_RGBA_INTEGER
                                : GL_RGBA,
                        whole ? GL_UNSIGNED_INT : GL_FLOAT, ones);
    }
    static void install() {
        if (*kVariable == call) return;
        original = *kVariable;
        *kVariable = call;
    }
};

#define FUNCTIONS(F)                 \
    F(glActiveTexture)               \
    F(glAttachShader)                \
    F(glBindBuffer)                  \
    F(glBindBufferBase)              \
    F(glBindBufferRange)             \
    F(glBindImageTexture)            \
    F(glBindSampler)                 \
    F(glBindTexture)                 \
    F(glBindTextureUnit)             \
    F(glClearNamedBufferSubData)     \
    F(glClearTexImage)               \
    F(glClientWaitSync)              \
    F(glCompileShader)               \
    F(glCreateBuffers)               \
    F(glCreateProgram)               \
    F(glCreateQueries)               \
    F(glCreateSamplers)              \
    F(glCreateShader)                \
    F(glCreateTextures)              \
    F(glDeleteBuffers)               \
    F(glDeleteProgram)               \
    F(glDeleteQueries)               \
    F(glDeleteSamplers)              \
    F(glDeleteShader)                \
    F(glDeleteSync)                  \
    F(glDeleteTextures)              \
    F(glDispatchCompute)             \
    F(glDispatchComputeIndirect)     \
    F(glFenceSync)                   \
    F(glFinish)                      \
    F(glFlush)                       \
    F(glFlushMappedNamedBufferRange) \
    F(glGetActiveUniformBlockName)   \
    F(glGetActiveUniformBlockiv)     \
    F(glGetError)                    \
    F(glGetGraphicsResetStatus)      \
    F(glGetInteger64i_v)             \
    F(glGetInteger64v)               \
    F(glGetIntegeri_v)               \
    F(glGetIntegerv)                 \
    F(glGetNamedBufferParameteriv)   \
    F(glGetNamedBufferSubData)       \
    F(glGetProgramBinary)            \
    F(glGetProgramInfoLog)           \
    F(glGetProgramiv)                \
    F(glGetQueryObjectiv)            \
    F(glGetQueryObjectui64v)         \
    F(glGetShaderInfoLog)            \
    F(glGetShaderiv)                 \
    F(glGetString)                   \
    F(glGetTextureLevelParameteriv)  \
    F(glGetTextureParameteriv)       \
    F(glGetTextureSubImage)          \
    F(glGetUniformLocation)          \
    F(glIsProgram)                   \
    F(glIsTexture)                   \
    F(glLinkProgram)                 \
    F(glMapNamedBufferRange)         \
    F(glMemoryBarrier)               \
    F(glNamedBufferStorage)          \
    F(glObjectLabel)                 \
    F(glPixelStorei)                 \
    F(glPopDebugGroup)               \
    F(glProgramBinary)               \
    F(glPushDebugGroup)              \
    F(glQueryCounter)                \
    F(glSamplerParameteri)           \
    F(glShaderSource)                \
    F(glTextureStorage2D)            \
    F(glTextureStorage3D)            \
    F(glTextureSubImage2D)           \
    F(glTextureSubImage3D)           \
    F(glUniform1i)                   \
    F(glUniform2ui)                  \
    F(glUseProgram)

void install() {
#define INSTALL(name) Counted<&epoxy_##name>::install();
    FUNCTIONS(INSTALL)
#undef INSTALL
}

}  // namespace

void GlCalls::start() {
    install();
#define CLEAR(name) Counted<& epoxy_##name>::count = 0;
    FUNCTIONS(CLEAR)
#undef CLEAR
    counting = true;
    alive = 0;
}

int64_t GlCalls::objects() {
    return alive;
}

std::map<std::string, uint64_t> GlCalls::stop() {
    counting = false;
    std::map<std::string, uint64_t> counts;
#define READ(name) \
    if (Counted<&epoxy_##name>::count) counts[#name] = Counted<&epoxy_##name>::count;
    FUNCTIONS(READ)
#undef READ
    return counts;
}

uint32_t GlCalls::last_barrier() {
    return newest_barrier;
}

std::vector<std::string> GlCalls::names() {
#define NAME(name) #name,
    return {FUNCTIONS(NAME)};
#undef NAME
}

void silence_gl(bool on) {
    install();
    silent = on;
}

GlFaults& gl_faults() {
    install();
    return faults;
}

}  // namespace postchain::test

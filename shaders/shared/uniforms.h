// Makes one header a C++ struct and a GLSL uniform block of the same layout (std140).
//
//   #include "shared/uniforms.h"
//   UNIFORMS_BEGIN(GatherUniforms)
//       ivec2 size;
//       float radius_px;
//       float pad0;
//   UNIFORMS_END
//
// In GLSL the members are read as uniforms.size; in C++ the struct is
// postchain::shared::GatherUniforms, and kName its name in both. Only int, uint, float, ivec2,
// vec2, ivec4, vec4 (std140 gives vec3 a layout C++ does not). Order the members so that each vec4
// starts at a multiple of 16 bytes and each vec2 at one of 8, end on a multiple of 16, and assert
// size and offsets on the C++ side.
#ifndef POSTCHAIN_SHARED_UNIFORMS_H
#define POSTCHAIN_SHARED_UNIFORMS_H

#ifdef __cplusplus
#include <glm/glm.hpp>
namespace postchain::shared {
using uint = unsigned int;
using glm::ivec2;
using glm::ivec4;
using glm::vec2;
using glm::vec4;
}  // namespace postchain::shared
#define UNIFORMS_BEGIN(Name)                            \
    namespace postchain::shared { struct alignas(16) Name { \
    static constexpr const char* kName = #Name;
#define UNIFORMS_END }; }
#else
#define UNIFORMS_BEGIN(Name) layout(std140, binding = 0) uniform Name {
#define UNIFORMS_END } uniforms;
#endif

#endif

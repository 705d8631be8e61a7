// Programs in the languages of devices, translated from SPIR-V by SPIRV-Cross.
//
// The units of a plan have fixed places in each language, whatever else a program uses:
//
//                    HLSL, space 0    MSL
//   texture n        t[n]             [[texture(n)]]
//   image n          u[n]             [[texture(16 + n)]]
//   list n, read     t[16 + n]        [[buffer(2 + n)]]
//   list n, written  u[16 + n]        [[buffer(2 + n)]]
//   uniforms         b0               [[buffer(0)]]
//   first group      b1               [[buffer(1)]]
#pragma once

#include <string>
#include <string_view>

#include "tools/apps/programs/module.h"

namespace postchain::programs {

enum class Language { spirv, hlsl, msl, glsl };

struct LanguageFacts {
    std::string_view name, ending, entry;
};
const LanguageFacts& facts_of(Language language);

// Whether this build writes the language. It writes SPIR-V and GLSL always.
bool is_built(Language language);

// The source of a program as it is compiled for translation to HLSL and MSL: without samplers,
// because programs read textures without filters.
std::string without_samplers(const std::string& source);

struct Translation {
    std::string text;
    const char* shader_model = "";  // of HLSL: the least that has all that the program uses
};

// A program in HLSL or MSL. `interface` is that of `spirv`. Errors (internal): what the language
// lacks.
Result<Translation> translate(const vk::Spirv& spirv, const Interface& interface,
                              Language language);

struct Place {
    std::string text;  // "t3", "texture(3)"
    uint32_t number = 0;
};
Place place_of(const ProgramUnit& unit, Language language);

}  // namespace postchain::programs

// SPIR-V of the compute programs, compiled from the sources that GL has (chain/vk/compiler.h), and
// the units that each uses.
#pragma once

#include <cstdint>
#include <vector>

#include "chain/base/status.h"

namespace postchain::vk {

enum class Kind : uint32_t { texture, image, list, uniforms };

struct Unit {
    Kind kind = Kind::texture;
    uint32_t number = 0;  // layout(binding = number) of its kind
    bool plain = false;   // of a sampler2D or image2D: neither an array nor of integers
    bool operator==(const Unit&) const = default;
};

// GL counts the units of each kind from 0. A descriptor set has one row of bindings: a fixed
// number of each kind.
inline constexpr uint32_t kUnitsOfAKind = 16;
constexpr uint32_t binding_of(Kind kind, uint32_t number) {
    return uint32_t(kind) * kUnitsOfAKind + number;
}

struct Spirv {
    std::vector<uint32_t> words;  // bindings as in binding_of()
    std::vector<Unit> units;      // that the program uses
};

// Rewrites the bindings of a module. StatusCode::internal: it is none, or has too many units.
Result<Spirv> with_units(std::vector<uint32_t> words);

}  // namespace postchain::vk

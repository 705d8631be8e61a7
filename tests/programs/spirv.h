// Reads a SPIR-V module of a compute shader.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>

namespace postchain::test {

enum class Kind { texture, image, list };

struct Unit {
    Kind kind;
    uint32_t number;
    auto operator<=>(const Unit&) const = default;
};

struct Spirv {
    std::map<std::string, size_t> blocks;  // uniform blocks: bytes, a multiple of 16
    std::set<Unit> units;                  // textures, images and storage buffers that it uses
    bool samples = false;                  // reads a texture other than by texelFetch
    // Functions with a sum of floats that a compiler may fuse with a product, a built-in function
    // with one inside, or a quotient that it may make a product, and its line.
    std::set<std::string> contracted;
    std::set<std::string> arrays;  // variables of functions and of invocations that are or hold one
};

Spirv read_spirv(std::span<const uint32_t> words);

}  // namespace postchain::test

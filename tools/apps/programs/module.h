// The facts about a program in SPIR-V that a host needs: its work group, its units and its uniform
// block.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/vk/spirv.h"

namespace postchain::programs {

struct ProgramUnit {
    vk::Unit unit;
    uint32_t id = 0;  // of its variable
    std::string name;
    bool array = false;    // of planes
    bool integer = false;  // its components are uint, otherwise float
    bool reads = true, writes = false;
};

struct BlockMember {
    std::string name, type;  // of GLSL: "ivec2"
    uint32_t offset = 0;
    uint32_t count = 0, stride = 0;  // of an array; 0: none
};

struct Block {
    std::string name;  // of its type: "GuestUniforms"
    uint32_t id = 0;   // of its variable; 0: the program has none
    uint32_t bytes = 0;
    std::vector<BlockMember> members;
};

struct Interface {
    std::array<uint32_t, 3> group_size = {1, 1, 1};
    uint32_t shared_bytes = 0;       // of a work group, at most
    std::vector<ProgramUnit> units;  // without the uniform block
    Block uniforms;
    bool first_group = false;  // reads the push constants
    uint32_t precise = 0;      // operations that may not be contracted
};

// The facts of a module whose bindings are those of vk::with_units(). StatusCode::internal: it is
// none of the compiler's.
Result<Interface> interface_of(const vk::Spirv& spirv);

// A module in which each atomic operation on a variable of the work group follows a load of it.
// SPIRV-Cross passes such a variable to a function in MSL only if the function loads it.
std::vector<uint32_t> with_loads_before_atomics(std::span<const uint32_t> words);

}  // namespace postchain::programs

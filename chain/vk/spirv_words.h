// The words of a SPIR-V module: its instructions, one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace postchain::vk {

using Words = std::span<const uint32_t>;  // of a module, or of one instruction

constexpr uint32_t kSpirvMagic = 0x07230203, kSpirvHeaderWords = 5;

enum class Op : uint32_t {
    name = 5,
    member_name = 6,
    execution_mode = 16,
    type_bool = 20,
    type_int = 21,
    type_float = 22,
    type_vector = 23,
    type_sampled_image = 27,
    type_array = 28,
    type_struct = 30,
    type_pointer = 32,
    constant = 43,
    function = 54,
    function_call = 57,
    variable = 59,
    image_texel_pointer = 60,
    load = 61,
    access_chain = 65,
    in_bounds_access_chain = 66,
    array_length = 68,
    decorate = 71,
    member_decorate = 72,
    atomic_exchange = 229,
    atomic_xor = 242,
};
enum class Decoration : uint32_t {
    buffer_block = 3,
    array_stride = 6,
    non_writable = 24,
    non_readable = 25,
    binding = 33,
    offset = 35,
    no_contraction = 42,
};
enum class StorageClass : uint32_t {
    uniform = 2,
    workgroup = 4,
    push_constant = 9,
    storage_buffer = 12,
};

inline Op op_of(Words one) {
    return Op(one[0] & 0xffff);
}

// The storage class of a variable.
inline StorageClass storage_of(Words one) {
    return StorageClass(one[3]);
}

// Calls visit(instruction) for each. False if the words are no module.
template <class Visit>
bool visit_instructions(Words words, Visit visit) {
    if (words.size() < kSpirvHeaderWords || words[0] != kSpirvMagic) return false;
    for (size_t at = kSpirvHeaderWords; at < words.size();) {
        const size_t size = words[at] >> 16;
        if (size == 0 || at + size > words.size()) return false;
        visit(words.subspan(at, size));
        at += size;
    }
    return true;
}

}  // namespace postchain::vk

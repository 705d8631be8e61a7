#include "chain/vk/spirv.h"

#include <algorithm>
#include <map>
#include <set>
#include <span>

namespace postchain::vk {
namespace {

constexpr uint32_t kMagic = 0x07230203;

enum Op : uint32_t {
    kTypeInt = 21,
    kTypeFloat = 22,
    kTypeImage = 25,
    kTypeSampledImage = 27,
    kTypePointer = 32,
    kFunction = 54,
    kFunctionCall = 57,
    kVariable = 59,
    kImageTexelPointer = 60,
    kLoad = 61,
    kAccessChain = 65,
    kInBoundsAccessChain = 66,
    kArrayLength = 68,
    kDecorate = 71,
};
enum Decoration : uint32_t { kBufferBlock = 3, kBinding = 33 };
enum StorageClass : uint32_t { kUniformConstant = 0, kUniform = 2, kStorageBuffer = 12 };
constexpr uint32_t kSampled = 1;  // of an image: read as a texture, with a sampler or without

using Words = std::span<const uint32_t>;

// The declarations of a module.
struct Module {
    std::map<uint32_t, Words> types;
    std::vector<Words> variables;
    std::map<uint32_t, size_t> bindings;  // of a variable: the place of its number in the module
    std::set<uint32_t> buffer_blocks;     // types
    std::set<uint32_t> used;              // pointers that functions follow or hand on

    // False if the words are no module.
    bool read(Words words) {
        if (words.size() < 5 || words[0] != kMagic) return false;
        bool in_functions = false;
        for (size_t at = 5; at < words.size();) {
            const size_t size = words[at] >> 16;
            const uint32_t op = words[at] & 0xffff;
            if (size == 0 || at + size > words.size()) return false;
            const Words one = words.subspan(at, size);
            in_functions = in_functions || op == kFunction;
            if (in_functions) use(op, one);
            if (op >= kTypeInt && op <= kTypePointer && size > 2) types[one[1]] = one;
            if (op == kVariable && size > 3 && !in_functions) variables.push_back(one);
            if (op == kDecorate && size > 2 && one[2] == kBufferBlock) buffer_blocks.insert(one[1]);
            if (op == kDecorate && size > 3 && one[2] == kBinding) bindings[one[1]] = at + 3;
            at += size;
        }
        return true;
    }

    void use(uint32_t op, Words one) {
        if (op == kFunctionCall && one.size() > 4) used.insert(one.begin() + 4, one.end());
        const bool follows = op == kLoad || op == kAccessChain || op == kInBoundsAccessChain ||
                             op == kImageTexelPointer || op == kArrayLength;
        if (follows && one.size() > 3) used.insert(one[3]);
    }

    Unit unit_of(Words variable) const {
        const uint32_t storage = variable[3], type = types.at(variable[1])[3];
        if (storage == kStorageBuffer || buffer_blocks.contains(type)) return {Kind::list};
        if (storage == kUniform) return {Kind::uniforms};
        Words image = types.at(type);
        if ((image[0] & 0xffff) == kTypeSampledImage) image = types.at(image[2]);
        const bool sampled = image[7] == kSampled;
        const uint32_t component = types.at(image[2])[0] & 0xffff;
        return {sampled ? Kind::texture : Kind::image, 0, component == kTypeFloat && image[5] == 0};
    }
};

}  // namespace

Result<Spirv> with_units(std::vector<uint32_t> words) {
    const Status fault(StatusCode::internal, "a program's SPIR-V cannot be read");
    Module module;
    if (!module.read(words)) return fault;
    Spirv spirv;
    std::vector<std::pair<size_t, uint32_t>> changes;
    for (const Words variable : module.variables) {
        const auto binding = module.bindings.find(variable[2]);
        if (binding == module.bindings.end()) continue;
        Unit unit = module.unit_of(variable);
        unit.number = words[binding->second];
        if (unit.number >= kUnitsOfAKind) return fault;
        changes.emplace_back(binding->second, binding_of(unit.kind, unit.number));
        if (module.used.contains(variable[2])) spirv.units.push_back(unit);
    }
    for (const auto& [place, number] : changes) words[place] = number;
    spirv.words = std::move(words);
    return spirv;
}

}  // namespace postchain::vk

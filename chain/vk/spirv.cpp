#include "chain/vk/spirv.h"

#include <map>
#include <set>

#include "chain/vk/spirv_words.h"

namespace postchain::vk {
namespace {

constexpr uint32_t kSampled = 1;  // of an image: read as a texture, with a sampler or without

// The declarations of a module.
struct Module {
    std::map<uint32_t, Words> types;
    std::vector<Words> variables;
    std::map<uint32_t, size_t> bindings;  // of a variable: the place of its number in the module
    std::set<uint32_t> buffer_blocks;     // types
    std::set<uint32_t> used;              // pointers that functions follow or hand on

    // False if the words are no module.
    bool read(Words words) {
        bool in_functions = false;
        return visit_instructions(words, [&](Words one) {
            const Op op = op_of(one);
            in_functions = in_functions || op == Op::function;
            if (in_functions) use(op, one);
            if (op >= Op::type_int && op <= Op::type_pointer && one.size() > 2) types[one[1]] = one;
            if (op == Op::variable && one.size() > 3 && !in_functions) variables.push_back(one);
            if (op != Op::decorate || one.size() < 3) return;
            const Decoration what = Decoration(one[2]);
            if (what == Decoration::buffer_block) buffer_blocks.insert(one[1]);
            if (what == Decoration::binding && one.size() > 3)
                bindings[one[1]] = size_t(&one[3] - words.data());
        });
    }

    void use(Op op, Words one) {
        if (op == Op::function_call && one.size() > 4) used.insert(one.begin() + 4, one.end());
        const bool follows = op == Op::load || op == Op::access_chain ||
                             op == Op::in_bounds_access_chain || op == Op::image_texel_pointer ||
                             op == Op::array_length;
        if (follows && one.size() > 3) used.insert(one[3]);
    }

    Unit unit_of(Words variable) const {
        const StorageClass storage = storage_of(variable);
        const uint32_t type = types.at(variable[1])[3];
        if (storage == StorageClass::storage_buffer || buffer_blocks.contains(type))
            return {Kind::list};
        if (storage == StorageClass::uniform) return {Kind::uniforms};
        Words image = types.at(type);
        if (op_of(image) == Op::type_sampled_image) image = types.at(image[2]);
        const bool sampled = image[7] == kSampled;
        const bool floats = op_of(types.at(image[2])) == Op::type_float;
        return {sampled ? Kind::texture : Kind::image, 0, floats && image[5] == 0};
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

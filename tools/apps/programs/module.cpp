#include "tools/apps/programs/module.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "chain/vk/spirv_words.h"

namespace postchain::programs {
namespace {

using vk::Decoration;
using vk::Op;
using vk::op_of;
using vk::StorageClass;
using vk::Words;

constexpr uint32_t kLocalSize = 17, kBoundWord = 3;

std::string text_of(Words words) {
    const std::string_view text(reinterpret_cast<const char*>(words.data()), 4 * words.size());
    return std::string(text.substr(0, text.find('\0')));
}

struct Module {
    std::map<uint32_t, std::string> names;
    std::map<std::pair<uint32_t, uint32_t>, std::string> member_names;  // by struct and member
    std::map<uint32_t, Words> types;                                    // by id: the instruction
    std::map<uint32_t, uint32_t> constants;
    std::map<uint32_t, Words> variables;
    std::map<uint32_t, std::map<Decoration, uint32_t>> decorations;
    std::map<std::pair<uint32_t, uint32_t>, std::map<Decoration, uint32_t>> member_decorations;
    std::set<uint32_t> used;  // variables that functions refer to
    std::array<uint32_t, 3> group_size = {1, 1, 1};

    void add(Words one) {
        const Op op = op_of(one);
        if (op == Op::name) names[one[1]] = text_of(one.subspan(2));
        if (op == Op::member_name) member_names[{one[1], one[2]}] = text_of(one.subspan(3));
        if (op == Op::execution_mode && one[2] == kLocalSize)
            std::copy_n(one.begin() + 3, 3, group_size.begin());
        if (op >= Op::type_bool && op <= Op::type_pointer) types[one[1]] = one;
        if (op == Op::constant) constants[one[2]] = one[3];
        if (op == Op::decorate)
            decorations[one[1]][Decoration(one[2])] = one.size() > 3 ? one[3] : 0;
        if (op == Op::member_decorate)
            member_decorations[{one[1], one[2]}][Decoration(one[3])] = one.size() > 4 ? one[4] : 0;
        if (op == Op::variable) variables[one[2]] = one;
        if (op > Op::variable && op != Op::decorate && op != Op::member_decorate)
            for (const uint32_t word : one.subspan(1))
                if (variables.contains(word)) used.insert(word);
    }

    Words pointee_of(Words variable) const { return types.at(types.at(variable[1])[3]); }

    bool has(uint32_t id, Decoration what) const {
        const auto found = decorations.find(id);
        return found != decorations.end() && found->second.contains(what);
    }

    // A block is readonly or writeonly if all of its members are.
    bool all_members_have(Words type, Decoration what) const {
        for (uint32_t i = 0; i + 2 < type.size(); ++i) {
            const auto found = member_decorations.find({type[1], i});
            if (found == member_decorations.end() || !found->second.contains(what)) return false;
        }
        return true;
    }

    std::string name_of(Words type) const {
        switch (op_of(type)) {
            case Op::type_float:
                return "float";
            case Op::type_int:
                return type[3] ? "int" : "uint";
            case Op::type_vector: {
                const std::string of = name_of(types.at(type[2]));
                return concat(of == "float" ? "" : of.substr(0, 1), "vec", type[3]);
            }
            default:
                return "";
        }
    }

    // In memory of a work group, where some languages give three components the room of four.
    uint32_t bytes_of(Words type) const {
        switch (op_of(type)) {
            case Op::type_vector:
                return (type[3] == 3 ? 4 : type[3]) * bytes_of(types.at(type[2]));
            case Op::type_array:
                return constants.at(type[3]) * bytes_of(types.at(type[2]));
            case Op::type_struct: {
                uint32_t bytes = 0;
                for (const uint32_t member : type.subspan(2)) bytes += bytes_of(types.at(member));
                return bytes;
            }
            default:
                return 4;
        }
    }

    Block block_of(Words variable) const {
        const Words type = pointee_of(variable);
        Block block;
        block.name = names.at(type[1]);
        block.id = variable[2];
        for (uint32_t i = 0; i + 2 < type.size(); ++i) {
            Words of = types.at(type[2 + i]);
            BlockMember member;
            member.name = member_names.at({type[1], i});
            member.offset = member_decorations.at({type[1], i}).at(Decoration::offset);
            if (op_of(of) == Op::type_array) {
                member.count = constants.at(of[3]);
                member.stride = decorations.at(of[1]).at(Decoration::array_stride);
                of = types.at(of[2]);
            }
            member.type = name_of(of);
            const uint32_t bytes = member.count ? member.count * member.stride : bytes_of(of);
            block.bytes = std::max(block.bytes, (member.offset + bytes + 15) / 16 * 16);
            block.members.push_back(std::move(member));
        }
        return block;
    }

    ProgramUnit unit_of(const vk::Unit& unit, Words variable) const {
        ProgramUnit out;
        out.unit = unit;
        out.id = variable[2];
        out.name = names.at(out.id);
        Words type = pointee_of(variable);
        if (unit.kind == vk::Kind::list) {
            if (out.name.empty()) out.name = names.at(type[1]);
            out.reads = !all_members_have(type, Decoration::non_readable);
            out.writes = !all_members_have(type, Decoration::non_writable);
            return out;
        }
        if (op_of(type) == Op::type_sampled_image) type = types.at(type[2]);
        out.array = type[5] != 0;
        out.integer = op_of(types.at(type[2])) == Op::type_int;
        out.writes = unit.kind == vk::Kind::image && !has(out.id, Decoration::non_writable);
        out.reads = unit.kind == vk::Kind::texture || !has(out.id, Decoration::non_readable);
        return out;
    }
};

}  // namespace

Result<Interface> interface_of(const vk::Spirv& spirv) {
    Module module;
    if (!vk::visit_instructions(spirv.words, [&](Words one) { module.add(one); }))
        return Status(StatusCode::internal, "a program's SPIR-V cannot be read");
    std::map<uint32_t, Words> by_binding;
    Interface found;
    found.group_size = module.group_size;
    for (const auto& [id, variable] : module.variables) {
        if (module.has(id, Decoration::binding))
            by_binding[module.decorations.at(id).at(Decoration::binding)] = variable;
        if (!module.used.contains(id)) continue;
        if (vk::storage_of(variable) == StorageClass::workgroup)
            found.shared_bytes += module.bytes_of(module.pointee_of(variable));
        if (vk::storage_of(variable) == StorageClass::push_constant) found.first_group = true;
    }
    for (const vk::Unit& unit : spirv.units) {
        const Words variable = by_binding.at(vk::binding_of(unit.kind, unit.number));
        if (unit.kind == vk::Kind::uniforms)
            found.uniforms = module.block_of(variable);
        else
            found.units.push_back(module.unit_of(unit, variable));
    }
    for (const auto& [id, decorations] : module.decorations)
        found.precise += uint32_t(decorations.contains(Decoration::no_contraction));
    return found;
}

std::vector<uint32_t> with_loads_before_atomics(Words words) {
    std::map<uint32_t, uint32_t> shared;        // variables: the type of their pointer
    std::map<uint32_t, uint32_t> type_pointed;  // by pointer type
    std::vector<uint32_t> out(words.begin(), words.begin() + vk::kSpirvHeaderWords);
    vk::visit_instructions(words, [&](Words one) {
        const Op op = op_of(one);
        if (op == Op::type_pointer) type_pointed[one[1]] = one[3];
        if (op == Op::variable && vk::storage_of(one) == StorageClass::workgroup)
            shared[one[2]] = one[1];
        if (op >= Op::atomic_exchange && op <= Op::atomic_xor)
            if (const auto variable = shared.find(one[3]); variable != shared.end()) {
                constexpr uint32_t kLoadWords = 4;
                out.insert(out.end(),
                           {kLoadWords << 16 | uint32_t(Op::load),
                            type_pointed.at(variable->second), out[kBoundWord]++, one[3]});
            }
        out.insert(out.end(), one.begin(), one.end());
    });
    return out;
}

}  // namespace postchain::programs

#include "tests/programs/spirv.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace postchain::test {
namespace {

enum Op : uint32_t {
    kName = 5,
    kLine = 8,
    kExtInst = 12,
    kTypeInt = 21,
    kTypeFloat = 22,
    kTypeVector = 23,
    kTypeImage = 25,
    kTypeSampledImage = 27,
    kTypeArray = 28,
    kTypeStruct = 30,
    kTypePointer = 32,
    kConstant = 43,
    kConstantComposite = 44,
    kFunction = 54,
    kVariable = 59,
    kLoad = 61,
    kAccessChain = 65,
    kDecorate = 71,
    kMemberDecorate = 72,
    kCompositeConstruct = 80,
    kFirstSample = 87,
    kLastSample = 94,
    kFAdd = 129,
    kFSub = 131,
    kFDiv = 136,
    kFRem = 140,
    kFMod = 141,
    kFirstMatrixProduct = 144,
    kDot = 148,
};
enum Decoration : uint32_t {
    kBufferBlock = 3,
    kArrayStride = 6,
    kBinding = 33,
    kOffset = 35,
    kNoContraction = 42
};
enum StorageClass : uint32_t {
    kUniformConstant = 0,
    kUniform = 2,
    kPrivate = 6,
    kOfFunction = 7,
    kStorageBuffer = 12
};

// Calls of GLSL.std.450 whose results are sums of products. glslang marks none.
const std::set<uint32_t> kSums = {33, 34, 46, 49, 50, 66, 67, 68, 69, 70, 71, 72};

using Words = std::span<const uint32_t>;

struct Module {
    std::map<uint32_t, std::string> names;
    std::map<uint32_t, Words> types;      // by id: the instruction
    std::map<uint32_t, uint32_t> values;  // of constants
    std::map<uint32_t, std::map<uint32_t, uint32_t>> decorations;
    std::map<uint32_t, std::map<uint32_t, uint32_t>> offsets;  // struct, member

    bool has(uint32_t id, Decoration what) const {
        const auto found = decorations.find(id);
        return found != decorations.end() && found->second.contains(what);
    }

    // A compiler may multiply by the reciprocal of such a divisor.
    bool is_inexact_divisor(uint32_t id) const {
        const auto value = values.find(id);
        int exponent = 0;
        return value != values.end() &&
               std::frexp(std::bit_cast<float>(value->second), &exponent) != 0.5f;
    }

    bool has_array(uint32_t type) const {
        const auto found = types.find(type);
        if (found == types.end()) return false;  // bool
        const Words t = found->second;
        const uint32_t op = t[0] & 0xffff;
        if (op == kTypeStruct)
            return std::any_of(t.begin() + 2, t.end(),
                               [&](uint32_t member) { return has_array(member); });
        return op == kTypeArray;
    }

    size_t bytes_of(uint32_t type) const {
        const Words t = types.at(type);
        switch (t[0] & 0xffff) {
            case kTypeInt:
            case kTypeFloat:
                return t[2] / 8;
            case kTypeVector:
                return t[3] * bytes_of(t[2]);
            case kTypeArray:
                return values.at(t[3]) * decorations.at(type).at(kArrayStride);
            case kTypeStruct: {
                size_t end = 0;
                for (const auto& [member, offset] : offsets.at(type))
                    end = std::max(end, offset + bytes_of(t[2 + member]));
                return (end + 15) / 16 * 16;
            }
            default:
                return 0;
        }
    }
};

std::string text_of(Words words) {
    std::string text(reinterpret_cast<const char*>(words.data()), 4 * words.size());
    return text.substr(0, text.find('\0'));
}

void add_variable(const Module& module, Words variable, Spirv& spirv) {
    if (!module.has(variable[2], kBinding)) return;
    const uint32_t binding = module.decorations.at(variable[2]).at(kBinding);
    const uint32_t type = module.types.at(variable[1])[3];
    const uint32_t op = module.types.at(type)[0] & 0xffff;
    if (variable[3] == kUniformConstant)
        spirv.units.insert({op == kTypeImage ? Kind::image : Kind::texture, binding});
    else if (variable[3] == kStorageBuffer || module.has(type, kBufferBlock))
        spirv.units.insert({Kind::list, binding});
    else if (variable[3] == kUniform)
        spirv.blocks[module.names.at(type)] = module.bytes_of(type);
}

}  // namespace

Spirv read_spirv(Words words) {
    Module module;
    Spirv spirv;
    std::string function;
    uint32_t line = 0;
    std::map<uint32_t, Words> variables;
    std::set<uint32_t> used;
    for (size_t at = 5; at < words.size();) {
        const Words one = words.subspan(at, words[at] >> 16);
        const uint32_t op = one[0] & 0xffff;
        at += one.size();
        if (op == kName) module.names[one[1]] = text_of(one.subspan(2));
        if (op == kLine) line = one[2];
        if (op >= kTypeInt && op <= kTypePointer) module.types[one[1]] = one;
        if (op == kConstant) module.values[one[2]] = one[3];
        // Of equal components.
        if ((op == kConstantComposite || op == kCompositeConstruct) &&
            module.values.contains(one[3]))
            module.values[one[2]] = module.values[one[3]];
        if (op == kDecorate) module.decorations[one[1]][one[2]] = one.size() > 3 ? one[3] : 0;
        if (op == kMemberDecorate && one[3] == kOffset) module.offsets[one[1]][one[2]] = one[4];
        if (op == kVariable) variables[one[2]] = one;
        if (op == kLoad || op == kAccessChain) used.insert(one[3]);
        if (op == kFunction) function = module.names[one[2]];
        if (op >= kFirstSample && op <= kLastSample) spirv.samples = true;
        const bool sum = op == kFAdd || op == kFSub || op == kFRem || op == kFMod ||
                         (op >= kFirstMatrixProduct && op <= kDot) ||
                         (op == kExtInst && kSums.contains(one[4])) ||
                         (op == kFDiv && module.is_inexact_divisor(one[4]));
        if (sum && !module.has(one[2], kNoContraction))
            spirv.contracted.insert(function.substr(0, function.find('(')) + "() line " +
                                    std::to_string(line));
    }
    for (const auto& [id, variable] : variables)
        if ((variable[3] == kPrivate || variable[3] == kOfFunction) &&
            module.has_array(module.types.at(variable[1])[3]))
            spirv.arrays.insert(module.names[id]);
    for (const uint32_t id : used)
        if (variables.contains(id)) add_variable(module, variables[id], spirv);
    return spirv;
}

}  // namespace postchain::test

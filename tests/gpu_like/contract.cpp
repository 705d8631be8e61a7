#include "tests/gpu_like/contract.h"

#include <map>
#include <set>

namespace postchain::test {
namespace {

enum Op : uint32_t {
    kLine = 8,
    kExtInstImport = 11,
    kExtInst = 12,
    kCapability = 17,
    kTypeFloat = 22,
    kTypeVector = 23,
    kConstant = 43,
    kConstantComposite = 44,
    kFunction = 54,
    kStore = 62,
    kCopyMemory = 63,
    kDecorate = 71,
    kCompositeConstruct = 80,
    kCompositeExtract = 81,
    kImageWrite = 99,
    kFConvert = 115,
    kFNegate = 127,
    kFAdd = 129,
    kFSub = 131,
    kFMul = 133,
    kVectorTimesScalar = 142,
    kDot = 148,
    kControlBarrier = 224,
    kMemoryBarrier = 225,
    kAtomicStore = 228,
    kFirstMerge = 246,
    kLastBranch = 255,
    kNoLine = 317,
};
enum Extended : uint32_t {
    kSqrt = 31,
    kInverseSqrt = 32,
    kFMix = 46,
    kLength = 66,
    kDistance = 67,
    kNormalize = 69,
};
constexpr uint32_t kNoContraction = 42, kFloat64 = 10;

using Words = std::span<const uint32_t>;

// An instruction of a function with a type and a result.
bool has_value(uint32_t op) {
    switch (op) {
        case kStore:
        case kCopyMemory:
        case kImageWrite:
        case kControlBarrier:
        case kMemoryBarrier:
        case kAtomicStore:
        case kLine:
        case kNoLine:
            return false;
        default:
            return op < kFirstMerge || op > kLastBranch;
    }
}

struct Product {
    uint32_t a, b;
    bool negated;
};

class Contraction {
  public:
    explicit Contraction(Words module) : module_(module), bound_(module[3]) {}

    std::vector<uint32_t> result() {
        read_types();
        std::vector<uint32_t> out(module_.begin(), module_.begin() + 5);
        bool in_functions = false;
        size_t functions = 0;  // where types may be added
        for (size_t at = 5; at < module_.size();) {
            const Words one = module_.subspan(at, module_[at] >> 16);
            at += one.size();
            const uint32_t op = one[0] & 0xffff;
            if (op == kFunction && !in_functions) {
                in_functions = true;
                functions = out.size();
            }
            if (!in_functions || !replace(one)) {
                body_.insert(body_.end(), one.begin(), one.end());
                if (in_functions && one.size() > 2 && has_value(op)) remember(one);
            }
            out.insert(out.end(), body_.begin(), body_.end());
            body_.clear();
            if (op == kCapability && at == 5 + one.size())
                out.insert(out.end(), {(2 << 16) | kCapability, kFloat64});
        }
        out.insert(out.begin() + std::ptrdiff_t(functions), added_.begin(), added_.end());
        out[3] = bound_;
        return out;
    }

  private:
    void read_types() {
        for (size_t at = 5; at < module_.size(); at += module_[at] >> 16) {
            const Words one = module_.subspan(at, module_[at] >> 16);
            const uint32_t op = one[0] & 0xffff;
            if (op == kTypeFloat && one[2] == 32) widths_[one[1]] = 1, floats_[1] = one[1];
            if (op == kTypeVector && one[2] == floats_[1])
                widths_[one[1]] = one[3], floats_[one[3]] = one[1];
            if (op == kConstant || op == kConstantComposite) types_[one[2]] = one[1];
            if (op == kDecorate && one[2] == kNoContraction) exact_.insert(one[1]);
            if (op == kExtInstImport) extended_ = one[1];
        }
    }

    uint32_t width_of(uint32_t value) const {
        const auto type = types_.find(value);
        if (type == types_.end()) return 0;
        const auto width = widths_.find(type->second);
        return width == widths_.end() ? 0 : width->second;
    }

    void remember(Words one) {
        const uint32_t op = one[0] & 0xffff;
        types_[one[2]] = one[1];
        if (exact_.contains(one[2])) return;
        if (op == kFMul || op == kVectorTimesScalar) products_[one[2]] = {one[3], one[4], false};
        if (op != kFNegate) return;
        const auto product = products_.find(one[3]);
        if (product == products_.end()) return;
        products_[one[2]] = product->second;
        products_[one[2]].negated = !product->second.negated;
    }

    // Writes what the instruction is replaced by; false: nothing, it stays.
    bool replace(Words one) {
        const uint32_t op = one[0] & 0xffff;
        if (one.size() < 4 || !has_value(op) || !widths_.contains(one[1])) return false;
        if (exact_.contains(one[2])) return false;
        result_ = one[2];
        type_ = one[1];
        if (op == kFAdd || op == kFSub) return replace_sum(one[3], one[4], op == kFSub);
        if (op == kDot) {
            dot(one[3], one[4], result_);
            return keep();
        }
        if (op == kExtInst && one[3] == extended_) return replace_call(one[4], one.subspan(5));
        return false;
    }
    bool keep() {
        types_[result_] = type_;
        return true;
    }

    bool replace_sum(uint32_t x, uint32_t y, bool minus) {
        const uint32_t width = widths_[type_];
        if (const auto p = products_.find(x); p != products_.end()) {
            const uint32_t term = minus ? make(kFNegate, floats(width), {y}) : y;
            fused(p->second, term, width, result_);
        } else if (const auto q = products_.find(y); q != products_.end()) {
            Product product = q->second;
            product.negated = product.negated != minus;
            fused(product, x, width, result_);
        } else {
            return false;
        }
        return keep();
    }

    bool replace_call(uint32_t call, Words to) {
        const uint32_t width = widths_[type_];
        switch (call) {
            case kFMix: {
                const uint32_t step = make(kFSub, type_, {to[1], to[0]});
                fused({to[2], step, false}, to[0], width, result_);
                return keep();
            }
            case kLength:
                return length(to[0]);
            case kDistance: {
                const uint32_t type = types_.at(to[0]);
                const uint32_t way = make(kFSub, type, {to[0], to[1]});
                types_[way] = type;
                return length(way);
            }
            case kNormalize: {
                if (width == 1) return false;
                const uint32_t square = dot(to[0], to[0]);
                const uint32_t scale = call_of(kInverseSqrt, floats(1), {square});
                make(kVectorTimesScalar, type_, {to[0], scale}, result_);
                return keep();
            }
            default:
                return false;
        }
    }

    bool length(uint32_t of) {
        if (width_of(of) < 2) return false;
        const uint32_t square = dot(of, of);
        call_of(kSqrt, floats(1), {square}, result_);
        return keep();
    }

    uint32_t dot(uint32_t a, uint32_t b, uint32_t result = 0) {
        const uint32_t width = width_of(a);
        const auto part = [&](uint32_t of, uint32_t i) {
            return make(kCompositeExtract, floats(1), {of, i});
        };
        uint32_t sum = make(kFMul, floats(1), {part(a, 0), part(b, 0)});
        for (uint32_t i = 1; i < width; ++i)
            sum = fused({part(a, i), part(b, i), false}, sum, 1, i + 1 == width ? result : 0);
        return sum;
    }

    // The product and a term, rounded once.
    uint32_t fused(const Product& product, uint32_t term, uint32_t width, uint32_t result = 0) {
        const uint32_t a = wide(product.a, width), b = wide(product.b, width);
        const uint32_t c = wide(term, width);
        uint32_t exact = make(kFMul, doubles(width), {a, b});
        if (product.negated) exact = make(kFNegate, doubles(width), {exact});
        return make(kFConvert, floats(width), {make(kFAdd, doubles(width), {exact, c})}, result);
    }
    // In double precision; a scalar for each component.
    uint32_t wide(uint32_t value, uint32_t width) {
        if (width > 1 && width_of(value) == 1)
            value = make(kCompositeConstruct, floats(width), std::vector(width, value));
        return make(kFConvert, doubles(width), {value});
    }

    uint32_t make(Op op, uint32_t type, const std::vector<uint32_t>& operands,
                  uint32_t result = 0) {
        if (result == 0) result = bound_++;
        append(body_, op, {type, result}, operands);
        return result;
    }
    uint32_t call_of(Extended call, uint32_t type, std::vector<uint32_t> operands,
                     uint32_t result = 0) {
        operands.insert(operands.begin(), {extended_, call});
        return make(kExtInst, type, operands, result);
    }
    static void append(std::vector<uint32_t>& to, Op op, const std::vector<uint32_t>& first,
                       const std::vector<uint32_t>& operands) {
        to.push_back(uint32_t(1 + first.size() + operands.size()) << 16 | op);
        to.insert(to.end(), first.begin(), first.end());
        to.insert(to.end(), operands.begin(), operands.end());
    }

    uint32_t floats(uint32_t width) { return floats_.at(width); }
    uint32_t doubles(uint32_t width) {
        uint32_t& type = doubles_[width];
        if (type != 0) return type;
        if (width == 1) {
            append(added_, kTypeFloat, {type = bound_++}, {64});
        } else {
            const uint32_t scalar = doubles(1);
            append(added_, kTypeVector, {type = bound_++}, {scalar, width});
        }
        return type;
    }
    const Words module_;
    uint32_t bound_;
    uint32_t extended_ = 0;
    uint32_t result_ = 0, type_ = 0;                 // of the instruction that is replaced
    std::map<uint32_t, uint32_t> floats_, doubles_;  // types by width
    std::map<uint32_t, uint32_t> widths_;            // by type
    std::map<uint32_t, uint32_t> types_;             // by value
    std::map<uint32_t, Product> products_;
    std::set<uint32_t> exact_;
    std::vector<uint32_t> body_, added_;
};

}  // namespace

std::vector<uint32_t> contracted(std::span<const uint32_t> module) {
    return Contraction(module).result();
}

}  // namespace postchain::test

// Parameter tables: one row per parameter, from which parsing, checks, --help, JSON Schema, docs
// and the chain hash are all made. A pass writes its table once, next to its parameter struct:
//
//   struct Parameters { int samples = 25; bool tile_jitter = true; };
//   static const ParameterTable table = ParameterTableBuilder<Parameters>()
//       .integer("samples", &Parameters::samples, {.min = 1, .max = 1023, .odd = true,
//                .unit = "taps", .help = "number of taps of the gather"})
//       .boolean("tile_jitter", &Parameters::tile_jitter, {.help = "..."})
//       .table();
//
// The default of a row is the value in the default-constructed struct.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeindex>
#include <variant>
#include <vector>

#include "chain/base/status.h"

namespace postchain {

enum class ParameterType { boolean, integer, number, choice, text, point };
const char* name_of(ParameterType type);  // "boolean", "integer", ...

// A parameter struct of any type, and that type: taking it out as another type is an error.
template <class Pointer>
class TypedRef {
  public:
    template <class P>
    TypedRef(P* parameters) : pointer_(parameters), type_(typeid(P)) {
        static_assert(!std::is_void_v<P>, "the type of the struct is what this is for");
    }
    template <class Other>
    TypedRef(const TypedRef<Other>& other) : pointer_(other.pointer_), type_(other.type_) {}

    // `P` is the type it was made of.
    template <class P>
    auto& as() const {
        assert(type_ == typeid(P));
        using To = std::conditional_t<std::is_const_v<std::remove_pointer_t<Pointer>>, const P, P>;
        return *static_cast<To*>(pointer_);
    }

  private:
    template <class Other>
    friend class TypedRef;
    Pointer pointer_;
    std::type_index type_;
};
using ParameterRef = TypedRef<void*>;
using ConstParameterRef = TypedRef<const void*>;

// monostate = unset (only rows with `optional` accept it).
using ParameterValue =
    std::variant<std::monostate, bool, int64_t, double, std::string, std::array<double, 2>>;

// Canonical text: "true", "25", "0.5" (shortest text that reads back as the same double),
// "[0.5,0.25]", "unset".
std::string text_of(const ParameterValue& value);

// How a row relates to sampling error, the distance of a filter with few samples from the same
// filter with many (docs/report.md, "bench"). Code that measures it sets and averages these rows
// without knowing the pass.
enum class Convergence {
    none,
    set,       // the filter converges as this value goes to Parameter::converged
    averaged,  // only random numbers depend on it: the mean over many values is the filter
};

// A condition on a row of the same table: its value, as text_of() writes it, is one of these, or
// none of them.
struct RowValue {
    std::string key;
    std::vector<std::string> values;
    bool none_of = false;
};
// When a filter reads a row: all conditions of one of the alternatives hold. Empty: always.
using ReadIf = std::vector<std::vector<RowValue>>;
// "mode: guertin, single and noise: not none"
std::string text_of(const ReadIf& read_if);
ReadIf both(const ReadIf& a, const ReadIf& b);

// What a table says of a row beside its key, type and member.
struct RowOptions {
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
    bool min_excluded = false;  // min itself is out of range
    double soft_min = min;      // values worth trying: sliders, random tests
    double soft_max = max;
    bool odd = false;                   // integer must be odd
    std::vector<int64_t> allowed = {};  // integer: the only values; empty = all in min..max
    std::string unit = {};              // "px", "frames", ...; a text's form: "FILE"; empty = none
    std::string help = {};              // one line
    std::string unset_means = {};       // "the camera's shutter_frames"
    std::string excludes = {};          // key that must not be set together with this one
    ReadIf read_if = {};                // under other values of the table it has no effect
    std::string implied = {};           // text: the value of a key without one; empty = an error
    std::string group = {};             // in a table whose users take only some rows
    bool required = false;              // for a text, which otherwise may be left unset
    Convergence convergence = Convergence::none;
    double converged = 0;  // Convergence::set: the value at which the filter counts as converged
};

struct Parameter : RowOptions {
    std::string key;
    ParameterType type = ParameterType::number;
    std::vector<std::string> choices;  // choice: the names
    bool optional = false;             // may be left unset
    ParameterValue default_value;

    std::function<ParameterValue(ConstParameterRef)> get;
    std::function<void(ParameterRef, const ParameterValue&)> set;  // value has passed check()

    // The help, after the values of other rows under which it is read: "coc: lens; focal length".
    std::string full_help() const;
    // "an odd integer in 1..1023", "one of guertin, single", "a number > 0"
    std::string domain() const;
    // Is `value` of the right type and in range? A row of type number accepts an integer. The
    // message reads "24 is even; samples is an odd integer in 1..1023".
    Status check(const ParameterValue& value) const;
};

class ParameterTable {
  public:
    ParameterTable() = default;
    explicit ParameterTable(std::vector<Parameter> rows) : rows_(std::move(rows)) {}

    const std::vector<Parameter>& rows() const { return rows_; }
    const Parameter* find(std::string_view key) const;
    // Checks, then sets. StatusCode::chain if the key is unknown (the message suggests the closest
    // one) or the value is outside the row's domain.
    Status set(ParameterRef parameters, std::string_view key, const ParameterValue& value) const;
    // Cross-row rule `excludes`.
    Status check(ConstParameterRef parameters) const;
    // Why a row has no effect with these values, and the remedy: "has no effect with mode:
    // inverse_warp; remove it, or set mode: guertin, single". Empty if Parameter::read_if holds.
    std::string unread(const Parameter& row, ConstParameterRef parameters) const;
    // "key=value" of every row that is read, in table order, joined by a space: canonical, for
    // hashes and print.
    std::string text(ConstParameterRef parameters) const;

  private:
    // The conditions of read_if that fail, in the alternative with the fewest; none if it holds.
    std::vector<const RowValue*> lacks(const Parameter& row, ConstParameterRef parameters) const;

    std::vector<Parameter> rows_;
};

// The known word closest to `word` by edit distance; empty if none is close.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

// FNV-1a, 64 bit. Identifies chains and plans; not for security.
inline constexpr uint64_t kHashSeed = 14695981039346656037ull;
uint64_t hash_text(std::string_view text, uint64_t seed = kHashSeed);
uint64_t hash_bytes(std::span<const std::byte> bytes, uint64_t seed = kHashSeed);
std::string hex_of(uint64_t hash);  // 16 digits

// ------------------------------------------------------------------------------------ builder

template <class P>
class ParameterTableBuilder {
  public:
    ParameterTableBuilder& boolean(std::string key, bool P::*member, RowOptions options) {
        return plain(ParameterType::boolean, std::move(key), member, std::move(options));
    }
    ParameterTableBuilder& integer(std::string key, int P::*member, RowOptions options) {
        return plain(ParameterType::integer, std::move(key), member, std::move(options));
    }
    ParameterTableBuilder& number(std::string key, double P::*member, RowOptions options) {
        return plain(ParameterType::number, std::move(key), member, std::move(options));
    }
    // Numbers that may be unset.
    ParameterTableBuilder& integer(std::string key, std::optional<int> P::*member,
                                   RowOptions options) {
        return optional(ParameterType::integer, std::move(key), member, std::move(options));
    }
    ParameterTableBuilder& number(std::string key, std::optional<double> P::*member,
                                  RowOptions options) {
        return optional(ParameterType::number, std::move(key), member, std::move(options));
    }
    // Two numbers x, y, each in min..max; may be unset.
    ParameterTableBuilder& point(std::string key, std::optional<std::array<double, 2>> P::*member,
                                 RowOptions options) {
        return optional(ParameterType::point, std::move(key), member, std::move(options));
    }
    // An enum class whose enumerators are 0, 1, 2, ... in the order of `names`.
    template <class E>
    ParameterTableBuilder& choice(std::string key, E P::*member, std::vector<std::string> names,
                                  RowOptions options) {
        Parameter row = start(ParameterType::choice, std::move(key), std::move(options));
        row.choices = names;
        row.get = [member, names](ConstParameterRef p) -> ParameterValue {
            return names[static_cast<size_t>(p.as<P>().*member)];
        };
        row.set = [member, names](ParameterRef p, const ParameterValue& value) {
            const auto& name = std::get<std::string>(value);
            for (size_t i = 0; i < names.size(); ++i)
                if (names[i] == name) p.as<P>().*member = static_cast<E>(i);
        };
        return finish(std::move(row));
    }
    // An enum class that may be unset.
    template <class E>
    ParameterTableBuilder& choice(std::string key, std::optional<E> P::*member,
                                  std::vector<std::string> names, RowOptions options) {
        Parameter row = start(ParameterType::choice, std::move(key), std::move(options));
        row.choices = names;
        row.optional = true;
        row.get = [member, names](ConstParameterRef p) -> ParameterValue {
            const auto& value = p.as<P>().*member;
            if (!value) return std::monostate();
            return names[static_cast<size_t>(*value)];
        };
        row.set = [member, names](ParameterRef p, const ParameterValue& value) {
            const auto* name = std::get_if<std::string>(&value);
            auto& slot = p.as<P>().*member;
            slot.reset();
            for (size_t i = 0; name && i < names.size(); ++i)
                if (names[i] == *name) slot = static_cast<E>(i);
        };
        return finish(std::move(row));
    }
    // An empty text is an unset one.
    ParameterTableBuilder& text(std::string key, std::string P::*member, RowOptions options) {
        Parameter row = start(ParameterType::text, std::move(key), std::move(options));
        row.optional = !row.required;
        row.get = [member](ConstParameterRef p) -> ParameterValue {
            const std::string& value = p.as<P>().*member;
            if (value.empty()) return std::monostate();
            return value;
        };
        row.set = [member](ParameterRef p, const ParameterValue& value) {
            const auto* word = std::get_if<std::string>(&value);
            p.as<P>().*member = word ? *word : std::string();
        };
        return finish(std::move(row));
    }
    // A value F that other code reads from a file: a text that names the file. F(text) and
    // F::file().
    template <class F>
    ParameterTableBuilder& file(std::string key, F P::*member, RowOptions options) {
        Parameter row = start(ParameterType::text, std::move(key), std::move(options));
        row.optional = true;
        row.get = [member](ConstParameterRef p) -> ParameterValue {
            const std::string& name = (p.as<P>().*member).file();
            if (name.empty()) return std::monostate();
            return name;
        };
        row.set = [member](ParameterRef p, const ParameterValue& value) {
            const auto* name = std::get_if<std::string>(&value);
            p.as<P>().*member = name ? F(*name) : F();
        };
        return finish(std::move(row));
    }
    // The rows of a member that has a table of its own, all read under one more condition.
    template <class M>
    ParameterTableBuilder& rows(M P::*member, const ParameterTable& of_member,
                                const ReadIf& read_if = {}) {
        for (Parameter row : of_member.rows()) {
            row.read_if = both(read_if, row.read_if);
            row.get = [member, get = row.get](ConstParameterRef p) {
                return get(&(p.as<P>().*member));
            };
            row.set = [member, set = row.set](ParameterRef p, const ParameterValue& value) {
                set(&(p.as<P>().*member), value);
            };
            finish(std::move(row));
        }
        return *this;
    }
    ParameterTable table() { return ParameterTable(std::move(rows_)); }

  private:
    static double as_double(const ParameterValue& value) {
        if (const auto* i = std::get_if<int64_t>(&value)) return static_cast<double>(*i);
        return std::get<double>(value);
    }
    static Parameter start(ParameterType type, std::string key, RowOptions options) {
        Parameter row;
        static_cast<RowOptions&>(row) = std::move(options);
        row.key = std::move(key);
        row.type = type;
        return row;
    }
    template <class T>
    ParameterTableBuilder& plain(ParameterType type, std::string key, T P::*member,
                                 RowOptions options) {
        Parameter row = start(type, std::move(key), std::move(options));
        row.get = [member](ConstParameterRef p) -> ParameterValue {
            const T value = p.as<P>().*member;
            if constexpr (std::is_same_v<T, int>)
                return static_cast<int64_t>(value);
            else
                return value;
        };
        row.set = [member](ParameterRef p, const ParameterValue& value) {
            auto& slot = p.as<P>().*member;
            if constexpr (std::is_same_v<T, bool>)
                slot = std::get<bool>(value);
            else if constexpr (std::is_same_v<T, int>)
                slot = int(std::get<int64_t>(value));
            else
                slot = as_double(value);
        };
        return finish(std::move(row));
    }
    template <class T>
    ParameterTableBuilder& optional(ParameterType type, std::string key,
                                    std::optional<T> P::*member, RowOptions options) {
        Parameter row = start(type, std::move(key), std::move(options));
        row.optional = true;
        row.get = [member](ConstParameterRef p) -> ParameterValue {
            const auto& value = p.as<P>().*member;
            if (!value) return std::monostate();
            if constexpr (std::is_same_v<T, int>)
                return static_cast<int64_t>(*value);
            else
                return *value;
        };
        row.set = [member](ParameterRef p, const ParameterValue& value) {
            auto& slot = p.as<P>().*member;
            if (std::holds_alternative<std::monostate>(value))
                slot.reset();
            else if constexpr (std::is_same_v<T, int>)
                slot = int(std::get<int64_t>(value));
            else if constexpr (std::is_same_v<T, double>)
                slot = as_double(value);
            else
                slot = std::get<T>(value);
        };
        return finish(std::move(row));
    }
    ParameterTableBuilder& finish(Parameter row) {
        const P defaults{};
        row.default_value = row.get(&defaults);
        rows_.push_back(std::move(row));
        return *this;
    }
    std::vector<Parameter> rows_;
};

}  // namespace postchain

#include "chain/base/parameter.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numeric>

#include "chain/base/text.h"

namespace postchain {

const char* name_of(ParameterType type) {
    static constexpr const char* kNames[] = {"boolean", "integer", "number",
                                             "choice",  "text",    "point"};
    static_assert(std::size(kNames) == size_t(ParameterType::point) + 1);
    return kNames[size_t(type)];
}

namespace {

std::string text_of(double value) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value).ptr;
    return std::string(buffer, end);
}

std::string kind_of(const ParameterValue& value) {
    static const char* kinds[] = {"nothing",  "a boolean", "an integer",
                                  "a number", "a word",    "two numbers"};
    return kinds[value.index()];
}

std::string text_of(const RowValue& condition) {
    return concat(condition.key, condition.none_of ? ": not " : ": ", joined(condition.values));
}

}  // namespace

std::string text_of(const ParameterValue& value) {
    if (const auto* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
    if (const auto* i = std::get_if<int64_t>(&value)) return std::to_string(*i);
    if (const auto* d = std::get_if<double>(&value)) return text_of(*d);
    if (const auto* s = std::get_if<std::string>(&value)) return *s;
    if (const auto* p = std::get_if<std::array<double, 2>>(&value))
        return "[" + text_of((*p)[0]) + "," + text_of((*p)[1]) + "]";
    return "unset";
}

std::string text_of(const ReadIf& read_if) {
    std::string text;
    for (const auto& all : read_if) {
        if (!text.empty()) text += ", or ";
        for (const RowValue& condition : all)
            text += (&condition == &all.front() ? "" : " and ") + text_of(condition);
    }
    return text;
}

ReadIf both(const ReadIf& a, const ReadIf& b) {
    if (a.empty() || b.empty()) return a.empty() ? b : a;
    ReadIf result;
    for (const auto& first : a)
        for (const auto& second : b) {
            result.push_back(first);
            result.back().insert(result.back().end(), second.begin(), second.end());
        }
    return result;
}

std::string Parameter::full_help() const {
    return read_if.empty() ? help : postchain::text_of(read_if) + "; " + help;
}

std::string Parameter::domain() const {
    if (type == ParameterType::boolean) return "true or false";
    if (type == ParameterType::choice) return "one of " + joined(choices);
    if (type == ParameterType::text) return "a text";
    if (!allowed.empty()) {
        std::vector<std::string> words;
        for (int64_t value : allowed) words.push_back(std::to_string(value));
        return "one of " + joined(words);
    }
    std::string text = type == ParameterType::point     ? "two numbers [x, y], each"
                       : type == ParameterType::integer ? (odd ? "an odd integer" : "an integer")
                                                        : "a number";
    const auto bound = [&](double value) {  // 1000000, not 1e+06
        return type == ParameterType::integer ? std::to_string(int64_t(value)) : text_of(value);
    };
    const bool low = std::isfinite(min), high = std::isfinite(max);
    if (low && high && !min_excluded) return text + " in " + bound(min) + ".." + bound(max);
    if (low) text += (min_excluded ? " > " : " >= ") + bound(min);
    if (high) text += std::string(low ? " and" : "") + " <= " + bound(max);
    return text;
}

Status Parameter::check(const ParameterValue& value) const {
    const auto wrong = [&](const std::string& what) {
        std::string text = what + "; " + key + " is " + domain();
        if (!unit.empty()) text += " (" + unit + ")";
        return Status(StatusCode::chain, text);
    };
    if (std::holds_alternative<std::monostate>(value)) {
        return optional ? Status() : wrong("no value");
    }
    switch (type) {
        case ParameterType::boolean:
            if (!std::holds_alternative<bool>(value))
                return wrong(postchain::text_of(value) + " is " + kind_of(value));
            return Status();
        case ParameterType::choice: {
            const auto* word = std::get_if<std::string>(&value);
            if (!word) return wrong(postchain::text_of(value) + " is " + kind_of(value));
            if (std::find(choices.begin(), choices.end(), *word) != choices.end()) return Status();
            const std::string near = nearest_word(*word, choices);
            return wrong("'" + *word + "' is not known" +
                         (near.empty() ? "" : " (did you mean '" + near + "'?)"));
        }
        case ParameterType::text: {
            const auto* word = std::get_if<std::string>(&value);
            if (!word) return wrong(postchain::text_of(value) + " is " + kind_of(value));
            return word->empty() ? wrong("is empty") : Status();
        }
        case ParameterType::integer: {
            const auto* number = std::get_if<int64_t>(&value);
            if (!number) return wrong(postchain::text_of(value) + " is " + kind_of(value));
            if (!allowed.empty() &&
                std::find(allowed.begin(), allowed.end(), *number) == allowed.end())
                return wrong(std::to_string(*number) + " is not among them");
            if (double(*number) < min || double(*number) > max)
                return wrong(std::to_string(*number) + " is out of range");
            if (odd && *number % 2 == 0) return wrong(std::to_string(*number) + " is even");
            return Status();
        }
        case ParameterType::number: {
            double number = 0;
            if (const auto* i = std::get_if<int64_t>(&value))
                number = double(*i);
            else if (const auto* d = std::get_if<double>(&value))
                number = *d;
            else
                return wrong(postchain::text_of(value) + " is " + kind_of(value));
            if (!std::isfinite(number)) return wrong(text_of(number) + " is not finite");
            if (number < min || number > max || (min_excluded && number == min))
                return wrong(text_of(number) + " is out of range");
            return Status();
        }
        case ParameterType::point: {
            const auto* point = std::get_if<std::array<double, 2>>(&value);
            if (!point) return wrong(postchain::text_of(value) + " is " + kind_of(value));
            for (double number : *point)
                if (!(number >= min && number <= max))
                    return wrong(text_of(number) + " is out of range");
            return Status();
        }
    }
    return Status(StatusCode::internal, "parameter of no type");
}

const Parameter* ParameterTable::find(std::string_view key) const {
    for (const auto& row : rows_)
        if (row.key == key) return &row;
    return nullptr;
}

Status ParameterTable::set(ParameterRef parameters, std::string_view key,
                           const ParameterValue& value) const {
    const Parameter* row = find(key);
    if (!row) {
        std::vector<std::string> known;
        for (const auto& r : rows_) known.push_back(r.key);
        const std::string near = nearest_word(key, known);
        return Status(StatusCode::chain, "unknown key '" + std::string(key) + "'" +
                                             (near.empty() ? "; known are " + joined(known)
                                                           : " (did you mean '" + near + "'?)"));
    }
    RETURN_IF_ERROR(row->check(value));
    row->set(parameters, value);
    return Status();
}

Status ParameterTable::check(ConstParameterRef parameters) const {
    for (const auto& row : rows_) {
        if (row.excludes.empty() || row.get(parameters) == ParameterValue()) continue;
        const Parameter* other = find(row.excludes);
        if (other && other->get(parameters) != ParameterValue())
            return Status(StatusCode::chain,
                          row.key + " and " + other->key + " are both given; give one of them");
    }
    return Status();
}

std::vector<const RowValue*> ParameterTable::lacks(const Parameter& row,
                                                   ConstParameterRef parameters) const {
    const auto holds = [&](const RowValue& condition) {
        const std::string value = postchain::text_of(find(condition.key)->get(parameters));
        const bool among = std::ranges::find(condition.values, value) != condition.values.end();
        return among != condition.none_of;
    };
    std::vector<const RowValue*> lacks;
    for (const auto& all : row.read_if) {
        std::vector<const RowValue*> here;
        for (const RowValue& condition : all)
            if (!holds(condition)) here.push_back(&condition);
        if (here.empty()) return {};
        if (lacks.empty() || here.size() < lacks.size()) lacks = std::move(here);
    }
    return lacks;
}

std::string ParameterTable::unread(const Parameter& row, ConstParameterRef parameters) const {
    std::vector<std::string> now, remedies;
    for (const RowValue* condition : lacks(row, parameters)) {
        now.push_back(condition->key + ": " +
                      postchain::text_of(find(condition->key)->get(parameters)));
        remedies.push_back(text_of(*condition));
    }
    if (now.empty()) return "";
    return concat("has no effect with ", joined(now, " and "), "; remove it, or set ",
                  joined(remedies, " and "));
}

std::string ParameterTable::text(ConstParameterRef parameters) const {
    std::string text;
    for (const auto& row : rows_) {
        if (!lacks(row, parameters).empty()) continue;
        if (!text.empty()) text += ' ';
        text += row.key + '=' + postchain::text_of(row.get(parameters));
    }
    return text;
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
    // Levenshtein distance, one row at a time.
    const auto distance = [](std::string_view a, std::string_view b) {
        std::vector<size_t> row(b.size() + 1);
        std::iota(row.begin(), row.end(), size_t(0));
        for (size_t i = 1; i <= a.size(); ++i) {
            size_t diagonal = row[0];
            row[0] = i;
            for (size_t j = 1; j <= b.size(); ++j) {
                const size_t above = row[j];
                row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
                diagonal = above;
            }
        }
        return row.back();
    };
    std::string best;
    size_t best_distance = std::max<size_t>(2, word.size() / 3) + 1;
    if (word.size() > 256) return best;
    for (const auto& candidate : known) {
        const size_t d = distance(word, candidate);
        if (d < best_distance) {
            best_distance = d;
            best = candidate;
        }
    }
    return best;
}

uint64_t hash_text(std::string_view text, uint64_t seed) {
    uint64_t hash = seed;
    for (unsigned char c : text) hash = (hash ^ c) * 1099511628211ull;
    return hash;
}

uint64_t hash_bytes(std::span<const std::byte> bytes, uint64_t seed) {
    return hash_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, seed);
}

std::string hex_of(uint64_t hash) {
    std::string text(16, '0');
    for (int i = 15; i >= 0; --i, hash >>= 4) text[size_t(i)] = "0123456789abcdef"[hash & 15];
    return text;
}

}  // namespace postchain

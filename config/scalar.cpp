#include "config/scalar.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "chain/base/text.h"

namespace postchain {
namespace {

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

// digits [. digits] | . digits, then [e [sign] digits]: the decimal numbers of YAML 1.2, no sign.
struct Decimal {
    bool whole = false;         // only digits
    bool leading_zero = false;  // 010, 00.5
};
std::optional<Decimal> decimal(std::string_view text) {
    size_t at = 0;
    const auto digits = [&] {
        const size_t from = at;
        while (at < text.size() && is_digit(text[at])) ++at;
        return at - from;
    };
    Decimal result;
    const size_t before = digits();
    result.leading_zero = before > 1 && text[0] == '0';
    result.whole = before > 0 && at == text.size();
    if (at < text.size() && text[at] == '.') {
        ++at;
        if (digits() + before == 0) return std::nullopt;
    } else if (before == 0) {
        return std::nullopt;
    }
    if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {
        ++at;
        if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
        if (digits() == 0) return std::nullopt;
    }
    if (at != text.size()) return std::nullopt;
    return result;
}

// 0x1f, 0o17, 0b01 (any case), without sign.
bool is_based(std::string_view text) {
    if (text.size() < 3 || text[0] != '0') return false;
    const char base = lower_case(text.substr(1, 1))[0];
    if (base != 'x' && base != 'o' && base != 'b') return false;
    for (char c : lower_case(text.substr(2)))
        if (!is_digit(c) && !(base == 'x' && c >= 'a' && c <= 'f') && c != '_') return false;
    return true;
}

bool is_nonfinite(std::string_view text) {
    std::string word = lower_case(text);
    if (word.starts_with('.')) word.erase(0, 1);
    return word == "inf" || word == "infinity" || word == "nan";
}

// 1_000: a number with grouped digits.
bool is_grouped(std::string_view text) {
    std::string without;
    for (char c : text)
        if (c != '_') without += c;
    return without.size() != text.size() && is_digit(text[0]) && decimal(without);
}

Result<ParameterValue> point_of(const std::vector<ParameterValue>& values) {
    const Status refused(StatusCode::chain, "a list is two numbers, [x, y]");
    if (values.size() != 2) return refused;
    std::array<double, 2> point;
    for (size_t i = 0; i < 2; ++i) {
        if (const auto* whole = std::get_if<int64_t>(&values[i]))
            point[i] = double(*whole);
        else if (const auto* number = std::get_if<double>(&values[i]))
            point[i] = *number;
        else
            return refused;
    }
    return ParameterValue(point);
}

}  // namespace

Result<ParameterValue> value_of_plain_text(const std::string& text) {
    const auto refuse = [&](const std::string& why) {
        return Status(StatusCode::chain, "'" + text + "' " + why);
    };
    if (text == "true") return ParameterValue(true);
    if (text == "false") return ParameterValue(false);
    if (text.empty() || text == "null" || text == "~") return ParameterValue();
    if (text.front() == '[' && text.back() == ']') {
        std::vector<std::string> items = {""};
        for (char c : std::string_view(text).substr(1, text.size() - 2))
            if (c == ',')
                items.emplace_back();
            else if (c != ' ')
                items.back() += c;
        std::vector<ParameterValue> values;
        for (const std::string& item : items) {
            auto value = value_of_plain_text(item);
            if (!value.ok()) return value;
            values.push_back(std::move(*value));
        }
        return point_of(values);
    }

    std::string_view body = text;
    const bool negative = body[0] == '-';
    if (negative || body[0] == '+') body.remove_prefix(1);
    if (body.empty()) return ParameterValue(text);
    if (is_nonfinite(body)) return refuse("is not a finite number");
    if (is_based(body)) return refuse("is not a decimal number; write it in decimal digits");
    if (is_grouped(body)) return refuse("groups its digits; write the number without '_'");
    const auto form = decimal(body);
    if (!form) return ParameterValue(text);
    if (form->leading_zero)
        return refuse("begins with 0, which some readers take for octal; write it without the 0");

    // from_chars ignores the locale, and reads '-' but not '+'. It reads all of a decimal().
    const std::string_view number = negative ? std::string_view(text) : body;
    const char* end = number.data() + number.size();
    if (form->whole) {
        int64_t integer = 0;
        const auto read = std::from_chars(number.data(), end, integer);
        if (read.ec == std::errc()) return ParameterValue(integer);
    }
    double value = 0;
    const auto read = std::from_chars(number.data(), end, value);
    if (read.ec != std::errc()) return refuse("is too large or too small for a double");
    return ParameterValue(value);
}

Result<ParameterValue> value_of(const TextNode& node) {
    if (node.is_null()) return ParameterValue();
    if (node.is_list()) {
        std::vector<ParameterValue> values;
        for (const TextNode& item : node.items) {
            auto value = item.is_list()
                             ? Status(StatusCode::chain, item.describe() + " is not a number")
                             : value_of(item);
            if (!value.ok()) return value;
            values.push_back(std::move(*value));
        }
        return point_of(values);
    }
    if (!node.is_scalar()) return Status(StatusCode::chain, node.describe() + " is not a value");
    if (node.quoted) return ParameterValue(node.text);
    return value_of_plain_text(node.text);
}

Result<double> number_of(const TextNode& node) {
    ASSIGN_OR_RETURN(const ParameterValue value, value_of(node));
    if (const auto* integer = std::get_if<int64_t>(&value)) return double(*integer);
    if (const auto* number = std::get_if<double>(&value)) return *number;
    return Status(StatusCode::chain, node.describe() + " is not a number");
}

Result<int> integer_of(const TextNode& node, int least, int most) {
    const Result<ParameterValue> value = value_of(node);
    const auto* integer = value.ok() ? std::get_if<int64_t>(&*value) : nullptr;
    if (integer && *integer >= least && *integer <= most) return int(*integer);
    return Status(StatusCode::chain,
                  concat(node.describe(), " is not an integer in ", least, "..", most));
}

Status set_row(const ParameterTable& table, ParameterRef parameters, const Parameter& row,
               const TextNode& value) {
    if (value.is_map() || (value.is_list() && row.type != ParameterType::point))
        return Status(StatusCode::chain, value.describe() + "; " + row.key + " is " + row.domain());
    const Result<ParameterValue> read = value_of(value);
    return read.ok() ? table.set(parameters, row.key, *read) : read.status();
}

std::string yaml_text_of(const ParameterValue& value) {
    const auto* word = std::get_if<std::string>(&value);
    if (!word) return std::holds_alternative<std::monostate>(value) ? "null" : text_of(value);
    bool plain = !word->empty() && !is_digit((*word)[0]);
    for (char c : *word)
        plain = plain && (is_digit(c) || c == '_' ||
                          (lower_case({&c, 1}) >= "a" && lower_case({&c, 1}) <= "z"));
    // Words that this or another YAML reader would not read as strings.
    static const std::array<const char*, 12> taken = {
        "true", "false", "null", "inf", "infinity", "nan", "yes", "no", "on", "off", "y", "n"};
    for (const char* t : taken) plain = plain && lower_case(*word) != t;
    if (plain) return *word;
    return postchain::quoted(*word);
}

}  // namespace postchain

#include "config/scalar.h"

#include <array>
#include <charconv>

#include "chain/base/text.h"

namespace postchain {
namespace {

bool is_digit(char c) {
    return c >= '0' && c <= '9';
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

    // from_chars ignores the locale, reads '-' but not '+', and reads inf and nan.
    std::string_view number = text;
    if (number.starts_with('+')) number.remove_prefix(1);
    const std::string_view digits = number.substr(text[0] == '-' ? 1 : 0);
    const ParameterValue word(text);
    if (digits.empty() || !(is_digit(digits[0]) || digits[0] == '.')) return word;
    const char* end = number.data() + number.size();
    double value = 0;
    const auto read = std::from_chars(number.data(), end, value);
    if (read.ptr != end || read.ec == std::errc::invalid_argument) return word;
    if (digits[0] == '0' && digits.size() > 1 && is_digit(digits[1]))
        return refuse("begins with 0, which some readers take for octal; write it without the 0");
    if (read.ec != std::errc()) return refuse("is too large or too small for a double");
    int64_t integer = 0;
    const auto whole = std::from_chars(number.data(), end, integer);
    if (whole.ptr == end && whole.ec == std::errc()) return ParameterValue(integer);
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

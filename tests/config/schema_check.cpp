#include "schema_check.h"
#include "config/scalar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "config/schema.h"

namespace postchain::test {
namespace {

double number_of(const ParameterValue& value) {
    if (const auto* i = std::get_if<int64_t>(&value)) return double(*i);
    if (const auto* d = std::get_if<double>(&value)) return *d;
    return std::nan("");
}

bool has_type(const TextNode& node, const std::string& type) {
    if (node.is_map()) return type == "object";
    if (node.is_list()) return type == "array";
    const auto read = value_of(node);
    if (!read.ok()) return false;
    if (std::holds_alternative<std::monostate>(*read)) return type == "null";
    if (std::holds_alternative<bool>(*read)) return type == "boolean";
    if (std::holds_alternative<std::string>(*read)) return type == "string";
    const double number = number_of(*read);
    return type == "number" || (type == "integer" && number == std::floor(number));
}

bool equal(const TextNode& a, const TextNode& b) {
    if (a.is_map() || a.is_list() || b.is_map() || b.is_list()) return false;
    const auto x = value_of(a), y = value_of(b);
    if (!x.ok() || !y.ok()) return false;
    return *x == *y || number_of(*x) == number_of(*y);
}

// The first reason why `instance` is not valid by `schema`, or nothing. `root` resolves $ref.
std::string schema_violation(const TextNode& instance, const TextNode& schema,
                             const TextNode& root);

// Whether `node` is valid by this keyword.
bool holds(const std::string& word, const TextNode& node, const TextNode& value,
           const TextNode& schema, const TextNode& root) {
    const auto valid = [&](const TextNode& n, const TextNode& s) {
        return schema_violation(n, s, root).empty();
    };
    if (word == "type") {
        if (value.is_scalar()) return has_type(node, value.text);
        for (const auto& item : value.items)
            if (has_type(node, item.text)) return true;
        return false;
    }
    if (word == "const") return equal(node, value);
    if (word == "enum") {
        for (const auto& item : value.items)
            if (equal(node, item)) return true;
        return false;
    }
    if (word == "not") return !valid(node, value);
    if (word == "allOf" || word == "anyOf" || word == "oneOf") {
        size_t good = 0;
        for (const auto& item : value.items) good += valid(node, item) ? 1 : 0;
        if (word == "anyOf") return good > 0;
        return word == "allOf" ? good == value.items.size() : good == 1;
    }
    if (word == "$ref") {
        const TextNode* target = root.find("$defs")->find(value.text.substr(8));
        return target && valid(node, *target);
    }
    if (word == "items") {
        for (const auto& item : node.items)
            if (!valid(item, value)) return false;
        return true;
    }
    if (node.is_map()) {
        const TextNode* properties = schema.find("properties");
        if (word == "required") {
            for (const auto& item : value.items)
                if (!node.find(item.text)) return false;
        } else if (word == "properties") {
            for (const auto& entry : value.entries)
                if (const TextNode* at = node.find(entry.key.text))
                    if (!valid(*at, entry.value)) return false;
        } else if (word == "additionalProperties" && value.text == "false") {
            for (const auto& entry : node.entries)
                if (!properties || !properties->find(entry.key.text)) return false;
        } else if (word == "minProperties") {
            return double(node.entries.size()) >= number_of(*value_of(value));
        } else if (word == "maxProperties") {
            return double(node.entries.size()) <= number_of(*value_of(value));
        }
        return true;
    }
    if (node.is_list()) {
        const auto count = double(node.items.size());
        if (word == "minItems") return count >= number_of(*value_of(value));
        if (word == "maxItems") return count <= number_of(*value_of(value));
        return true;
    }
    const auto read = value_of(node);
    const double number = read.ok() ? number_of(*read) : std::nan("");
    if (std::isnan(number)) return true;  // keywords of numbers apply only to numbers
    if (word == "minimum") return number >= number_of(*value_of(value));
    if (word == "exclusiveMinimum") return number > number_of(*value_of(value));
    if (word == "maximum") return number <= number_of(*value_of(value));
    if (word == "multipleOf") return std::fmod(number, number_of(*value_of(value))) == 0;
    return true;
}

constexpr std::string_view kKeywords =
    " type const enum not allOf anyOf oneOf $ref items minItems maxItems required properties "
    "additionalProperties minProperties maxProperties minimum exclusiveMinimum maximum multipleOf ";
constexpr std::string_view kAnnotations = " description title default $schema $defs ";

bool is_in(std::string_view words, const std::string& word) {
    return words.find(" " + word + " ") != std::string_view::npos;
}

std::string schema_violation(const TextNode& instance, const TextNode& schema,
                             const TextNode& root) {
    for (const auto& [key, value] : schema.entries) {
        if (is_in(kAnnotations, key.text)) continue;
        if (!is_in(kKeywords, key.text))
            return "keyword " + key.text + " is not known to this check";
        if (!holds(key.text, instance, value, schema, root))
            return "line " + std::to_string(instance.line) + " violates " + key.text;
    }
    return "";
}

}  // namespace

TextNode tree_of(const std::string& text) {
    const TextTree tree = read_text_tree(text, "t");
    EXPECT_EQ(text_of(tree.diagnostics), "") << text;
    return tree.root;
}

ChainSchema::ChainSchema(const PassRegistry& passes) : schema_(tree_of(chain_schema(passes))) {}

std::string ChainSchema::violation(const std::string& text) const {
    return schema_violation(tree_of(text), schema_, schema_);
}

}  // namespace postchain::test

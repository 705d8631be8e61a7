#include "tools/service/work/request_body.h"

#include "config/reporter.h"
#include "config/scalar.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxItems = 256;  // of a list; each may change every pass of a chain

}  // namespace

TextTree read_json_body(const std::string& text) {
    TextTree tree = read_json_tree(text, kBodyFile, StatusCode::usage);
    if (!has_errors(tree.diagnostics) && !tree.root.is_map())
        Reporter(kBodyFile, StatusCode::usage, tree.diagnostics)
            .error(tree.root, "", "a request is a JSON object, not " + tree.root.describe());
    return tree;
}

bool is_string(const TextNode& node) {
    return node.is_scalar() && node.quoted;
}

bool RequestBody::has_zero(const std::string& text) {
    return text.find('\0') != std::string::npos;
}

void RequestBody::fault(const TextNode& at, const std::string& path, const std::string& message) {
    Reporter(kBodyFile, StatusCode::usage, faults_).error(at, path, message);
}

void RequestBody::fault(const std::string& key, const std::string& message) {
    const auto [own, text] = split_key(message);
    const std::string& at = own.empty() ? key : own;
    const TextNode* value = find(at);
    fault(value ? *value : root(), at, text);
}

Problem RequestBody::problem() const {
    Diagnostics shown = faults_;
    for (Diagnostic& one : shown) {
        one.file = roots_.shown_in(one.file);
        one.message = roots_.shown_in(one.message);
    }
    std::string detail = shown.empty() ? "" : shown.front().text();
    if (shown.size() > 1) detail += concat(" (and ", shown.size() - 1, " more)");
    const bool outside = outside_ > 0 && outside_ == faults_.size();
    return {outside ? Problem::Kind::forbidden : Problem::Kind::invalid, detail, std::move(shown)};
}

void RequestBody::integer(const char* key, int least, int most, int& value) {
    const TextNode* node = find(key);
    if (!node) return;
    const Result<int> read = integer_of(*node, least, most);
    if (!read.ok()) return fault(key, read.status().message());
    value = *read;
}

std::vector<std::string> RequestBody::list(const char* key) {
    std::vector<std::string> texts;
    const TextNode* node = find(key);
    if (!node) return texts;
    if (!node->is_list()) fault(key, node->describe() + " is not a list of strings");
    if (node->items.size() > kMaxItems) {
        fault(node->items[kMaxItems], key, concat("more than ", kMaxItems, " items; remove some"));
        return texts;
    }
    for (size_t i = 0; i < node->items.size(); ++i) {
        const TextNode& item = node->items[i];
        if (!is_string(item) || has_zero(item.text))
            fault(item, concat(key, "[", i, "]"), item.describe() + " is not a string");
        else
            texts.push_back(item.text);
    }
    return texts;
}

template <class T>
std::optional<T> RequestBody::confined(const std::string& key, Result<T> resolved) {
    if (resolved.ok()) return std::move(*resolved);
    fault(key, resolved.status().message());
    outside_ += resolved.status().code() == StatusCode::input;
    return std::nullopt;
}

std::optional<std::string> RequestBody::confine(const std::string& key, const std::string& path) {
    return confined(key, roots_.resolve(path));
}

std::optional<io::PathPattern> RequestBody::confine(const std::string& key,
                                                    const io::PathPattern& pattern) {
    return confined(key, resolve_pattern(pattern, roots_));
}

std::optional<io::InputSpec> RequestBody::confine_input(const std::string& key,
                                                        const std::string& text) {
    auto input = io::InputSpec::parse(text);
    if (!input.ok()) {
        fault(key, input.status().message());
        return std::nullopt;
    }
    for (auto& [role, pattern] : input->patterns) {
        auto confined = confine(key, pattern);
        if (!confined) return std::nullopt;
        pattern = std::move(*confined);
    }
    return std::move(*input);
}

}  // namespace postchain::service

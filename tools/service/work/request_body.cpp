#include "tools/service/work/request_body.h"

#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/settings/job_settings.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxItems = 256;  // of a list; each may change every pass of a chain

// The name of a shipped chain or profile, not of a file.
bool is_word(const std::string& text) {
    return text.find_first_of("/.") == std::string::npos;
}

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

PathKind path_kind(const Parameter& row) {
    if (row.type != ParameterType::text) return PathKind::none;
    if (row.unit == "IN" || row.unit == "TRUTH") return PathKind::input;
    if (row.unit == "OUT") return PathKind::output;
    if (row.unit == "FILE" || row.unit == "DIR") return PathKind::file;
    return row.key == "profile" ? PathKind::profile : PathKind::none;
}

bool RequestBody::has_zero(const std::string& text) {
    return text.find('\0') != std::string::npos;
}

void RequestBody::fault(const TextNode& at, const std::string& path, const std::string& message) {
    only_outside_ = false;
    Reporter(kBodyFile, StatusCode::usage, faults_).error(at, path, message);
}

void RequestBody::fault(const std::string& key, const std::string& message) {
    const auto [own, text] = split_key(message);
    const std::string& at = own.empty() ? key : own;
    const TextNode* value = find(at);
    fault(value ? *value : root(), at, text);
}

void RequestBody::outside(const std::string& key, const std::string& message) {
    const bool only_outside = only_outside_;
    fault(key, message);
    only_outside_ = only_outside;
    met_outside_ = true;
}

void RequestBody::refuse_path(const std::string& key, const Status& status) {
    if (status.code() == StatusCode::input)
        outside(key, status.message());
    else
        fault(key, status.message());
}

void RequestBody::add(Diagnostic diagnostic, bool is_outside) {
    if (is_outside)
        met_outside_ = true;
    else if (diagnostic.severity == Severity::error)
        only_outside_ = false;
    faults_.push_back(std::move(diagnostic));
}

Problem RequestBody::problem() const {
    Diagnostics shown = faults_;
    for (Diagnostic& one : shown) {
        one.file = roots_.shown_in(one.file);
        one.message = roots_.shown_in(one.message);
    }
    return refusal(
        met_outside_ && only_outside_ ? Problem::Kind::forbidden : Problem::Kind::invalid,
        std::move(shown));
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

void RequestBody::read_row(const Parameter& row, const ParameterTable& table,
                           ParameterRef settings) {
    const TextNode* node = find(row.key);
    if (!node) {
        if (!row.optional && row.default_value == ParameterValue()) fault(row.key, "missing");
        return;
    }
    if (is_string(*node) && node->text.empty()) return fault(row.key, "empty");
    if (is_string(*node) && has_zero(node->text)) return fault(row.key, "contains a zero byte");
    if (Status status = set_row(table, settings, row, *node); !status.ok())
        fault(row.key, status.message());
}

void RequestBody::read_rows(const ParameterTable& table, const char* group, ParameterRef settings) {
    for (const Parameter& row : table.rows())
        if (row.group == group) read_row(row, table, settings);
}

std::optional<std::string> RequestBody::confine(const std::string& key, const std::string& path) {
    auto resolved = roots_.resolve(path);
    if (resolved.ok()) return std::move(*resolved);
    refuse_path(key, resolved.status());
    return std::nullopt;
}

std::optional<io::PathPattern> RequestBody::confine(const std::string& key,
                                                    const io::PathPattern& pattern) {
    auto resolved = resolve_pattern(pattern, roots_);
    if (resolved.ok()) return std::move(*resolved);
    refuse_path(key, resolved.status());
    return std::nullopt;
}

void RequestBody::confine_file(const Parameter& row, ParameterRef settings) {
    const ParameterValue value = row.get(settings);
    const auto* text = std::get_if<std::string>(&value);
    if (!text) return;
    if (path_kind(row) == PathKind::profile && is_word(*text)) return;
    const auto confined = confine(row.key, *text);
    if (!confined) return;
    row.set(settings, *confined);
    if (row.key == "ocio") confine_tables(row.key, *confined);
}

void RequestBody::confine_tables(const std::string& key, const std::string& config) {
    const auto module = io::image_module(StatusCode::input);
    if (!module.ok()) return fault(key, module.status().message());
    const auto sources = (*module)->ocio_sources(config);
    if (!sources.ok()) return;  // reported by the transfer that uses it
    for (const std::string& file : sources->files)
        if (!roots_.resolve(file).ok())
            return outside(key, "names a table outside the folders of this service");
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

void RequestBody::confine_rows(const ParameterTable& table, ParameterRef settings) {
    for (const Parameter& row : table.rows())
        if (path_kind(row) == PathKind::file) confine_file(row, settings);
}

bool RequestBody::confine_image(const std::string& key, Camera& camera) {
    const std::string file = camera.aperture_image.file();
    if (file.empty()) return true;
    auto resolved = roots_.resolve(file);
    if (!resolved.ok()) {
        // The message leaves out the path: it is absolute by now and would reveal the roots.
        outside(key, "camera.aperture_image is outside the folders of this service");
        return false;
    }
    camera.aperture_image = BokehKernel(*resolved);
    return true;
}

}  // namespace postchain::service

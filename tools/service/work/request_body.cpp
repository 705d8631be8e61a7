#include "tools/service/work/request_body.h"

#include "tools/sequence/files/parameter_json.h"
#include "tools/sequence/image/picture_module.h"
#include "tools/service/work/held_paths.h"

namespace postchain::service {

RequestBody::RequestBody(const std::string& text, const Roots& roots)
    : roots_(roots), body_(read_json_body(text, faults_)) {}

bool RequestBody::has_zero(const std::string& text) {
    return text.find('\0') != std::string::npos;
}

void RequestBody::fault(size_t at, const std::string& path, const std::string& message) {
    only_outside_ = false;
    faults_.push_back(body_.fault(at, path, message));
}

void RequestBody::fault(const std::string& key, const std::string& message) {
    const JsonMember* member = find(key);
    fault(member ? member->value_at : 0, key, message);
}

void RequestBody::outside(const std::string& key, const std::string& message) {
    const JsonMember* member = find(key);
    faults_.push_back(body_.fault(member ? member->value_at : 0, key, message));
    met_outside_ = true;
}

void RequestBody::add(Diagnostic diagnostic, bool is_outside) {
    if (is_outside)
        met_outside_ = true;
    else if (diagnostic.severity == Severity::error)
        only_outside_ = false;
    faults_.push_back(std::move(diagnostic));
}

Problem RequestBody::problem() const {
    Problem problem;
    problem.kind =
        met_outside_ && only_outside_ ? Problem::Kind::forbidden : Problem::Kind::invalid;
    problem.diagnostics = faults_;
    for (Diagnostic& one : problem.diagnostics) {
        one.file = roots_.shown_in(one.file);
        one.message = roots_.shown_in(one.message);
    }
    size_t errors = 0;
    const Diagnostic* first = nullptr;
    for (const Diagnostic& one : problem.diagnostics)
        if (one.severity == Severity::error && errors++ == 0) first = &one;
    if (first)
        problem.detail = (first->path.empty() ? first->file : first->path) + ": " + first->message +
                         (errors > 1 ? concat(" (and ", errors - 1, " more)") : "");
    return problem;
}

void RequestBody::integer(const char* key, int least, int most, int& value) {
    const JsonMember* member = find(key);
    if (!member) return;
    const io::Json& json = member->value;
    if (!json.is_number_integer() || json < least || json > most)
        return fault(key, concat("is an integer in ", least, "..", most));
    value = json.get<int>();
}

std::vector<std::string> RequestBody::list(const char* key) {
    std::vector<std::string> texts;
    const JsonMember* member = find(key);
    if (!member) return texts;
    if (!member->value.is_array()) {
        fault(key, "is a list of texts");
        return texts;
    }
    for (size_t i = 0; i < member->value.size(); ++i) {
        const io::Json& item = member->value[i];
        if (!item.is_string() || has_zero(item.get_ref<const std::string&>()))
            fault(member->value_at, concat(key, "[", i, "]"), "is no text");
        else
            texts.push_back(item.get<std::string>());
    }
    return texts;
}

void RequestBody::read_row(const Parameter& row, const ParameterTable& table,
                           ParameterRef settings) {
    const JsonMember* member = find(row.key);
    if (!member) {
        if (!row.optional && row.default_value == ParameterValue())
            fault(start(), row.key, "is missing");
        return;
    }
    const auto value = io::value_of(member->value);
    if (!value) return fault(row.key, "is " + row.domain() + ", not " + member->value.type_name());
    if (const auto* text = std::get_if<std::string>(&*value)) {
        if (text->empty()) return fault(row.key, "is empty");
        if (has_zero(*text)) return fault(row.key, "has a zero byte");
    }
    if (Status status = table.set(settings, row.key, *value); !status.ok())
        fault(row.key, status.message());
}

void RequestBody::read_rows(const ParameterTable& table, const char* group, ParameterRef settings) {
    for (const Parameter& row : table.rows())
        if (row.group == group) read_row(row, table, settings);
}

void RequestBody::hold_file(const Parameter& row, ParameterRef settings) {
    const ParameterValue value = row.get(settings);
    const auto* text = std::get_if<std::string>(&value);
    if (!text || text->empty()) return;
    if (path_kind(row) == PathKind::profile && is_word(*text)) return;
    auto resolved = roots_.resolve(*text);
    if (!resolved.ok()) return outside(row.key, resolved.status().message());
    row.set(settings, *resolved);
    if (row.key == "ocio") hold_tables(row.key, *resolved);
}

void RequestBody::hold_tables(const std::string& key, const std::string& config) {
    const auto module = io::picture_module(StatusCode::input);
    if (!module.ok()) return fault(key, module.status().message());
    const auto files = (*module)->ocio_files(config);
    if (!files.ok()) return;  // said by what uses it
    for (const std::string& file : *files)
        if (!roots_.resolve(file).ok())
            return outside(key, "names a table that is outside the folders of this service");
}

std::optional<io::InputSpec> RequestBody::hold_input(const std::string& key,
                                                     const std::string& text) {
    auto input = io::InputSpec::parse(text);
    if (!input.ok()) {
        fault(key, input.status().message());
        return std::nullopt;
    }
    for (auto& [role, pattern] : input->patterns) {
        auto resolved = resolve_pattern(pattern, roots_);
        if (!resolved.ok()) {
            outside(key, resolved.status().message());
            return std::nullopt;
        }
        pattern = std::move(*resolved);
    }
    return std::move(*input);
}

void RequestBody::hold_rows(const ParameterTable& table, ParameterRef settings) {
    for (const Parameter& row : table.rows())
        if (path_kind(row) == PathKind::file) hold_file(row, settings);
}

bool RequestBody::hold_picture(const std::string& key, Camera& camera) {
    const std::string file = camera.aperture_image.file();
    if (file.empty()) return true;
    auto resolved = roots_.resolve(file);
    if (!resolved.ok()) {
        // Its name has been made whole by now, and would tell where the roots are.
        outside(key, "camera.aperture_image is outside the folders of this service");
        return false;
    }
    camera.aperture_image = ApertureImage(*resolved);
    return true;
}

}  // namespace postchain::service

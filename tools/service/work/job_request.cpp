#include "tools/service/work/job_request.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <optional>

#include "config/chain_file.h"
#include "config/chain_find.h"
#include "config/reporter.h"
#include "config/scalar.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

// Keys that the service reads itself.
constexpr std::array kOwnKeys = {"kind", "priority", "frame_timeout"};
constexpr std::array kPreviewKeys = {"frame", "scale"};

bool is_job(RequestKind kind) {
    return kind != RequestKind::plan && kind != RequestKind::preview;
}

// The arguments of a kind: their keys.
std::vector<std::string> subjects_of(RequestKind kind) {
    if (kind == RequestKind::study) return {"study"};
    if (kind == RequestKind::ab) return {"chain", "chain_b"};
    return {"chain"};
}

// The options of a kind: properties of its schema that are not its arguments.
std::vector<std::pair<std::string, Json>> options_of(RequestKind kind, const Json& schema) {
    const std::vector<std::string> arguments = subjects_of(kind);
    std::vector<std::pair<std::string, Json>> options;
    for (const auto& [key, row] : schema.at("properties").items())
        if (std::ranges::find(arguments, key) == arguments.end()) options.emplace_back(key, row);
    return options;
}

std::vector<std::string> keys_of(RequestKind kind, const Json& schema) {
    std::vector<std::string> keys;
    if (is_job(kind)) keys.assign(kOwnKeys.begin(), kOwnKeys.end());
    if (kind == RequestKind::preview) keys.assign(kPreviewKeys.begin(), kPreviewKeys.end());
    for (const std::string& key : subjects_of(kind)) {
        keys.push_back(key);
        if (kind != RequestKind::study) keys.push_back(key + "_text");
    }
    for (const auto& [key, row] : options_of(kind, schema)) keys.push_back(key);
    return keys;
}

// An object of a JSON text, on the lines and columns where it stands: what is before it is blank.
std::string object_in_place(const std::string& text, const TextNode& node) {
    size_t begin = text.starts_with("\xef\xbb\xbf") ? 3 : 0;  // byte order mark
    for (int line = 1; line < node.line; ++line) begin = text.find('\n', begin) + 1;
    for (int column = 1; column < node.column; ++column)
        while ((text[++begin] & 0xc0) == 0x80) {
        }
    size_t end = begin;
    bool quoted = false;
    int depth = 0;
    do {
        const char c = text[end++];
        if (quoted && c == '\\')
            ++end;
        else if (c == '"')
            quoted = !quoted;
        else if (!quoted && (c == '{' || c == '}'))
            depth += c == '{' ? 1 : -1;
    } while (depth > 0);
    return std::string(size_t(node.line - 1), '\n') + std::string(size_t(node.column - 1), ' ') +
           text.substr(begin, end - begin);
}

std::string input_words(const io::InputSpec& input) {
    if (!input.separate_files()) return input.color().text();
    std::string text;
    for (const auto& [role, pattern] : input.patterns)
        text += concat(text.empty() ? "" : ",", io::InputSpec::word_of(role), "=", pattern.text());
    return text;
}

// The name of a shipped profile, not of a file.
bool is_word(const std::string& text) {
    return text.find_first_of("/.") == std::string::npos;
}

class RequestParser {
  public:
    RequestParser(const JobReader& reader, const std::string& text)
        : reader_(reader), text_(text), body_(text, reader.roots()) {}

    Answer<JobRequest> read(RequestKind asked) {
        if (!body_.faults().empty()) return body_.problem();
        request_.kind = asked == RequestKind::run ? kind_of_job() : asked;
        const auto schema = reader_.schemas().find(request_.kind);
        if (schema == reader_.schemas().end()) return body_.problem();
        const std::vector<std::string> known = keys_of(request_.kind, schema->second);
        for (const auto& [key, value] : body_.root().entries)
            if (std::ranges::find(known, key.text) == known.end())
                body_.fault(key, key.text, unknown_word("key", key.text, known));
        body_.integer("priority", -kMaxPriority, kMaxPriority, request_.priority);
        body_.integer("frame_timeout", 1, kMaxFrameTimeoutS, request_.frame_timeout_s);
        for (const std::string& key : subjects_of(request_.kind)) read_subject(key);
        for (const auto& [key, row] : options_of(request_.kind, schema->second))
            read_option(key, row, schema->second);
        if (request_.kind == RequestKind::preview) read_preview();
        if (has_errors(body_.faults())) return body_.problem();
        return std::move(request_);
    }

  private:
    RequestKind kind_of_job() {
        const TextNode* node = body_.find("kind");
        if (!node) return RequestKind::run;
        std::vector<std::string> names;
        for (const RequestKind kind : kRequestKinds) {
            if (!is_job(kind)) continue;
            const bool known = reader_.schemas().contains(kind);
            if (is_string(*node) && node->text == name_of(kind)) {
                if (known) return kind;
                body_.fault("kind", node->text + " jobs need postchain-lab beside the command");
                return RequestKind::run;
            }
            if (known) names.emplace_back(name_of(kind));
        }
        body_.fault("kind", unknown_word("kind", node->text, names));
        return RequestKind::run;
    }

    // ---------------------------------------------------------------------- chains and studies
    void read_subject(const std::string& key) {
        const bool is_study = key == "study";
        const TextNode* named = body_.find(key);
        const TextNode* written = is_study ? nullptr : body_.find(key + "_text");
        const std::string what =
            is_study ? "a study's file or object" : "a chain's name, file or object";
        if (named && written)
            return body_.fault(key + "_text", "contradicts " + key + "; give one of them");
        if (!named && !written) return body_.fault(key, concat("missing; give ", what));
        NamedText subject{key, key + ".yaml"};
        if (written) {
            if (!is_string(*written))
                return body_.fault(key + "_text",
                                   written->describe() + " is not a chain file's text");
            subject.text = written->text;
            subject.written = true;
        } else if (named->is_map()) {
            subject.text = object_in_place(text_, *named);
            subject.written = subject.in_body = true;
        } else if (!is_string(*named) || named->text.empty()) {
            return body_.fault(
                key, (is_string(*named) ? "empty; give " : named->describe() + " is not ") + what);
        } else if (!is_study && find_shipped(named->text)) {
            subject.word = named->text;
        } else if (RequestBody::has_zero(named->text)) {
            return body_.fault(key, "contains a zero byte");
        } else if (!is_study && is_word(named->text)) {
            return body_.fault(key, find_chain(named->text).status().message());
        } else {
            auto confined = body_.confine(key, named->text);
            if (!confined) return;
            subject.word = std::move(*confined);
        }
        request_.subjects.push_back(std::move(subject));
    }

    static bool find_shipped(const std::string& name) {
        const auto names = shipped_chains();
        return std::ranges::find(names, name) != names.end();
    }

    // --------------------------------------------------------------------------------- options
    void read_option(const std::string& key, const Json& row, const Json& schema) {
        const TextNode* node = body_.find(key);
        if (!node) {
            if (const auto required = schema.find("required");
                required != schema.end() &&
                std::ranges::find(*required, Json(key)) != required->end())
                body_.fault(key, "missing");
            return;
        }
        const std::string type = type_of(row);
        if (node->is_null() && row.at("type").is_array()) return;
        if (type == "array") {
            for (std::string& item : body_.list(key.c_str())) add(key, from_root(item));
        } else if (type == "boolean") {
            if (!is_flag(*node))
                return body_.fault(key, node->describe() + " is not true or false");
            const std::string option = option_name(key);
            request_.options.emplace_back(
                key, node->text == "true" ? option : "--no-" + option.substr(2));
        } else if (type == "string") {
            if (!is_string(*node)) return body_.fault(key, node->describe() + " is not a string");
            if (node->text.empty()) return body_.fault(key, "empty");
            if (RequestBody::has_zero(node->text)) return body_.fault(key, "contains a zero byte");
            if (const auto choices = row.find("enum");
                choices != row.end() && !check_choice(key, node->text, *choices))
                return;
            read_text(key, node->text, row.value("x-path", ""));
        } else {
            read_number(key, *node, row, type == "integer");
        }
    }

    // Of a key that may also be null the other one.
    static std::string type_of(const Json& row) {
        const Json& type = row.at("type");
        return (type.is_array() ? type.at(0) : type).get<std::string>();
    }

    static bool is_flag(const TextNode& node) {
        return node.is_scalar() && !node.quoted && (node.text == "true" || node.text == "false");
    }

    bool check_choice(const std::string& key, const std::string& text, const Json& choices) {
        std::vector<std::string> names;
        for (const Json& choice : choices)
            if (choice.is_string()) names.push_back(choice.get<std::string>());
        if (std::ranges::find(names, text) != names.end()) return true;
        body_.fault(key, unknown_word(key, text, names));
        return false;
    }

    void read_number(const std::string& key, const TextNode& node, const Json& row, bool whole) {
        const Result<double> value = number_of(node);
        const double least = row.value("minimum", -1e300), most = row.value("maximum", 1e300);
        if (!value.ok() || !(*value >= least && *value <= most) ||
            (whole && !integer_of(node, int(std::max(least, -2e9)), int(std::min(most, 2e9))).ok()))
            return body_.fault(
                key, concat(node.describe(), " is not a ", whole ? "whole " : "", "number",
                            row.contains("minimum") && row.contains("maximum")
                                ? concat(" in ", least, "..", most)
                                : std::string()));
        add(key, node.text);
    }

    void read_text(const std::string& key, const std::string& text, const std::string& path) {
        if (path == "input") {
            auto input = body_.confine_input(key, text);
            if (!input) return;
            const std::string words = input_words(*input);
            if (key == "input") request_.input = words;
            return add(key, words);
        }
        if (path == "pattern" || path == "output") {
            auto pattern = io::PathPattern::parse(text);
            if (!pattern.ok()) return body_.fault(key, pattern.status().message());
            const auto confined = body_.confine(key, *pattern);
            if (!confined) return;
            if (key == "output") request_.output = confined->text();
            return add(key, confined->text());
        }
        if (path.empty() || (path == "profile" && is_word(text))) return add(key, text);
        const auto confined = body_.confine(key, text);
        if (!confined) return;
        if (key == "output") request_.output = *confined;
        add(key, *confined);
    }

    void add(const std::string& key, const std::string& value) {
        request_.options.emplace_back(key, option_name(key) + "=" + value);
    }

    // An override; the path of an aperture image is relative to the first root.
    std::string from_root(const std::string& text) const {
        const std::string key = "camera.aperture_image=";
        if (!text.starts_with(key) || text.size() == key.size() || text[key.size()] == '/' ||
            text == key + "null")
            return text;
        return key + joined_path(reader_.roots().folders().front(), text.substr(key.size()));
    }

    void read_preview() {
        body_.integer("frame", -io::kMaxFrameNumber, io::kMaxFrameNumber, request_.frame);
        if (!body_.find("frame")) body_.fault("frame", "missing");
        const TextNode* scale = body_.find("scale");
        if (!scale) return;
        const Result<double> value = number_of(*scale);
        if (!value.ok() || *value < kMinPreviewScale || *value > 1)
            return body_.fault("scale", concat(scale->describe(), " is not a number in ",
                                               kMinPreviewScale, "..1"));
        request_.scale = *value;
    }

    const JobReader& reader_;
    const std::string& text_;
    RequestBody body_;
    JobRequest request_;
};

Answer<JobRequest> read(const JobReader& reader, const std::string& body, RequestKind kind) {
    try {
        return RequestParser(reader, body).read(kind);
    } catch (...) {
        return Problem{Problem::Kind::internal, status_of_exception("the request").message()};
    }
}

}  // namespace

const char* name_of(RequestKind kind) {
    if (is_job(kind)) return name_of(JobKind(kind));
    return kind == RequestKind::plan ? "plan" : "preview";
}

std::string JobRequest::value(std::string_view key, std::string_view otherwise) const {
    for (const auto& [name, word] : options)
        if (name == key) return word.substr(word.find('=') + 1);
    return std::string(otherwise);
}

std::vector<std::string> words_of(const JobRequest& request, const std::string& folder,
                                  const std::vector<std::string_view>& without) {
    std::vector<std::string> words = {name_of(request.kind)};
    bool written = false;
    for (const NamedText& subject : request.subjects) {
        words.push_back(subject.written ? joined_path(folder, subject.word) : subject.word);
        written = written || subject.written;
    }
    // Files that a text names are relative to the first root, where the program starts.
    if (written) words.emplace_back("--relative-to=.");
    for (const auto& [key, word] : request.options)
        if (std::ranges::find(without, key) == without.end()) words.push_back(word);
    return words;
}

Status write_texts(const JobRequest& request, const std::string& folder) {
    for (const NamedText& subject : request.subjects) {
        if (!subject.written) continue;
        const std::string path = joined_path(folder, subject.word);
        std::ofstream out(path, std::ios::binary);
        out << subject.text;
        out.close();
        if (!out) return Status(StatusCode::output, path + ": cannot be written");
    }
    return Status();
}

Answer<JobRequest> JobReader::job(const std::string& body) const {
    return read(*this, body, RequestKind::run);
}

Answer<JobRequest> JobReader::plan(const std::string& body) const {
    return read(*this, body, RequestKind::plan);
}

Answer<JobRequest> JobReader::preview(const std::string& body) const {
    return read(*this, body, RequestKind::preview);
}

Answer<int> read_priority(const std::string& body, const Roots& roots) {
    RequestBody text(body, roots);
    int priority = 0;
    if (text.faults().empty() && !text.find("priority"))
        text.fault("priority", "missing; it is the only key that can be changed");
    for (const auto& [key, value] : text.root().entries)
        if (key.text != "priority")
            text.fault(key, key.text, "cannot be changed; submit another job");
    text.integer("priority", -kMaxPriority, kMaxPriority, priority);
    if (has_errors(text.faults())) return text.problem();
    return priority;
}

Answer<Diagnostics> check_chain_text(const std::string& body, const Roots& roots,
                                     const PassRegistry& registry) {
    RequestBody request(body, roots);
    const TextNode* text = request.find("text");
    if (request.faults().empty() && !(text && is_string(*text)))
        request.fault("text", "missing, or not a chain file's text");
    if (!request.faults().empty()) return request.problem();
    return parse_chain(text->text, "chain", registry).diagnostics;
}

// ----------------------------------------------------------------------------------------- users
Result<JobReader> Readers::of(const User& user) const {
    if (user.roots.empty()) return all_;
    ASSIGN_OR_RETURN(auto roots, all_.roots().within(user.roots));
    return all_.with(std::move(roots));
}

Result<JobReader> Readers::of(const std::string& owner) const {
    const KnownUser user = users_.named(owner);
    // Jobs from before there were users, and jobs of a service that no longer has any.
    if (!user && (owner.empty() || users_.named(""))) return all_;
    if (!user)
        return Status(StatusCode::usage, "user '" + owner +
                                             "' is no longer in the file of users; add the user "
                                             "again and retry the job");
    return of(*user);
}

Result<ReadJob> Readers::read(const Job& job) const {
    ASSIGN_OR_RETURN(auto reader, of(job.owner));
    auto read = reader.job(job.body);
    if (read.ok()) return ReadJob{std::move(reader), std::move(*read)};
    const Status status = status_of(read.status().diagnostics);
    return Status(status.ok() ? StatusCode::usage : status.code(), read.status().detail);
}

// ---------------------------------------------------------------------------------------- schema
io::Json job_schema(const Schemas& schemas) {
    Json kinds = Json::array();
    const auto text = [](const std::string& help, const Json& type) {
        return Json{{"description", help}, {"type", type}};
    };
    for (const auto& [kind, schema] : schemas) {
        if (!is_job(kind)) continue;
        Json properties = Json::object();
        properties["kind"] = {{"const", name_of(kind)}};
        properties["priority"] = {{"type", "integer"},
                                  {"minimum", -kMaxPriority},
                                  {"maximum", kMaxPriority},
                                  {"default", 0}};
        properties["frame_timeout"] = {
            {"description",
             "seconds in which a job must read, filter or write something, else its process is "
             "killed; in place of --frame-timeout of the service"},
            {"type", "integer"},
            {"minimum", 1},
            {"maximum", kMaxFrameTimeoutS}};
        Json required = kind == RequestKind::run ? Json::array() : Json::array({"kind"});
        for (const std::string& key : subjects_of(kind)) {
            if (kind == RequestKind::study) {
                properties[key] =
                    text("a study's file, or a study as an object", {"string", "object"});
                required.push_back(key);
                continue;
            }
            properties[key] = text("a shipped chain's name, a chain file, or a chain as an object",
                                   {"string", "object"});
            properties[key + "_text"] =
                text("the text of a chain file, in place of " + key, "string");
        }
        for (const auto& [key, row] : options_of(kind, schema)) properties[key] = row;
        // As Programs::check() and the runner set it.
        if (kind == RequestKind::run) properties["on_error"]["default"] = "continue";
        if (const auto needs = schema.find("required"); needs != schema.end())
            for (const Json& key : *needs)
                if (const auto arguments = subjects_of(kind);
                    std::ranges::find(arguments, key.get<std::string>()) == arguments.end())
                    required.push_back(key);
        kinds.push_back({{"title", name_of(kind)},
                         {"type", "object"},
                         {"additionalProperties", false},
                         {"required", required},
                         {"properties", properties}});
    }
    return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
            {"title", "a job of the postchain service"},
            {"oneOf", std::move(kinds)}};
}

}  // namespace postchain::service

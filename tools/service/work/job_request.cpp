#include "tools/service/work/job_request.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "config/chain_find.h"
#include "config/reporter.h"
#include "config/scalar.h"
#include "config/schema.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/settings/color_settings.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/request_body.h"
#include "tools/service/work/service.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

// ------------------------------------------------------------------------------------------ keys
// The keys of each kind of body, with the JSON Schema of their values. Every other key is refused.
using BodyKeys = std::vector<std::pair<std::string, Json>>;

Json string_schema(const char* help) {
    return {{"description", help}, {"type", "string"}};
}

Json strings_schema(const char* help) {
    return {{"description", help}, {"type", "array"}, {"items", {{"type", "string"}}}};
}

Json string_or_object(const char* help) {
    return {{"description", help}, {"type", {"string", "object"}}};
}

void add_chain(const std::string& key, BodyKeys& keys) {
    keys.emplace_back(key, string_or_object("a shipped chain's name, a chain file, or a chain as "
                                            "an object"));
    keys.emplace_back(key + "_text",
                      string_schema(("the text of a chain file, in place of " + key).c_str()));
}

void add_rows(const ParameterTable& table, const std::string& group, BodyKeys& keys) {
    for (const Parameter& row : table.rows())
        if (row.group == group) keys.emplace_back(row.key, io::json_from(row_schema(row)));
}

BodyKeys body_keys(RequestKind kind, const ParameterTable& run_table) {
    BodyKeys keys;
    if (kind != RequestKind::plan && kind != RequestKind::preview) {
        keys.emplace_back("kind", Json{{"const", name_of(JobKind(kind))}});
        keys.emplace_back("priority", Json{{"type", "integer"},
                                           {"minimum", -kMaxPriority},
                                           {"maximum", kMaxPriority},
                                           {"default", 0}});
        keys.emplace_back(
            "frame_timeout",
            Json{{"description",
                  "seconds that reading, filtering or writing a frame may take; in place of "
                  "--frame-timeout of the service"},
                 {"type", "integer"},
                 {"minimum", 1},
                 {"maximum", kMaxFrameTimeoutS}});
    }
    if (kind == RequestKind::study) {
        keys.emplace_back("study", string_or_object("a study's file, or the study as an object "
                                                    "(docs/studies.md)"));
        add_rows(study::study_parameters(), "", keys);
        return keys;
    }
    add_chain("chain", keys);
    keys.emplace_back("set", strings_schema("KEY=VALUE, as --set"));
    add_rows(run_table, sequence::kInputGroup, keys);
    add_rows(run_table, sequence::kPlanGroup, keys);
    if (kind == RequestKind::run || kind == RequestKind::plan)
        add_rows(run_table, sequence::kLayerGroup, keys);
    if (kind == RequestKind::run) add_rows(run_table, sequence::kOutputGroup, keys);
    if (kind == RequestKind::ab) add_rows(experiment::ab_parameters(), "", keys);
    if (kind == RequestKind::bench) add_rows(experiment::bench_parameters(), "", keys);
    if (kind == RequestKind::ab || kind == RequestKind::bench)
        keys.emplace_back("fail_above", strings_schema("METRIC=NUMBER, as --fail-above"));
    if (kind == RequestKind::ab) add_chain("chain_b", keys);
    if (kind == RequestKind::bench) {
        keys.emplace_back("sweep", strings_schema("KEY=V1,V2,..., as --sweep"));
        keys.emplace_back("under", strings_schema("METRIC=NUMBER, as --under"));
    }
    if (kind == RequestKind::preview) {
        keys.emplace_back("frame", Json::object());
        keys.emplace_back("scale", Json::object());
        keys.emplace_back("plane", Json::object());
    }
    return keys;
}

Json schema_of(RequestKind kind, const std::vector<std::string>& required,
               const ParameterTable& run_table) {
    Json properties = Json::object();
    for (auto& [key, schema] : body_keys(kind, run_table)) properties[key] = std::move(schema);
    return {{"title", name_of(JobKind(kind))},
            {"type", "object"},
            {"additionalProperties", false},
            {"required", required},
            {"properties", properties}};
}

// ---------------------------------------------------------------------------- chains and studies
// An override; the path of an aperture image is relative to the first root.
std::string from_root(const std::string& text, const Roots& roots) {
    const std::string key = "camera.aperture_image=";
    if (!text.starts_with(key) || text.size() == key.size() || text[key.size()] == '/' ||
        text == key + "null")
        return text;
    return key + joined_path(roots.folders().front(), text.substr(key.size()));
}

// The chains of a request: named, in a file, an object or a text; with the overrides of `set` and
// the variants of `sweep`.
class ChainReader {
  public:
    // The arguments outlive this object. Reads `set`.
    ChainReader(RequestBody& body, const Roots& roots, const PassRegistry& registry);

    // The chain of KEY or KEY_text.
    void read(const std::string& key, experiment::NamedChain& chain, ChainText& text);
    // The variants of `sweep`; empty if the body has faults.
    std::vector<experiment::NamedChain> variants(const ChainText& text, int most);

  private:
    bool find(const std::string& key, const std::string& name, ChainText& text);

    RequestBody& body_;
    const Roots& roots_;
    const PassRegistry& registry_;
    std::vector<std::string> sets_;
};

ChainReader::ChainReader(RequestBody& body, const Roots& roots, const PassRegistry& registry)
    : body_(body), roots_(roots), registry_(registry), sets_(body.list("set")) {
    for (std::string& text : sets_) text = from_root(text, roots);
}

void ChainReader::read(const std::string& key, experiment::NamedChain& chain, ChainText& text) {
    const std::string text_key = key + "_text";
    const TextNode* named = body_.find(key);
    const TextNode* written = body_.find(text_key);
    if (named && written) return body_.fault(text_key, "contradicts " + key + "; give one of them");
    if (!named && !written) return body_.fault(key, "missing; give a chain's name, file or object");
    // Files that a chain names are relative to the folder of its text.
    const std::string in_root = joined_path(roots_.folders().front(), kBodyFile);
    std::string shown_as;
    if (written) {
        if (!is_string(*written))
            return body_.fault(text_key, written->describe() + " is not a chain file's text");
        text = {in_root, written->text, false};
        shown_as = text_key;
    } else if (named->is_map()) {
        text = {in_root, {}, false, *named};
        shown_as = kBodyFile;
    } else if (is_string(*named)) {
        if (!find(key, named->text, text)) return;
    } else {
        return body_.fault(key, named->describe() + " is not a chain's name, file or object");
    }
    chain.name = shown_as.empty() ? fs::path(text.file_name).stem().string() : key;
    ChainFile file = parse_chain(text, registry_, sets_);
    for (Diagnostic& one : file.diagnostics) {
        if (one.file == text.file_name && !shown_as.empty()) one.file = shown_as;
        body_.add(std::move(one));
    }
    if (!file.status().ok()) return;
    if (body_.confine_image(key, file.chain.camera)) {
        io::ApertureFiles images;
        if (Status status = images.read(file.chain.camera); !status.ok())
            body_.fault(key, "camera.aperture_image: " + status.message());
    }
    chain.chain = std::move(file.chain);
}

bool ChainReader::find(const std::string& key, const std::string& name, ChainText& text) {
    bool outside = false;
    auto found = find_named_chain(name, [&](const std::string& path) {
        auto resolved = roots_.resolve(path);
        outside = !resolved.ok();
        return resolved;
    });
    if (found.ok()) {
        text = std::move(*found);
        return true;
    }
    if (outside)
        body_.outside(key, found.status().message());
    else
        body_.fault(key, found.status().message());
    return false;
}

std::vector<experiment::NamedChain> ChainReader::variants(const ChainText& text, int most) {
    std::vector<experiment::Sweep> sweeps;
    for (const std::string& one : body_.list("sweep")) {
        auto sweep = experiment::parse_sweep(one);
        if (!sweep.ok()) {
            body_.fault("sweep", sweep.status().message());
            continue;
        }
        if (sweep->key == "camera.aperture_image")
            for (std::string& value : sweep->values)
                if (auto confined = body_.confine("sweep", value)) value = std::move(*confined);
        sweeps.push_back(std::move(*sweep));
    }
    if (has_errors(body_.faults())) return {};
    auto variants = experiment::sweep_variants(text, registry_, sets_, sweeps, most);
    if (variants.ok()) return std::move(*variants);
    body_.fault("sweep", variants.status().message());
    return {};
}

// `refused` counts the paths outside the roots.
study::StudyPaths paths_from(const fs::path& folder, const Roots& roots, size_t& refused) {
    return {[folder, &roots, &refused](const std::string& path) {
                auto resolved = roots.resolve((folder / path).string());
                refused += !resolved.ok();
                return resolved;
            },
            [folder, &roots, &refused](const io::PathPattern& pattern) -> Result<io::PathPattern> {
                auto whole = io::PathPattern::parse((folder / pattern.text()).string());
                if (!whole.ok()) return whole;
                auto resolved = resolve_pattern(*whole, roots);
                refused += !resolved.ok();
                return resolved;
            }};
}

// A file, whose paths are relative to its folder, or an object, whose paths are relative to the
// first root.
void read_study(RequestBody& body, const Roots& roots, const PassRegistry& registry,
                const std::string& version, JobRequest& request) {
    study::StudySettings& settings = request.study_settings;
    body.read_rows(study::study_parameters(), "", &settings);
    body.confine_rows(study::study_parameters(), &settings);
    const TextNode* node = body.find("study");
    if (!node) return body.fault("study", "missing; give a study's file or object");
    std::string file = joined_path(roots.folders().front(), kBodyFile), text;
    if (is_string(*node) && !RequestBody::has_zero(node->text)) {
        auto confined = body.confine("study", node->text);
        if (!confined) return;
        file = request.study_file = std::move(*confined);
        auto read = read_text_file(file, StatusCode::usage);
        if (!read.ok()) return body.fault("study", read.status().message());
        text = std::move(*read);
    } else if (!node->is_map()) {
        return body.fault("study", node->describe() + " is not a study's file or object");
    }
    size_t refused = 0;
    const study::StudyPaths paths = paths_from(fs::path(file).parent_path(), roots, refused);
    study::StudyFile read = node->is_map()
                                ? study::read_study(*node, file, registry, paths, version)
                                : study::read_study(text, file, registry, paths, version);
    for (Diagnostic& one : read.diagnostics) {
        if (one.file == file && node->is_map()) one.file = kBodyFile;
        const bool is_refused = one.severity == Severity::error && refused > 0;
        if (is_refused) --refused;
        body.add(std::move(one), is_refused);
    }
    request.study = std::move(read.study);
    for (study::Scene& scene : request.study.scenes)
        scene.measured.run.source.layers.manifest_check = roots.resolver();
}

}  // namespace

io::Json job_schema(const ParameterTable& run_table) {
    return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
            {"title", "a job of the postchain service"},
            {"oneOf",
             {schema_of(RequestKind::run, {"input", "output"}, run_table),
              schema_of(RequestKind::ab, {"kind", "input", "output"}, run_table),
              schema_of(RequestKind::bench, {"kind", "input", "output"}, run_table),
              schema_of(RequestKind::study, {"kind", "study", "output"}, run_table)}}};
}

// ------------------------------------------------------------------------- jobs, plans, previews
JobReader::JobReader(const Roots& roots, const PassRegistry& registry, const std::string& version,
                     int threads)
    : roots_(roots),
      registry_(registry),
      version_(version),
      threads_(threads),
      table_(std::make_shared<const ParameterTable>(sequence::job_parameters(registry))) {}

JobReader JobReader::with(Roots roots) const {
    JobReader reader = *this;
    reader.roots_ = std::move(roots);
    return reader;
}

class RequestParser {
  public:
    RequestParser(const JobReader& reader, const std::string& text)
        : reader_(reader), roots_(reader.roots_), body_(text, reader.roots_) {}

    Answer<JobRequest> read(RequestKind asked) {
        if (!body_.faults().empty()) return body_.problem();
        kind_ = asked == RequestKind::run ? kind_of_job() : asked;
        std::vector<std::string> known;
        for (const auto& [key, schema] : body_keys(kind_, *reader_.table_)) known.push_back(key);
        for (const auto& [key, value] : body_.root().entries)
            if (std::ranges::find(known, key.text) == known.end())
                body_.fault(key, key.text, unknown_word("key", key.text, known));
        if (is_job()) request_.kind = JobKind(kind_);
        body_.integer("priority", -kMaxPriority, kMaxPriority, request_.priority);
        body_.integer("frame_timeout", 1, kMaxFrameTimeoutS, request_.frame_timeout_s);
        if (kind_ == RequestKind::study) {
            read_study(body_, roots_, reader_.registry_, reader_.version_, request_);
            return result();
        }
        ChainReader chains(body_, roots_, reader_.registry_);
        read_tables();
        chains.read("chain", request_.chain, request_.text);
        if (kind_ == RequestKind::ab) chains.read("chain_b", request_.chain_b, text_b_);
        if (kind_ == RequestKind::bench)
            request_.variants = chains.variants(request_.text, request_.measured.max_variants);
        if (kind_ == RequestKind::preview) read_preview();
        read_settings();
        if (kind_ == RequestKind::ab || kind_ == RequestKind::bench) read_limits();
        return result();
    }

  private:
    Answer<JobRequest> result() {
        if (has_errors(body_.faults())) return body_.problem();
        for (const Diagnostic& one : body_.faults())
            if (one.severity == Severity::warning)
                request_.warnings.push_back(roots_.shown_in(one.text()));
        return std::move(request_);
    }

    // -------------------------------------------------------------------------------- keys
    RequestKind kind_of_job() {
        const TextNode* node = body_.find("kind");
        if (!node) return RequestKind::run;
        std::vector<std::string> names;
        for (const JobKind kind : kJobKinds) {
            if (is_string(*node) && node->text == name_of(kind)) return RequestKind(kind);
            names.push_back(name_of(kind));
        }
        body_.fault("kind", unknown_word("kind", node->text, names));
        return RequestKind::run;
    }

    bool is_job() const { return kind_ != RequestKind::plan && kind_ != RequestKind::preview; }

    bool takes_layers() const { return kind_ == RequestKind::run || kind_ == RequestKind::plan; }

    void read_tables() {
        // By default a failed frame does not end a job of the service.
        job_.on_error = sequence::ErrorPolicy::keep_going;
        body_.read_rows(*reader_.table_, sequence::kInputGroup, &job_);
        body_.read_rows(*reader_.table_, sequence::kPlanGroup, &job_);
        if (takes_layers()) body_.read_rows(*reader_.table_, sequence::kLayerGroup, &job_);
        if (kind_ == RequestKind::run)
            body_.read_rows(*reader_.table_, sequence::kOutputGroup, &job_);
        if (kind_ == RequestKind::ab) {
            experiment::ExperimentSettings& measured = request_.measured;
            measured = {};
            body_.read_rows(experiment::ab_parameters(), "", &measured);
        }
        if (kind_ == RequestKind::bench)
            body_.read_rows(experiment::bench_parameters(), "", &request_.measured);
    }

    // ------------------------------------------------------------------------------ settings
    // Cuts the leading "--key: "; the diagnostic's path names the key.
    static std::string without_option(const std::string& key, const std::string& message) {
        const std::string option = sequence::option_name(key) + ": ";
        return message.starts_with(option) ? message.substr(option.size()) : message;
    }

    // Checks one string of the run's table alone, with defaults for all other rows.
    Status status_of_row(const Parameter& row) const {
        sequence::JobSettings alone;
        alone.input = "a.exr";
        const ParameterValue value = row.get(&job_);
        if (value == ParameterValue() || value == ParameterValue(std::string())) return Status();
        // A view is meaningful only with its display: checked with all settings.
        if (row.key.starts_with("ocio")) return Status();
        row.set(&alone, value);
        if (sequence::needs_ocio(alone)) alone.ocio = job_.ocio;
        Diagnostics notes;
        return sequence::parse_job(alone, reader_.registry_, notes).status();
    }

    // A camera file may name aperture images, which are read with it.
    bool confine_camera() {
        if (job_.camera.empty()) return true;
        auto camera = load_camera(job_.camera);
        if (!camera.ok() || !camera->status().ok()) return true;  // reported with the settings
        bool good = body_.confine_image("camera", camera->camera);
        for (auto& [number, frame] : camera->frames)
            good = body_.confine_image("camera", frame.camera) && good;
        return good;
    }

    void read_settings() {
        const size_t before = body_.faults().size();
        request_.input = job_.input;
        for (const Parameter& row : reader_.table_->rows())
            if (path_kind(row) == PathKind::file || path_kind(row) == PathKind::profile)
                body_.confine_file(row, &job_);
        if (kind_ == RequestKind::ab)
            body_.confine_rows(experiment::ab_parameters(),
                               static_cast<experiment::ExperimentSettings*>(&request_.measured));
        else
            body_.confine_rows(experiment::bench_parameters(), &request_.measured);
        if (!confine_camera() || body_.faults().size() > before) return;
        std::optional<io::InputSpec> input;
        if (!job_.input.empty()) input = body_.confine_input("input", job_.input);
        for (const Parameter& row : reader_.table_->rows())
            if (path_kind(row) != PathKind::input && path_kind(row) != PathKind::output &&
                row.type == ParameterType::text)
                if (Status status = status_of_row(row); !status.ok())
                    body_.fault(row.key, without_option(row.key, status.message()));
        std::optional<io::PathPattern> output = confine_pattern("output", job_.output);
        std::optional<io::PathPattern> behind = confine_pattern("behind", job_.behind);
        confine_truth(request_.measured);
        if (has_errors(body_.faults()) || !input) return;
        Diagnostics notes;
        auto settings = sequence::parse_job(job_, reader_.registry_, notes);
        if (!settings.ok()) return body_.fault("", settings.status().message());
        for (Diagnostic& note : notes) body_.add(std::move(note));
        settings->input = std::move(*input);
        if (behind) settings->input.patterns.emplace(Role::behind, std::move(*behind));
        if (output) settings->output = std::move(*output);
        settings->version = reader_.version_;
        settings->source.layers.manifest_check = roots_.resolver();
        request_.run = std::move(*settings);
        complete();
        request_.measured.chain_name = request_.chain.name;
    }

    std::optional<io::PathPattern> confine_pattern(const char* key, const std::string& text) {
        if (text.empty()) return std::nullopt;
        auto pattern = io::PathPattern::parse(text);
        if (!pattern.ok()) {
            body_.fault(key, pattern.status().message());
            return std::nullopt;
        }
        return body_.confine(key, *pattern);
    }

    void confine_truth(experiment::ExperimentSettings& settings) {
        if (settings.truth.empty()) return;
        auto truth = body_.confine_input("truth", settings.truth);
        if (!truth) return;
        if (truth->separate_files())
            return body_.fault("truth", "give one pattern, for color only");
        settings.truth_is = settings.truth;
        settings.truth = truth->color().text();
    }

    void complete() {
        experiment::RunContext context{request_.run, request_.input,  {request_.text.file_name}, {},
                                       {},           reader_.threads_};
        if (kind_ == RequestKind::ab) context.chain_files.push_back(text_b_.file_name);
        context.cameras = {request_.chain.chain.camera, request_.chain_b.chain.camera};
        for (const auto& variant : request_.variants)
            context.cameras.push_back(variant.chain.camera);
        context.command = {"postchain", "serve", name_of(request_.kind)};
        experiment::complete(request_.measured, std::move(context));
        request_.run = request_.measured.run;
    }

    void read_limits() {
        const auto kind = kind_ == RequestKind::ab ? report::Kind::ab : report::Kind::bench;
        const bool with_truth = kind_ == RequestKind::bench || !request_.measured.truth.empty();
        const auto limits = [&](const char* key, const std::vector<std::string>& texts) {
            auto found = experiment::limits_of(sequence::option_name(key), texts, kind, with_truth);
            if (found.ok()) return std::move(*found);
            body_.fault(key, without_option(key, found.status().message()));
            return std::vector<metrics::MetricLimit>();
        };
        request_.under = limits("under", body_.list("under"));
        request_.fail_above = limits("fail_above", body_.list("fail_above"));
    }

    void read_preview() {
        body_.integer("frame", -io::kMaxFrameNumber, io::kMaxFrameNumber, request_.frame);
        if (!body_.find("frame")) body_.fault("frame", "missing");
        if (const TextNode* plane = body_.find("plane")) {
            if (is_string(*plane) && plane->text == "depth")
                request_.plane = PreviewPlane::depth;
            else if (!is_string(*plane) || plane->text != "color")
                body_.fault("plane", unknown_word("plane", plane->text, {"color", "depth"}));
        }
        const TextNode* scale = body_.find("scale");
        if (!scale) return;
        const Result<double> value = number_of(*scale);
        if (!value.ok() || *value < kMinPreviewScale || *value > 1)
            return body_.fault("scale", concat(scale->describe(), " is not a number in ",
                                               kMinPreviewScale, "..1"));
        request_.scale = *value;
    }

    const JobReader& reader_;
    const Roots& roots_;
    RequestBody body_;
    RequestKind kind_ = RequestKind::run;
    sequence::JobSettings job_;
    JobRequest request_;
    ChainText text_b_;
};

namespace {

void limit(uint64_t& memory, uint64_t most) {
    if (most > 0 && (memory == 0 || memory > most)) memory = most;
}

Answer<JobRequest> read(const JobReader& reader, const std::string& body, RequestKind kind,
                        uint64_t max_memory = 0) {
    try {
        auto read = RequestParser(reader, body).read(kind);
        if (auto* request = std::get_if<JobRequest>(&read)) {
            limit(request->run.source.max_memory, max_memory);
            for (study::Scene& scene : request->study.scenes)
                limit(scene.measured.run.source.max_memory, max_memory);
        }
        return read;
    } catch (...) {
        const Status status = status_of_exception("the request");
        return Problem{Problem::Kind::internal, status.message()};
    }
}

}  // namespace

Answer<JobRequest> JobReader::job(const std::string& body) const {
    return read(*this, body, RequestKind::run, max_memory_);
}

Answer<JobRequest> JobReader::plan(const std::string& body) const {
    return read(*this, body, RequestKind::plan);
}

Answer<JobRequest> JobReader::preview(const std::string& body) const {
    return read(*this, body, RequestKind::preview, max_preview_memory_);
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
    if (const auto* problem = std::get_if<Problem>(&read)) {
        const Status status = status_of(problem->diagnostics);
        return Status(status.ok() ? StatusCode::usage : status.code(), problem->detail);
    }
    return ReadJob{std::move(reader), std::get<JobRequest>(std::move(read))};
}

}  // namespace postchain::service

#include "tools/service/work/job_request.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/settings/color_settings.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/body_keys.h"
#include "tools/service/work/measurement.h"
#include "tools/service/work/request_body.h"
#include "tools/service/work/service.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

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
        add_measurement_keys(JobKind::study, keys);
        return keys;
    }
    add_chain_keys("chain", keys);
    keys.emplace_back("set", strings_schema("KEY=VALUE, as --set"));
    add_row_keys(run_table, sequence::kInputGroup, keys);
    add_row_keys(run_table, sequence::kPlanGroup, keys);
    if (kind == RequestKind::run || kind == RequestKind::plan)
        add_row_keys(run_table, sequence::kLayerGroup, keys);
    if (kind == RequestKind::run) {
        add_row_keys(run_table, sequence::kOutputGroup, keys);
        // As read_tables() sets it.
        std::ranges::find(keys, "on_error", &BodyKeys::value_type::first)->second["default"] =
            "continue";
    }
    if (kind == RequestKind::ab || kind == RequestKind::bench)
        add_measurement_keys(JobKind(kind), keys);
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

}  // namespace

io::Json job_schema(const ParameterTable& run_table) {
    Json kinds = {schema_of(RequestKind::run, {"input", "output"}, run_table)};
    if (can_measure()) {
        kinds.push_back(schema_of(RequestKind::ab, {"kind", "input", "output"}, run_table));
        kinds.push_back(schema_of(RequestKind::bench, {"kind", "input", "output"}, run_table));
        kinds.push_back(schema_of(RequestKind::study, {"kind", "study", "output"}, run_table));
    }
    return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
            {"title", "a job of the postchain service"},
            {"oneOf", std::move(kinds)}};
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
        ChainReader chains(body_, roots_, reader_.registry_);
        const MeasurementText text{
            body_, roots_, reader_.registry_, reader_.version_, reader_.threads_, chains,
            text_, job_};
        if (kind_ == RequestKind::study) {
            request_.measurement = read_measurement(text, request_);
            return result();
        }
        read_tables();
        chains.read("chain", request_.chain, text_);
        if (kind_ == RequestKind::preview) read_preview();
        read_settings();
        if (kind_ == RequestKind::ab || kind_ == RequestKind::bench)
            request_.measurement = read_measurement(text, request_);
        else
            add_other_inputs();
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
            const bool named = is_string(*node) && node->text == name_of(kind);
            if (named && kind != JobKind::run && !can_measure()) {
                body_.fault("kind", node->text +
                                        " jobs need a service that was built with the lab "
                                        "(POSTCHAIN_LAB); this one filters alone");
                return RequestKind::run;
            }
            if (named) return RequestKind(kind);
            if (kind == JobKind::run || can_measure()) names.push_back(name_of(kind));
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
    }

    // ------------------------------------------------------------------------------ settings
    // Checks one string of the run's table alone, with defaults for all other rows.
    Status status_of_row(const Parameter& row) const {
        sequence::JobSettings alone;
        alone.input = "a.exr";
        const ParameterValue value = row.get(&job_);
        if (value == ParameterValue()) return Status();
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
        for (const Parameter& row : reader_.table_->rows())
            if (path_kind(row) == PathKind::file || path_kind(row) == PathKind::profile)
                body_.confine_file(row, &job_);
        if (!confine_camera() || body_.faults().size() > before) return;
        std::optional<io::InputSpec> input;
        if (!job_.input.empty()) input = body_.confine_input("input", job_.input);
        for (const Parameter& row : reader_.table_->rows())
            if (path_kind(row) != PathKind::input && path_kind(row) != PathKind::output &&
                row.type == ParameterType::text)
                if (Status status = status_of_row(row); !status.ok())
                    body_.fault(row.key, status.message());
        std::optional<io::PathPattern> output = confine_pattern("output", job_.output);
        std::optional<io::PathPattern> behind = confine_pattern("behind", job_.behind);
        if (has_errors(body_.faults())) return;
        Diagnostics notes;
        auto settings = sequence::parse_job(job_, reader_.registry_, notes);
        if (!settings.ok()) return body_.fault("", settings.status().message());
        for (Diagnostic& note : notes) body_.add(std::move(note));
        sequence::set_input(*settings, std::move(*input), std::move(behind));
        if (output) settings->output = std::move(*output);
        settings->version = reader_.version_;
        settings->source.layers.manifest_check = roots_.resolver();
        request_.run = std::move(*settings);
    }

    // Files that no output may replace.
    void add_other_inputs() {
        request_.run.other_inputs.push_back({text_.file_name, "the chain file"});
        for (auto& picture : io::inputs_of(request_.chain.chain.camera))
            request_.run.other_inputs.push_back(std::move(picture));
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
    ChainText text_;  // of the chain
};

namespace {

Answer<JobRequest> read(const JobReader& reader, const std::string& body, RequestKind kind,
                        uint64_t max_memory = 0) {
    try {
        auto read = RequestParser(reader, body).read(kind);
        if (auto* request = std::get_if<JobRequest>(&read)) {
            limit_memory(request->run.source.max_memory, max_memory);
            if (request->measurement) request->measurement->limit_memory(max_memory);
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

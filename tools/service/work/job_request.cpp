#include "tools/service/work/job_request.h"

#include <algorithm>
#include <optional>

#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/measure/experiment/assemble.h"
#include "tools/sequence/settings/color_settings.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/chain_request.h"
#include "tools/service/work/request_body.h"
#include "tools/service/work/study_request.h"

namespace postchain::service {

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
            if (std::find(known.begin(), known.end(), current_key(key.text)) == known.end())
                body_.fault(key, key.text, unknown_word("key", key.text, known));
        if (is_job()) request_.kind = JobKind(kind_);
        body_.integer("priority", -kMaxPriority, kMaxPriority, request_.priority);
        body_.integer("frame_timeout", 1, kMaxFrameTimeoutS, request_.frame_timeout_s);
        if (kind_ == RequestKind::study) {
            read_study(body_, roots_, reader_.registry_, reader_.version_, request_.study,
                       request_.study_settings);
            return result();
        }
        ChainReader chains(body_, roots_, reader_.registry_);
        read_tables();
        chains.read("chain", request_.chain, request_.text);
        if (kind_ == RequestKind::ab) chains.read("chain_b", request_.chain_b, text_b_);
        if (kind_ == RequestKind::bench)
            request_.variants = chains.variants(request_.text, request_.bench.max_variants);
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
    // Also for a former key.
    std::string current_key(const std::string& key) const {
        for (const ParameterTable* table :
             {reader_.table_.get(), &experiment::ab_parameters(), &experiment::bench_parameters()})
            if (const Parameter* row = table->find(key)) return row->key;
        return key;
    }

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
        if (kind_ == RequestKind::ab)
            body_.read_rows(experiment::ab_parameters(), "", &request_.ab);
        if (kind_ == RequestKind::bench)
            body_.read_rows(experiment::bench_parameters(), "", &request_.bench);
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
    bool hold_camera() {
        if (job_.camera.empty()) return true;
        auto camera = load_camera(job_.camera);
        if (!camera.ok() || !camera->status().ok()) return true;  // reported with the settings
        bool good = body_.hold_image("camera", camera->camera);
        for (auto& [number, frame] : camera->frames)
            good = body_.hold_image("camera", frame.camera) && good;
        return good;
    }

    void read_settings() {
        const size_t before = body_.faults().size();
        request_.input = job_.input;
        for (const Parameter& row : reader_.table_->rows())
            if (path_kind(row) == PathKind::file || path_kind(row) == PathKind::profile)
                body_.hold_file(row, &job_);
        body_.hold_rows(experiment::ab_parameters(), &request_.ab);
        body_.hold_rows(experiment::bench_parameters(), &request_.bench);
        if (!hold_camera() || body_.faults().size() > before) return;
        std::optional<io::InputSpec> input;
        if (!job_.input.empty()) input = body_.hold_input("input", job_.input);
        for (const Parameter& row : reader_.table_->rows())
            if (path_kind(row) != PathKind::input && path_kind(row) != PathKind::output &&
                row.type == ParameterType::text)
                if (Status status = status_of_row(row); !status.ok())
                    body_.fault(row.key, without_option(row.key, status.message()));
        std::optional<io::PathPattern> output = hold_pattern("output", job_.output);
        std::optional<io::PathPattern> behind = hold_pattern("behind", job_.behind);
        hold_truth(request_.ab);
        hold_truth(request_.bench);
        if (has_errors(body_.faults()) || !input) return;
        Diagnostics notes;
        auto settings = sequence::parse_job(job_, reader_.registry_, notes);
        if (!settings.ok()) return body_.fault("", settings.status().message());
        for (Diagnostic& note : notes) body_.add(std::move(note));
        settings->input = std::move(*input);
        if (behind) settings->input.patterns.emplace(Role::behind, std::move(*behind));
        if (output) settings->output = std::move(*output);
        settings->version = reader_.version_;
        settings->source.layers.hold = hold_of(roots_);
        request_.run = std::move(*settings);
        complete();
        request_.bench.chain_name = request_.chain.name;
    }

    std::optional<io::PathPattern> hold_pattern(const char* key, const std::string& text) {
        if (text.empty()) return std::nullopt;
        auto pattern = io::PathPattern::parse(text);
        if (!pattern.ok()) {
            body_.fault(key, pattern.status().message());
            return std::nullopt;
        }
        return body_.hold(key, *pattern);
    }

    void hold_truth(experiment::ExperimentSettings& settings) {
        if (settings.truth.empty()) return;
        auto truth = body_.hold_input("truth", settings.truth);
        if (!truth) return;
        if (truth->separate_files())
            return body_.fault("truth", "give one pattern, for color only");
        settings.truth_is = settings.truth;
        settings.truth = truth->color().text();
    }

    void complete() {
        experiment::Surroundings around{
            request_.run, request_.input, {request_.text.file_name}, {}, {}, reader_.threads_};
        if (kind_ == RequestKind::ab) around.chain_files.push_back(text_b_.file_name);
        around.cameras = {request_.chain.chain.camera, request_.chain_b.chain.camera};
        for (const auto& variant : request_.variants)
            around.cameras.push_back(variant.chain.camera);
        around.command = {"postchain", "serve", name_of(request_.kind)};
        experiment::complete(request_.ab, around);
        request_.run = request_.ab.run;
        experiment::complete(request_.bench, std::move(around));
    }

    void read_limits() {
        const auto kind = kind_ == RequestKind::ab ? report::Kind::ab : report::Kind::bench;
        const bool with_truth = kind_ == RequestKind::bench || !request_.ab.truth.empty();
        const auto limits = [&](const char* key, const std::vector<std::string>& texts) {
            auto found = experiment::limits_of(sequence::option_name(key), texts, kind, with_truth);
            if (found.ok()) return std::move(*found);
            body_.fault(key, without_option(key, found.status().message()));
            return std::vector<report::MetricLimit>();
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

Answer<JobRequest> read(const JobReader& reader, const std::string& body, RequestKind kind) {
    try {
        return RequestParser(reader, body).read(kind);
    } catch (...) {
        const Status status = status_of_exception("the request");
        return Problem{Problem::Kind::internal, status.message()};
    }
}

}  // namespace

Answer<JobRequest> JobReader::job(const std::string& body) const {
    return read(*this, body, RequestKind::run);
}

Answer<JobRequest> JobReader::plan(const std::string& body) const {
    return read(*this, body, RequestKind::plan);
}

Answer<JobRequest> JobReader::preview(const std::string& body) const {
    return read(*this, body, RequestKind::preview);
}

}  // namespace postchain::service

#include "tools/service/work/request_checks.h"

#include <algorithm>
#include <span>

#include "config/chain_file.h"
#include "config/reporter.h"
#include "tools/sequence/files/json.h"
#include "tools/service/work/browse.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {
namespace {

// Job::about of a job: long texts are cut. `frames`: those that it writes.
std::string about_of(const std::string& body, const Roots& roots, std::span<const int> frames) {
    constexpr size_t kLongest = 300;  // bytes
    const RequestBody text(body, roots);
    io::Json about = io::Json::object();
    for (const char* key : {"input", "output", "chain", "chain_b", "study"})
        if (const TextNode* node = text.find(key); node && is_string(*node))
            about[key] = node->text.substr(0, kLongest);
    if (!frames.empty()) about["frames"] = io::range_text(frames);
    return io::json_text(about);
}

}  // namespace

Answer<Submission> check_submission(const std::string& body, const JobReader& reader,
                                    const Programs& programs) {
    auto read = reader.job(body);
    if (auto* refused = std::get_if<Problem>(&read)) return std::move(*refused);
    const JobRequest& request = std::get<JobRequest>(read);
    auto checked = programs.check(body, request, reader.roots());
    if (auto* refused = std::get_if<Problem>(&checked)) return std::move(*refused);
    CheckedJob& found = std::get<CheckedJob>(checked);
    Submission submission;
    NewJob& job = submission.job;
    job.kind = JobKind(request.kind);
    job.body = body;
    job.priority = request.priority;
    job.frames = found.frames;
    job.writes = std::move(found.writes);
    submission.warnings = std::move(found.warnings);
    const bool is_run = request.kind == RequestKind::run;
    const bool fails = request.value("on_existing", is_run ? "fail" : "") == "fail";
    if (is_run ? fails : found.needs_new_folder) job.output = request.output;
    const auto refused = [](const JobFrame& frame) {
        return frame.state == FrameState::quarantined;
    };
    const auto first = std::ranges::find_if(found.of_run, refused);
    if (fails && first != found.of_run.end()) {
        RequestBody text(body, reader.roots());
        text.fault("on_existing",
                   concat(std::ranges::count_if(found.of_run, refused), " of ", found.frames,
                          " frames have outputs already; ", first->message));
        return text.problem();
    }
    for (const JobFrame& frame : found.of_run)
        if (frame.state == FrameState::waiting) submission.written.push_back(frame.frame);
    job.about = about_of(body, reader.roots(), submission.written);
    return submission;
}

std::optional<Problem> same_output(const std::string& body, const Submission& job, const Job& other,
                                   const Roots& roots) {
    const auto refuse = [&](const std::string& what) {
        RequestBody text(body, roots);
        text.fault("on_existing", concat("job ", other.id, " is going to write ", what,
                                         "; name another output, wait for it, or cancel it"));
        return text.problem();
    };
    if (job.job.kind != JobKind::run) return refuse("this report");
    const io::Json about = io::Json::parse(other.about, nullptr, false);
    if (!about.is_object() || !about.contains("frames")) return std::nullopt;
    const auto frames = io::FrameRange::parse(about.at("frames").get<std::string>());
    if (!frames.ok()) return std::nullopt;
    for (const int frame : frames->frames)
        if (std::ranges::binary_search(job.written, frame))
            return refuse(concat("frame ", frame, " to the same file"));
    return std::nullopt;
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

Answer<CheckedChain> check_chain_text(const std::string& body, const PassRegistry& registry) {
    TextTree tree = read_json_body(body);
    const TextNode* text = tree.root.find("text");
    if (!has_errors(tree.diagnostics) && !(text && is_string(*text)))
        Reporter(kBodyFile, StatusCode::usage, tree.diagnostics)
            .error(text ? *text : tree.root, "text", "missing, or not a chain file's text");
    if (has_errors(tree.diagnostics))
        return refusal(Problem::Kind::invalid, std::move(tree.diagnostics));
    return CheckedChain{parse_chain(text->text, "chain", registry).diagnostics,
                        chain_values(text->text)};
}

}  // namespace postchain::service

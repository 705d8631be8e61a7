#include "tools/service/work/request_checks.h"

#include <algorithm>
#include <filesystem>

#include "config/chain_file.h"
#include "config/reporter.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/plan_sequence.h"
#include "tools/sequence/run/run_files.h"
#include "tools/service/work/browse.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/measurement.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {
namespace {

constexpr int kMaxPlannedFrames = 100;  // per request

// A fault of a key, at its place in the body.
Problem fault_at(const std::string& body, const Roots& roots, const std::string& key,
                 const std::string& message) {
    RequestBody text(body, roots);
    text.fault(key, message);
    return text.problem();
}

// Errors (output): outputs exist.
Status check_existing(const std::vector<sequence::FrameTask>& tasks,
                      const sequence::RunSettings& run) {
    int existing = 0;
    std::string first;
    for (const sequence::FrameTask& task : tasks)
        for (const std::string& path : sequence::outputs_of(task, run)) {
            std::error_code error;
            if (task.files.empty() || !exists(std::filesystem::symlink_status(path, error)))
                continue;
            if (existing++ == 0) first = path;
            break;
        }
    if (existing == 0) return Status();
    return Status(StatusCode::output,
                  concat(existing, " of ", tasks.size(),
                         tasks.size() == 1 ? " output exists" : " outputs exist",
                         " already: ", first, existing > 1 ? " and others" : "",
                         "; set on_existing: overwrite or skip, or name another output"));
}

// Job::about of a body. Long texts are cut.
std::string about_of(const std::string& body, const Roots& roots) {
    constexpr size_t kLongest = 300;  // bytes
    const RequestBody text(body, roots);
    io::Json about = io::Json::object();
    for (const char* key : {"input", "output", "chain", "chain_b", "study"})
        if (const TextNode* node = text.find(key); node && is_string(*node))
            about[key] = node->text.substr(0, kLongest);
    return io::json_text(about);
}

}  // namespace

Answer<Submission> check_submission(const std::string& body, const JobReader& reader, bool remote) {
    auto read = reader.job(body);
    if (auto* refused = std::get_if<Problem>(&read)) return std::move(*refused);
    const JobRequest& job = std::get<JobRequest>(read);
    Submission submission{job.kind, job.priority, 0, job.warnings};
    submission.about = about_of(body, reader.roots());
    if (remote && job.measurement)
        if (const std::string fault = job.measurement->fault_of_queue(); !fault.empty())
            return fault_at(body, reader.roots(), name_of(job.kind), fault);
    if (remote && !job.run.dump_folder.empty())
        return fault_at(body, reader.roots(), "dump_stages",
                        "this service hands its jobs to another queue, whose tasks write no "
                        "stages; use `postchain run --dump-stages` or a service without --backend");
    const auto refuse = [&](const std::string& key, const Status& status) {
        return fault_at(body, reader.roots(), key, reader.roots().shown_in(status.message()));
    };
    if (job.measurement) {
        submission.frames = job.measurement->frames();
        submission.writes = job.measurement->report_folder();
        const auto needs_new = job.measurement->needs_new_folder();
        if (!needs_new.ok())
            return refuse(needs_new.status().code() == StatusCode::usage ? "output" : "on_existing",
                          needs_new.status());
        if (*needs_new) submission.output = job.measurement->report_folder();
        return submission;
    }
    const auto tasks = tasks_of(job.run);
    if (!tasks.ok()) {
        const bool of_output = tasks_of(job.run, false).ok();
        return refuse(of_output ? "output" : job.run.frames ? "frames" : "input", tasks.status());
    }
    submission.frames = int(tasks->size());
    std::error_code error;
    const std::string folder = job.run.output.folder();
    submission.writes = job.run.output.text();
    if (!job.run.dump_folder.empty()) submission.writes += "\n" + job.run.dump_folder;
    if (!job.run.make_folder && !std::filesystem::is_directory(folder, error))
        return refuse("output", Status(StatusCode::output,
                                       folder + ": folder does not exist; create it or use "
                                                "{mkdir=true}"_keyed));
    const io::OutputFiles files = sequence::files_of_run(job.chain.chain, job.run, *tasks);
    if (const Status status = files.check_names(); !status.ok()) return refuse("output", status);
    if (job.run.on_existing != io::OnExisting::fail) return submission;
    if (const Status status = check_existing(*tasks, job.run); !status.ok())
        return refuse("on_existing", status);
    submission.output = job.run.output.text();
    for (const sequence::FrameTask& task : *tasks) submission.written.push_back(task.frame);
    return submission;
}

std::optional<Problem> same_output(const std::string& body, const Submission& job, const Job& other,
                                   const JobReader& reader) {
    const auto refuse = [&](const std::string& what) {
        return fault_at(body, reader.roots(), "on_existing",
                        concat("job ", other.id, " is going to write ", what,
                               "; name another output, wait for it, or cancel it"));
    };
    if (job.kind != JobKind::run) return refuse("this report");
    auto read = reader.job(other.body);
    const JobRequest* request = std::get_if<JobRequest>(&read);
    if (!request) return std::nullopt;  // it fails when it starts
    const auto tasks = tasks_of(request->run);
    if (!tasks.ok()) return std::nullopt;
    for (const sequence::FrameTask& task : *tasks)
        if (std::ranges::find(job.written, task.frame) != job.written.end())
            return refuse(concat("frame ", task.frame, " to the same file"));
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

Answer<std::string> plan_of(const std::string& body, const JobReader& reader) {
    auto read = reader.plan(body);
    if (const auto* refused = std::get_if<Problem>(&read)) return *refused;
    JobRequest& request = std::get<JobRequest>(read);
    const Roots& roots = reader.roots();
    try {
        if (Status status = check_inputs(request.run.input, roots); !status.ok())
            return problem_of(status, roots);
        const int most = request.run.frames ? kMaxPlannedFrames : 1;
        io::Json frames = io::Json::array();
        const Status status = sequence::plan_sequence(
            request.chain.chain, request.run, [&](const sequence::PlanReport& planned) {
                io::Json frame = {{"frame", planned.frame}};
                if (planned.plan.ok())
                    frame["plan"] = sequence::planned_json(planned, std::nullopt);
                else
                    frame["error"] = roots.shown_in(planned.plan.status().message());
                frame["warnings"] = request.warnings;
                for (const std::string& warning : planned.warnings)
                    frame["warnings"].push_back(roots.shown_in(warning));
                frames.push_back(std::move(frame));
                return int(frames.size()) < most;
            });
        if (!status.ok()) return problem_of(status, roots);
        return io::json_text({{"frames", std::move(frames)}});
    } catch (...) {
        return problem_of(status_of_exception("the plan"), roots);
    }
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

#include "tools/service/lab/ab_bench.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "chain/base/printable.h"
#include "config/chain_file.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/service/lab/measurement.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/remote_backend.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using experiment::NamedChain;

// Keys of a body that are not options of the command, or that are given otherwise.
constexpr std::array kOtherKeys = {"kind",    "priority",   "frame_timeout", "chain",
                                   "chain_b", "chain_text", "chain_b_text",  "set",
                                   "output",  "on_existing"};

// Each key is the option of its name.
std::vector<std::string> options_of(const std::string& body, const Roots& roots) {
    const RequestBody text(body, roots);
    std::vector<std::string> words;
    for (const auto& [key, value] : text.root().entries) {
        if (std::ranges::find(kOtherKeys, key.text) != kOtherKeys.end()) continue;
        const std::string option = option_name(key.text);
        if (value.is_list()) {
            for (const TextNode& item : value.items) words.push_back(option + "=" + item.text);
        } else if (!is_string(value) && (value.text == "true" || value.text == "false")) {
            words.push_back(value.text == "true" ? option : "--no-" + option.substr(2));
        } else {
            words.push_back(option + "=" + value.text);
        }
    }
    return words;
}

// A chain as a file of its name, which the report shows.
Result<std::string> chain_file(const experiment::NamedChain& chain, const std::string& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    const std::string path = folder + "/" + fs::path(chain.name).filename().string() + ".yaml";
    RETURN_IF_ERROR(write_task_file(path, write_chain(chain.chain)));
    return path;
}

// The last "3/12, frame 7, paper, 0:10 elapsed" of a task's messages, which
// progress_printer() of the command logs.
std::optional<TaskProgress> logged_progress(const std::string& path) {
    constexpr std::streamoff kMost = 4096;  // bytes
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file ? std::streamoff(file.tellg()) : 0;
    file.seekg(std::max<std::streamoff>(0, size - kMost));
    std::optional<TaskProgress> last;
    std::string line;
    if (size > kMost) std::getline(file, line);  // a part of one
    while (std::getline(file, line) && !file.eof()) {
        TaskProgress found;
        int at = 0;
        if (std::sscanf(line.c_str(), "%zu/%zu, %n", &found.done, &found.total, &at) != 2 ||
            at == 0)
            continue;
        const size_t end = line.rfind(", ", line.rfind(" elapsed"));
        if (end == std::string::npos || end < size_t(at)) continue;
        found.what = printable(line.substr(size_t(at), end - size_t(at)));
        last = std::move(found);
    }
    return last;
}

// The functions below read a report.json, which its user may have rewritten: any value may be of
// any type.

// A member of an object; null if there is none.
const io::Json& member(const io::Json& json, const char* key) {
    static const io::Json null;
    const auto found = json.is_object() ? json.find(key) : json.end();
    return found == json.end() ? null : *found;
}

// Whether every variant failed.
bool has_failed(const io::Json& json) {
    const io::Json& variants = member(json, "variants");
    return variants.is_array() && !variants.empty() &&
           std::ranges::all_of(
               variants, [](const io::Json& one) { return member(one, "failure").is_string(); });
}

std::string in_pareto_set(size_t variants, std::ptrdiff_t best) {
    return concat(variants, variants == 1 ? " variant, " : " variants, ", best,
                  " in the Pareto set");
}

std::string verdict_of(const io::Json& json) {
    if (const io::Json& said = member(member(json, "comparison"), "verdict"); said.is_string())
        return said.get<std::string>();
    const io::Json& variants = member(json, "variants");
    if (!variants.is_array() || variants.empty()) return "";
    const auto best = std::ranges::count_if(
        variants, [](const io::Json& one) { return member(one, "pareto") == true; });
    std::string verdict = in_pareto_set(variants.size(), best);
    if (const io::Json& under = member(json, "under"); under.is_array())
        for (const io::Json& line : under)
            if (line.is_string()) verdict += "; " + line.get<std::string>();
    return verdict;
}

}  // namespace

// ------------------------------------------------------------------------------------- reading
AbOrBench::AbOrBench(const MeasurementText& text, JobRequest& request)
    : is_ab_(request.kind == JobKind::ab) {
    RequestBody& body = text.body;
    auto& as_ab = static_cast<experiment::ExperimentSettings&>(measured_);
    if (is_ab_) {
        as_ab = {};
        body.read_rows(experiment::ab_parameters(), "", &as_ab);
        service::NamedChain chain_b;
        text.chains.read("chain_b", chain_b, text_b_);
        chain_b_ = {std::move(chain_b.name), std::move(chain_b.chain), {}};
        body.confine_rows(experiment::ab_parameters(), &as_ab);
    } else {
        body.read_rows(experiment::bench_parameters(), "", &measured_);
        read_variants(text);
        body.confine_rows(experiment::bench_parameters(), &measured_);
    }
    confine_truth(body);
    read_limits(body);
    if (!has_errors(body.faults())) complete(text, request);
}

void AbOrBench::read_variants(const MeasurementText& text) {
    std::vector<experiment::Sweep> sweeps;
    for (const std::string& one : text.body.list("sweep")) {
        auto sweep = experiment::parse_sweep(one);
        if (!sweep.ok()) {
            text.body.fault("sweep", sweep.status().message());
            continue;
        }
        if (sweep->key == "camera.aperture_image")
            for (std::string& value : sweep->values)
                if (auto confined = text.body.confine("sweep", value)) value = std::move(*confined);
        sweeps.push_back(std::move(*sweep));
    }
    if (has_errors(text.body.faults())) return;
    auto variants = experiment::sweep_variants(text.chain, text.registry, text.chains.sets(),
                                               sweeps, measured_.max_variants);
    if (variants.ok())
        variants_ = std::move(*variants);
    else
        text.body.fault("sweep", variants.status().message());
}

void AbOrBench::confine_truth(RequestBody& body) {
    if (measured_.truth.empty()) return;
    auto truth = body.confine_input("truth", measured_.truth);
    if (!truth) return;
    if (truth->separate_files()) return body.fault("truth", "give one pattern, for color only");
    measured_.truth_is = measured_.truth;
    measured_.truth = truth->color().text();
}

void AbOrBench::read_limits(RequestBody& body) {
    const auto kind = is_ab_ ? report::Kind::ab : report::Kind::bench;
    const bool with_truth = !is_ab_ || !measured_.truth.empty();
    const auto limits = [&](const char* key, const std::vector<std::string>& texts) {
        auto found = experiment::limits_of(key, texts, kind, with_truth);
        if (found.ok()) return std::move(*found);
        body.fault(key, found.status().message());
        return std::vector<metrics::MetricLimit>();
    };
    under_ = limits("under", body.list("under"));
    fail_above_ = limits("fail_above", body.list("fail_above"));
}

void AbOrBench::complete(const MeasurementText& text, JobRequest& request) {
    chain_ = {request.chain.name, std::move(request.chain.chain), {}};
    experiment::RunContext context{request.run, text.job.input, {text.chain.file_name}, {},
                                   {},          text.threads};
    if (is_ab_) context.chain_files.push_back(text_b_.file_name);
    context.cameras = {chain_.chain.camera, chain_b_.chain.camera};
    for (const auto& variant : variants_) context.cameras.push_back(variant.chain.camera);
    context.command = {"postchain", "serve", name_of(request.kind)};
    experiment::complete(measured_, std::move(context));
    measured_.chain_name = chain_.name;
    request.run = measured_.run;
}

Result<bool> AbOrBench::needs_new_folder() const {
    RETURN_IF_ERROR(experiment::check_folder(measured_));
    return measured_.on_existing == io::OnExisting::fail;
}

// ------------------------------------------------------------------------------ on this machine
WorkEnd AbOrBench::work(const Job& job, const WorkContext& context) {
    MeasurementRun run(job, context);
    return run.end(measured(run, context));
}

// ab replaces the files of an earlier start, bench resumes from them.
Result<WorkEnd> AbOrBench::measured(MeasurementRun& run, const WorkContext& context) {
    RETURN_IF_ERROR(check_paths(measured_, context.reader.roots()));
    if (context.lost) return MeasurementRun::stopped();
    const auto begun = context.store.has_begun(run.id());
    if (!begun.ok()) return MeasurementRun::store_failed(begun.status());
    const auto later = is_ab_ ? io::OnExisting::overwrite : io::OnExisting::skip;
    measured_.renderer = context.gl.renderer();
    measured_.software = context.gl.software();
    if (*begun) measured_.on_existing = later;
    ASSIGN_OR_RETURN(const auto files, experiment::prepare_folder(measured_));
    if (Status status = context.store.began(run.id()); !status.ok())
        return MeasurementRun::store_failed(status);
    measured_.on_existing = later;
    bool met = true;
    context.progress.does("the first measurement did not end");
    auto report = is_ab_ ? experiment::run_ab(chain_, chain_b_, measured_, context.gl.executor(),
                                              run.progress(), &context.stop)
                         : bench(run, context, files, met);
    if (context.lost) return MeasurementRun::stopped();
    context.progress.does("the report was not written");
    RETURN_IF_ERROR(report.status());
    if (context.stop) return MeasurementRun::stopped();
    RETURN_IF_ERROR(experiment::write_report_files(*report, measured_.assets));
    return end_of(*report, met);
}

Result<report::Report> AbOrBench::bench(MeasurementRun& run, const WorkContext& context,
                                        const io::OutputFiles& files, bool& met) {
    const Status found = experiment::find_truth(
        measured_, files, context.device, [&](const std::string& what) { return run.say(what); });
    RETURN_IF_ERROR(context.gl.make_current());
    if (!found.ok()) return found;
    auto report = experiment::run_bench(variants_, measured_, files, context.gl.executor(),
                                        run.progress(), &context.stop);
    if (!report.ok()) return report;
    ASSIGN_OR_RETURN(met, experiment::choose_under(*report, under_));
    return report;
}

WorkEnd AbOrBench::end_of(const report::Report& report, bool met) const {
    WorkEnd end;
    std::vector<std::string> lines;
    end.exit_code = experiment::exit_code_of(report, fail_above_, met, lines);
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) lines.push_back(variant.name + ": " + variant.failure);
    for (const std::string& line : lines) end.say(line);
    // Every chain missed frames, as a run does whose frames are quarantined.
    if (std::ranges::none_of(report.variants, &std::string::empty, &report::Variant::failure))
        end.state = JobState::failed;
    if (report.comparison) {
        end.verdict = report.comparison->verdict;
    } else {
        const auto best = std::ranges::count(report.variants, true, &report::Variant::pareto);
        end.verdict = in_pareto_set(report.variants.size(), best);
        for (const std::string& line : report.under) end.verdict += "; " + line;
    }
    std::ranges::replace(end.verdict, '\n', ' ');
    return end;
}

// -------------------------------------------------------------------------------- in another queue
Status AbOrBench::begin(const Roots& roots) {
    RETURN_IF_ERROR(check_paths(measured_, roots));
    return experiment::prepare_folder(measured_).status();
}

std::optional<TaskProgress> AbOrBench::progress(const std::string& folder) const {
    return logged_progress(folder + "/1.log");
}

Result<TaskCommand> AbOrBench::tasks(const Job& job, const RemoteSettings& settings,
                                     const Roots& roots, const std::string& folder) {
    TaskCommand tasks;
    tasks.command = {settings.program, name_of(job.kind)};
    ASSIGN_OR_RETURN(auto a, chain_file(chain_, folder + "/a"));
    tasks.command.push_back(std::move(a));
    if (is_ab_) {
        ASSIGN_OR_RETURN(auto b, chain_file(chain_b_, folder + "/b"));
        tasks.command.push_back(std::move(b));
    }
    for (std::string& word : options_of(job.body, roots)) tasks.command.push_back(std::move(word));
    tasks.command.push_back("--output=" + measured_.folder);
    // The folder was checked before the first task, which may run again.
    tasks.command.push_back(is_ab_ ? "--on-existing=overwrite" : "--on-existing=skip");
    tasks.command.push_back("--device=" + settings.device);
    tasks.words.emplace_back();
    return tasks;
}

std::optional<WorkEnd> AbOrBench::end(const Job& job, int exit_code, const Roots&) const {
    const auto json = report_of(measured_.folder, job);
    if (!json) return std::nullopt;
    WorkEnd end;
    end.exit_code = exit_code;
    if (has_failed(*json)) end.state = JobState::failed;
    end.verdict = verdict_of(*json);
    std::ranges::replace(end.verdict, '\n', ' ');
    return end;
}

}  // namespace postchain::service

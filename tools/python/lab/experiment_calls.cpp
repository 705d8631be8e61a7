#include "tools/python/lab/experiment_calls.h"

#include <filesystem>
#include <map>

#include "config/chain_file.h"
#include "config/chain_find.h"
#include "config/text_tree.h"
#include "passes/registry.h"
#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/experiment/run_experiment.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/study/study_reader.h"
#include "tools/measure/study/study_report.h"
#include "tools/measure/study/work.h"
#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/values.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

std::set<std::string> keys_of(const ParameterTable& table) {
    std::set<std::string> keys;
    for (const Parameter& row : table.rows()) keys.insert(row.key);
    for (const char* argument : {"output", "truth"}) keys.erase(argument);
    return keys;
}

// A name for the report, as that of a chain file.
std::string report_name(const ChainObject& chain) {
    return std::filesystem::path(chain.name).stem().string();
}

// Settings of a measurement: its rows among `values`, then those of its input.
template <class Settings>
Settings settings_of(const char* function, const ParameterTable& table,
                     const std::set<std::string>& keys, const std::string& output,
                     const py::object& truth, py::kwargs& values) {
    Settings settings;
    std::set<std::string> all = keys;
    all.insert(experiment_input_keys().begin(), experiment_input_keys().end());
    check_keys(function, values, all);
    py::kwargs rows = taken(values, keys);
    rows["output"] = output;
    if (!truth.is_none()) rows["truth"] = path_of(truth, "truth");
    set_rows(table, &settings, rows, function);
    return settings;
}

void complete(const char* function, experiment::ExperimentSettings& settings,
              const std::string& input, const py::object& camera, const py::kwargs& values,
              std::vector<std::string> chains, std::vector<Camera> cameras, const Device& device) {
    experiment::complete(settings, {.run = job_settings(function, input, "", camera, values,
                                                        experiment_input_keys()),
                                    .input = input,
                                    .chain_files = std::move(chains),
                                    .cameras = std::move(cameras),
                                    .command = {},
                                    .threads = cpu_threads()});
    settings.renderer = device.renderer();
    settings.software = device.is_software();
}

py::dict written(const report::Report& report, const std::string& assets) {
    if (const Status status = experiment::write_report_files(report, assets); !status.ok())
        raise(status);
    std::vector<std::string> warnings = report.warnings;
    warnings.insert(warnings.end(), report.notes.begin(), report.notes.end());
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) warnings.push_back(variant.name + ": " + variant.failure);
    warn(warnings);
    py::dict dict = python_of(report::report_json(report));
    dict["page"] = experiment::page_path(report);
    return dict;
}

// {"motion_blur.samples": [5, 9]} as --sweep.
std::vector<experiment::Sweep> sweeps_of(const py::object& sweeps) {
    std::vector<experiment::Sweep> all;
    if (sweeps.is_none()) return all;
    if (!py::isinstance<py::dict>(sweeps))
        raise_usage("sweep: is a ", type_of(sweeps), "; give a dict of keys and lists of values");
    for (const auto& [key, values] : py::reinterpret_borrow<py::dict>(sweeps)) {
        std::string text = std::string(py::str(key)) + "=", comma;
        for (const py::handle value : values) {
            text += comma + (py::isinstance<py::str>(value) ? std::string(py::str(value))
                                                            : json_text_of(value));
            comma = ",";
        }
        all.push_back(value_of(experiment::parse_sweep(text)));
    }
    return all;
}

std::vector<metrics::MetricLimit> limits_of(const py::object& under) {
    std::vector<std::string> texts;
    if (!under.is_none())
        for (const auto& [metric, limit] :
             argument_of<std::map<std::string, double>>(under, "under", "a dict of numbers"))
            texts.push_back(concat(metric, "=", text_of(limit)));
    return value_of(experiment::limits_of("under", texts, report::Kind::bench, true));
}

}  // namespace

experiment::ProgressCallback progress_of(const Callbacks& callbacks, Call& call, bool& stopped) {
    return [&](const experiment::ExperimentProgress& now) {
        if (callbacks.progress.is_none()) return;
        call.send([&, now] {
            py::dict report;
            report["what"] = now.what;
            report["done"] = now.done;
            report["total"] = now.total;
            report["elapsed_s"] = now.elapsed_s;
            if (stopped || !callbacks.ended_by(report)) return;
            stopped = true;
            call.ask_to_stop();
        });
    };
}

const std::set<std::string>& ab_keys() {
    static const std::set<std::string> keys = keys_of(experiment::ab_parameters());
    return keys;
}

const std::set<std::string>& bench_keys() {
    static const std::set<std::string> keys = keys_of(experiment::bench_parameters());
    return keys;
}

const std::set<std::string>& experiment_input_keys() {
    static const std::set<std::string> keys = [] {
        std::set<std::string> all = inspect_keys();
        all.insert(plan_keys().begin(), plan_keys().end());
        return all;
    }();
    return keys;
}

py::dict ab(const py::object& a, const py::object& b, const std::string& input,
            const std::string& output, const py::object& camera, const py::object& truth,
            const py::object& set, const Callbacks& callbacks,
            const std::shared_ptr<Device>& device, py::kwargs values) {
    callbacks.check();
    const ChainPtr first = chain_of(a, set), second = chain_of(b, set);
    auto settings = settings_of<experiment::ExperimentSettings>("ab", experiment::ab_parameters(),
                                                                ab_keys(), output, truth, values);
    complete("ab", settings, input, camera, values, {first->name, second->name},
             {first->chain.camera, second->chain.camera}, *device);
    bool stopped = false;
    auto report = device->run(
        "ab",
        [&](Call& call, Executor& executor) {
            return experiment::run_ab({report_name(*first), first->chain.clone(), {}},
                                      {report_name(*second), second->chain.clone(), {}}, settings,
                                      executor, progress_of(callbacks, call, stopped),
                                      &call.stop());
        },
        callbacks.watch(stopped));
    return written(value_unless_stopped(std::move(report), stopped), settings.assets);
}

py::dict bench(const py::object& chain, const std::string& input, const std::string& output,
               const py::object& camera, const py::object& truth, const py::object& sweeps,
               const py::object& under, const py::object& set, const Callbacks& callbacks,
               const std::shared_ptr<Device>& device, py::kwargs values) {
    callbacks.check();
    const ChainPtr made = chain_of(chain, set);
    auto settings = settings_of<experiment::BenchSettings>("bench", experiment::bench_parameters(),
                                                           bench_keys(), output, truth, values);
    const auto limits = limits_of(under);
    const ChainText text{made->name, write_chain(made->chain), !made->is_file};
    const auto variants = value_of(experiment::sweep_variants(
        text, builtin_passes(), {}, sweeps_of(sweeps), settings.max_variants));
    std::vector<Camera> cameras;
    for (const auto& variant : variants) cameras.push_back(variant.chain.camera);
    complete("bench", settings, input, camera, values, {made->name}, std::move(cameras), *device);
    settings.chain_name = report_name(*made);
    const auto files = value_of(experiment::prepare_folder(settings));
    bool stopped = false;
    auto report = device->run(
        "bench",
        [&](Call& call, Executor& executor) -> Result<report::Report> {
            const Status found =
                experiment::find_truth(settings, files, device->options(),
                                       [&](const std::string&) { return !call.stop(); });
            RETURN_IF_ERROR(device->make_current());
            RETURN_IF_ERROR(found);
            return experiment::run_bench(variants, settings, files, executor,
                                         progress_of(callbacks, call, stopped), &call.stop());
        },
        callbacks.watch(stopped));
    report::Report found = value_unless_stopped(std::move(report), stopped);
    const bool met = value_of(experiment::choose_under(found, limits));
    py::dict dict = written(found, settings.assets);
    dict["met"] = met;
    return dict;
}

py::dict study(const std::string& file, const std::string& output, const std::string& chunk,
               const py::object& on_existing, const Callbacks& callbacks,
               const std::shared_ptr<Device>& device) {
    callbacks.check();
    io::Chunk part;
    if (!chunk.empty()) part = value_of(io::Chunk::parse(chunk).at("chunk"));
    const std::string text = value_of(read_text_file(file, StatusCode::usage));
    const study::StudyFile read = study::read_study(text, file, builtin_passes(),
                                                    study::paths_beside(file), POSTCHAIN_VERSION);
    if (const Status status = read.status(); !status.ok()) raise(status, read.diagnostics);
    warn(warnings_of(read.diagnostics));
    const auto folder = value_of(
        study::StudyFolder::open(read.study, output, on_existing_of(on_existing, "study")));
    bool stopped = false;
    auto done = device->run(
        "study",
        [&](Call& call, Executor& executor) -> Result<study::WorkDone> {
            const study::Machine machine{executor,
                                         device->renderer(),
                                         device->is_software(),
                                         [&] { return device->make_current(); },
                                         device->options(),
                                         cpu_threads(),
                                         {}};
            auto worked = study::work_on_tasks(read.study, folder, part, machine,
                                               progress_of(callbacks, call, stopped), &call.stop());
            RETURN_IF_ERROR(device->make_current());
            return worked;
        },
        callbacks.watch(stopped));
    const study::WorkDone work = value_unless_stopped(std::move(done), stopped);
    if (!work.complete()) {
        py::dict dict;
        dict["results"] = work.results;
        dict["tasks"] = work.tasks;
        return dict;
    }
    const auto report = value_of(study::read_report(read.study, folder));
    if (const Status status = study::write_report(report, folder); !status.ok()) raise(status);
    std::vector<std::string> failures;
    for (const auto& scene : report.scenes)
        if (!scene.failure.empty())
            failures.push_back("scene " + scene.name + ": " + scene.failure);
    warn(failures);
    py::dict dict = python_of(study::report_json(report));
    dict["page"] = folder.path() + "/index.html";
    return dict;
}

}  // namespace postchain::python

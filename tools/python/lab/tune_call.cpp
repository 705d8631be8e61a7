#include "tools/python/lab/tune_call.h"

#include "chain/base/text.h"
#include "tools/measure/tune/tune.h"
#include "tools/measure/tune/tune_text.h"
#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/lab/experiment_calls.h"
#include "tools/python/values.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

py::list chains_of(const TuneRequest& request) {
    py::list chains;
    if (request.chains.is_none()) {
        for (const auto& name : tune::default_starts(!request.truth.is_none())) chains.append(name);
    } else if (py::isinstance<py::list>(request.chains) ||
               py::isinstance<py::tuple>(request.chains)) {
        for (const py::handle one : request.chains) chains.append(one);
        if (py::len(chains) == 0)
            raise_usage("chains: is empty; give a chain, or leave it out for the shipped ones");
    } else {
        chains.append(request.chains);
    }
    return chains;
}

tune::TuneSettings settings_of(const TuneRequest& request, const py::kwargs& rows) {
    tune::TuneSettings settings;
    set_rows(tune::tune_parameters(), &settings, rows, "tune");
    if (!request.truth.is_none()) settings.truth = path_of(request.truth, "truth");
    py::kwargs goal;
    goal["error"] = request.error;
    // A number's text is a form of the budget.
    goal["budget"] = py::hasattr(request.budget, "__float__")
                         ? py::object(py::str(py::float_(request.budget)))
                         : request.budget;
    set_rows(tune::tune_parameters(), &settings, goal, "tune");
    return settings;
}

py::dict dict_of(const tune::Tuning& tuning) {
    py::dict dict = python_of(tune::tuning_json(tuning));
    py::list points = dict["points"];
    for (size_t i = 0; i < tuning.search.candidates.size(); ++i) {
        const tune::Candidate& candidate = tuning.search.candidates[i];
        py::dict point = points[i];
        point["knobs"] = point["chain"];
        auto chain = std::make_shared<ChainObject>(ChainObject{
            candidate.chain.clone(), candidate.name.empty() ? "tune" : candidate.name, false});
        point["chain"] = py::cast(std::move(chain));
    }
    py::list front;
    for (const size_t i : tuning.search.front()) front.append(points[i]);
    dict["front"] = front;
    dict["chain"] = py::none();
    dict["text"] = py::none();
    if (tuning.chosen()) {
        dict["chain"] = points[*tuning.search.chosen]["chain"];
        dict["text"] = tune::tuned_chain_file(tuning);
    }
    return dict;
}

}  // namespace

const std::set<std::string>& tune_keys() {
    static const std::set<std::string> keys = [] {
        std::set<std::string> all;
        for (const Parameter& row : tune::tune_parameters().rows()) all.insert(row.key);
        for (const char* argument : {"output", "on_existing", "truth", "budget", "error"})
            all.erase(argument);
        return all;
    }();
    return keys;
}

const std::set<std::string>& tune_input_keys() {
    static const std::set<std::string> keys = [] {
        std::set<std::string> all;
        for (const Parameter& row : job_parameters().rows())
            if (row.group == sequence::kInputGroup || row.group == sequence::kPlanGroup)
                all.insert(row.key);
        for (const char* argument : {"input", "camera"}) all.erase(argument);
        return all;
    }();
    return keys;
}

py::dict tune(const TuneRequest& request, const Callbacks& callbacks,
              const std::shared_ptr<Device>& device, py::kwargs values) {
    callbacks.check();
    std::set<std::string> keys = tune_keys();
    keys.insert(tune_input_keys().begin(), tune_input_keys().end());
    check_keys("tune", values, keys);
    tune::TuneSettings settings = settings_of(request, taken(values, tune_keys()));
    if (const auto goal = tune::goal_of(settings); !goal.ok()) raise(goal.status());
    std::vector<tune::Start> starts;
    std::vector<std::string> fixed;
    std::vector<Camera> cameras;
    for (const py::handle one : chains_of(request)) {
        const ChainPtr chain = chain_of(py::reinterpret_borrow<py::object>(one), request.set);
        for (auto& knob : tune::fixed_knobs(chain->chain, overrides_of(request.set)))
            fixed.push_back(std::move(knob));
        cameras.push_back(chain->chain.camera);
        starts.push_back({chain->name, chain->chain.clone()});
    }
    experiment::complete(settings, {.run = job_settings("tune", request.input, "", request.camera,
                                                        values, tune_input_keys()),
                                    .input = request.input,
                                    .chain_files = {},
                                    .cameras = std::move(cameras),
                                    .command = {},
                                    .threads = cpu_threads()});
    settings.renderer = device->renderer();
    settings.software = device->is_software();
    bool stopped = false;
    auto tuning = device->run(
        "tune",
        [&](Call& call, Executor& executor) {
            return tune::run_tune(std::move(starts), fixed, settings, executor,
                                  progress_of(callbacks, call, stopped), &call.stop());
        },
        callbacks.watch(stopped));
    if (!tuning.ok()) raise(tuning.status());
    // Asked after the last look at stop().
    if (stopped || tuning->search.stopped) raise(Status(StatusCode::canceled, "stopped"));
    std::vector<std::string> warnings = tune::doubts_of(*tuning);
    if (!tuning->chosen()) warnings.push_back(tune::outcome_text(*tuning));
    warn(warnings);
    return dict_of(*tuning);
}

}  // namespace postchain::python

#include "tools/python/lab_calls.h"

#include <pybind11/stl.h>

#include "config/schema.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/tune/tune.h"
#include "tools/python/documentation.h"
#include "tools/python/job.h"
#include "tools/python/lab/experiment_calls.h"
#include "tools/python/lab/tune_call.h"
#include "tools/python/values.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

void add_experiments(py::module_& module) {
    const std::string common =
        "input: \"A.####.exr\"\noutput: folder of the report\ncamera: a dict or a camera file\n"
        "truth: ground truth \"both.####.exr\"\n";
    const std::string ends =
        "set: values of the chains, as for Chain()\nprogress: called with a dict (what, done, "
        "total, elapsed_s); returns False to end\nstop: a threading.Event that ends it\n"
        "device: a Device\n\nFurther arguments:";
    const std::string ab_text =
        "Compares two chains on a sequence, as `postchain ab`: writes the report, and returns its "
        "report.json\nas a dict, with \"page\", the path of index.html.\n\n"
        "a, b: chains, or what Chain() takes\n" +
        common + ends + rows_text(experiment::ab_parameters(), ab_keys()) +
        rows_text(job_parameters(), experiment_input_keys());
    module.def(
        "ab",
        [](const py::object& a, const py::object& b, const py::object& input,
           const py::object& output, const py::object& camera, const py::object& truth,
           const py::object& set, const py::object& progress, const py::object& stop,
           const py::object& device, const py::kwargs& settings) {
            return ab(a, b, path_of(input, "input"), path_of(output, "output"), camera, truth, set,
                      {progress, stop}, device_of(device), settings);
        },
        py::arg("a"), py::arg("b"), py::arg("input"), py::arg("output"),
        py::arg("camera") = py::none(), py::kw_only(), py::arg("truth") = py::none(),
        py::arg("set") = py::none(), py::arg("progress") = py::none(), py::arg("stop") = py::none(),
        py::arg("device") = py::none(), ab_text.c_str());
    const std::string bench_text =
        "Measures error and time of a chain, or of each variant of a sweep, as `postchain bench`: "
        "writes the\nreport, and returns its report.json as a dict, with \"page\" and \"met\", "
        "whether `under` is met.\n\nchain: a Chain, or what Chain() takes\n" +
        common +
        "sweep: values to try, all combinations: {\"motion_blur.samples\": [5, 9, 13]}\n"
        "under: picks the cheapest variant within limits: {\"flip\": 0.1}\n" +
        ends + rows_text(experiment::bench_parameters(), bench_keys()) +
        rows_text(job_parameters(), experiment_input_keys());
    module.def(
        "bench",
        [](const py::object& chain, const py::object& input, const py::object& output,
           const py::object& camera, const py::object& truth, const py::object& sweep,
           const py::object& under, const py::object& set, const py::object& progress,
           const py::object& stop, const py::object& device, const py::kwargs& settings) {
            return bench(chain, path_of(input, "input"), path_of(output, "output"), camera, truth,
                         sweep, under, set, {progress, stop}, device_of(device), settings);
        },
        py::arg("chain"), py::arg("input"), py::arg("output"), py::arg("camera") = py::none(),
        py::kw_only(), py::arg("truth") = py::none(), py::arg("sweep") = py::none(),
        py::arg("under") = py::none(), py::arg("set") = py::none(),
        py::arg("progress") = py::none(), py::arg("stop") = py::none(),
        py::arg("device") = py::none(), bench_text.c_str());
    module.def(
        "study",
        [](const py::object& file, const py::object& output, const py::object& chunk,
           const py::object& on_existing, const py::object& progress, const py::object& stop,
           const py::object& device) {
            return study(path_of(file, "file"), path_of(output, "output"),
                         chunk.is_none() ? "" : argument_of<std::string>(chunk, "chunk", "\"2/4\""),
                         on_existing, {progress, stop}, device_of(device));
        },
        py::arg("file"), py::arg("output"), py::kw_only(), py::arg("chunk") = py::none(),
        py::arg("on_existing") = "skip", py::arg("progress") = py::none(),
        py::arg("stop") = py::none(), py::arg("device") = py::none(),
        "ab or bench over several scenes, as `postchain study`: writes the report, and returns its "
        "report.json\nas a dict, with \"page\". While other processes still work on tasks: "
        "{\"results\", \"tasks\"}.\n\n"
        "file: of the study, YAML or JSON\noutput: folder of the study, which several processes "
        "may share\nchunk: a part of the tasks, \"2/4\"\n"
        "on_existing: \"skip\" keeps results, \"fail\", or \"overwrite\"\n"
        "progress, stop, device: as of ab()");
}

void add_tune(py::module_& module) {
    const std::string text =
        "Measures chains on a few frames of a shot, on this device, and finds the one of least "
        "error\nwithin `budget`, or of least time within `error`, as `postchain tune`. Returns a "
        "dict:\n\n"
        "chain: the chosen Chain; None (with a Warning) if none meets the goal\n"
        "text: its chain file, with conditions and front as comments; None\n"
        "front: points that no other beats in both time and error, the fastest first\n"
        "points: a dict for each measured chain: chain, knobs, chain_hash, start, seconds, "
        "spread_s,\n  repeats, doubt, hdr_flip, front, chosen\n"
        "and the conditions: version, input, frames, reference, with_truth, device, timing, "
        "budget_s,\nerror, outcome, notes\n\n"
        "input: \"A.####.exr\"\n"
        "truth: ground truth \"both.####.exr\"; without it the converged image of the one chain\n"
        "budget: seconds per frame at most, or \"200ms\"\n"
        "error: mean HDR-FLIP at most; give this or `budget`\n"
        "chains: a chain to start from, or a list of them (default: fast, balanced and best; "
        "without\n  truth balanced)\n"
        "set: values of the chains, as for Chain(), which are not varied\n"
        "progress: called with a dict (what, done, total, elapsed_s); returns False to end\n"
        "stop: a threading.Event that ends it\n"
        "device: a Device\n\nFurther arguments:" +
        rows_text(tune::tune_parameters(), tune_keys()) +
        rows_text(job_parameters(), tune_input_keys());
    module.def(
        "tune",
        [](const py::object& input, const py::object& camera, const py::object& truth,
           const py::object& budget, const py::object& error, const py::object& chains,
           const py::object& set, const py::object& progress, const py::object& stop,
           const py::object& device, const py::kwargs& settings) {
            return tune({path_of(input, "input"), camera, truth, budget, error, chains, set},
                        {progress, stop}, device_of(device), settings);
        },
        py::arg("input"), py::arg("camera") = py::none(), py::kw_only(),
        py::arg("truth") = py::none(), py::arg("budget") = py::none(),
        py::arg("error") = py::none(), py::arg("chains") = py::none(), py::arg("set") = py::none(),
        py::arg("progress") = py::none(), py::arg("stop") = py::none(),
        py::arg("device") = py::none(), text.c_str());
}

}  // namespace

void add_lab(py::module_& module) {
    add_experiments(module);
    add_tune(module);
}

void add_lab_tables(io::Json& json) {
    for (const Parameter& row : tune::tune_parameters().rows())
        if (tune_keys().contains(row.key)) json["tune"][row.key] = io::json_from(row_schema(row));
    for (const Parameter& row : experiment::ab_parameters().rows())
        if (ab_keys().contains(row.key)) json["ab"][row.key] = io::json_from(row_schema(row));
    for (const Parameter& row : experiment::bench_parameters().rows())
        if (bench_keys().contains(row.key)) json["bench"][row.key] = io::json_from(row_schema(row));
    json["experiment_input_keys"] = experiment_input_keys();
    json["tune_input_keys"] = tune_input_keys();
}

}  // namespace postchain::python

// postchain.ab(), bench() and study(): the subcommands of these names.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tools/measure/experiment/experiment.h"
#include "tools/python/call.h"
#include "tools/python/device.h"
#include "tools/python/sequence_calls.h"

namespace postchain::python {

// Keys of the rows of ab, bench and study, without those that are arguments; and those of the input
// and of planning that they take too.
const std::set<std::string>& ab_keys();
const std::set<std::string>& bench_keys();
const std::set<std::string>& experiment_input_keys();

// Sends the progress of a measurement to callbacks.progress. `stopped`: it has ended the call.
experiment::ProgressCallback progress_of(const Callbacks& callbacks, Call& call, bool& stopped);

// Each returns its report as a dict, with the report's page as "page". Raises; warns.
pybind11::dict ab(const pybind11::object& a, const pybind11::object& b, const std::string& input,
                  const std::string& output, const pybind11::object& camera,
                  const pybind11::object& truth, const pybind11::object& set,
                  const Callbacks& callbacks, const std::shared_ptr<Device>& device,
                  pybind11::kwargs values);
// `sweeps`: a dict of keys and values to try; `under`: of metrics and limits.
pybind11::dict bench(const pybind11::object& chain, const std::string& input,
                     const std::string& output, const pybind11::object& camera,
                     const pybind11::object& truth, const pybind11::object& sweeps,
                     const pybind11::object& under, const pybind11::object& set,
                     const Callbacks& callbacks, const std::shared_ptr<Device>& device,
                     pybind11::kwargs values);
// `chunk`: empty: all tasks. Without the results of other processes {"results", "tasks"}.
pybind11::dict study(const std::string& file, const std::string& output, const std::string& chunk,
                     const pybind11::object& on_existing, const Callbacks& callbacks,
                     const std::shared_ptr<Device>& device);

}  // namespace postchain::python

// postchain.tune(): the subcommand tune.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <set>
#include <string>

#include "tools/python/sequence_calls.h"

namespace postchain::python {

// The rows of tune_parameters() that are keyword arguments of their own or in `settings`, and the
// settings of the input.
const std::set<std::string>& tune_keys();
const std::set<std::string>& tune_input_keys();

struct TuneRequest {
    std::string input;
    pybind11::object camera;
    pybind11::object truth;   // pattern; None
    pybind11::object budget;  // seconds per frame, or "200ms"; None
    pybind11::object error;   // mean HDR-FLIP; None
    pybind11::object chains;  // what Chain() takes, or a list of these; None
    pybind11::object set;     // as for Chain(); these values are not varied
};

// The object of `tune --json`, each point with its Chain under "chain" and its words under "knobs",
// and `front` (points, the fastest first), `chain` (the chosen one, or None), `text` (its chain
// file, or None). Writes nothing. Raises; warns, also if no chain meets the goal.
pybind11::dict tune(const TuneRequest& request, const Callbacks& callbacks,
                    const std::shared_ptr<Device>& device, pybind11::kwargs settings);

}  // namespace postchain::python

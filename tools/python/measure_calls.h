// postchain.diff() and scene(): the subcommands diff and scene.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <optional>
#include <string>
#include <vector>

#include "tools/python/sequence_calls.h"
#include "tools/scenes/scene.h"

namespace postchain::python {

struct DiffRequest {
    std::vector<std::string> metrics;  // empty = all
    std::string map;                   // an error map; empty = none
    std::optional<double> over;        // gray
    double pixels_per_degree = 0;
    std::string tone_mapper;
};

// The metrics of one pair (arrays or files) by name, with `map` as an array; for two lists or two
// patterns {"frames": [...], "summary": {...}}, with tde. A metric without a value is None. Raises.
pybind11::dict diff(const pybind11::object& reference, const pybind11::object& test,
                    const DiffRequest& request, const pybind11::kwargs& settings);

// Writes a generated scene. `request`: all but frames, on_existing and camera. Raises.
void write_scene(scenes::SceneRequest request, const pybind11::object& frames,
                 const std::string& on_existing, const pybind11::object& camera,
                 const std::string& device, const Callbacks& callbacks);

}  // namespace postchain::python

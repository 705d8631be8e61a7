// Settings of a job from keyword arguments, by the rows of job_parameters().
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>

#include "tools/sequence/settings/job_settings.h"

namespace postchain::python {

const ParameterTable& job_parameters();

// The keys that decide how arrays are read, how the color of files is, which AOVs are filtered,
// and how a frame is planned.
const std::set<std::string>& array_keys();
const std::set<std::string>& file_keys();
const std::set<std::string>& aov_keys();  // of arrays
const std::set<std::string>& plan_keys();
const std::set<std::string>& frame_keys();  // a Frame of arrays: array_keys() and aov_keys()
const std::set<std::string>& read_keys();   // a Frame of files: file_keys() and those of AOVs
// All that have an effect on the subcommands inspect, plan and run.
const std::set<std::string>& inspect_keys();
const std::set<std::string>& plan_sequence_keys();
const std::set<std::string>& run_keys();

// `function`: of the module or of Chain; it begins the messages. `input` as for --input. `camera`:
// a dict, a path, or None. `keys`: those of `values` that are allowed. Raises; warns.
sequence::RunSettings job_settings(const std::string& function, const std::string& input,
                                   const std::string& output, const pybind11::object& camera,
                                   const pybind11::kwargs& values,
                                   const std::set<std::string>& keys);

// TypeError for a keyword argument of this function that is none of these.
void check_keys(const std::string& function, const pybind11::kwargs& values,
                const std::set<std::string>& keys);
// Takes the entries with these keys out of `values`.
pybind11::kwargs taken(pybind11::kwargs& values, const std::set<std::string>& keys);

}  // namespace postchain::python

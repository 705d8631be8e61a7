// Settings of a job from keyword arguments, by the rows of job_parameters().
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>

#include "tools/sequence/run/job_settings.h"

namespace postchain::python {

const ParameterTable& job_parameters();

// The keys that decide how a frame of arrays is read, how one of files is, and how it is planned.
const std::set<std::string>& array_keys();
const std::set<std::string>& file_keys();
const std::set<std::string>& plan_keys();

// `input` as for --input. `camera`: a dict, a path, or None. `keys`: those of `values` that are
// allowed; null: all. `place` begins the messages. Raises; warns.
sequence::RunSettings job_settings(const std::string& place, const std::string& input,
                                   const std::string& output, const pybind11::object& camera,
                                   const pybind11::kwargs& values,
                                   const std::set<std::string>* keys = nullptr);

// Takes the entries with these keys out of `values`.
pybind11::kwargs taken(pybind11::kwargs& values, const std::set<std::string>& keys);

}  // namespace postchain::python

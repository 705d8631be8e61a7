// postchain.write(): an array, or what Chain.filter() returned, as an image file.
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>

namespace postchain::python {

// The keys of a job's rows that it takes.
const std::set<std::string>& write_keys();

// `frame`: a Frame of files is written as `run` writes it, with the result in place of its color,
// AOVs and cryptomattes; without one, or with a Frame of arrays: a new file. Raises; warns.
void write_image(const std::string& path, const pybind11::object& result,
                 const pybind11::object& frame, const pybind11::kwargs& values);

}  // namespace postchain::python

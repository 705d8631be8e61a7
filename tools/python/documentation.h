// Docstrings and the stub, from the parameter tables.
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>

namespace postchain::python {

// A line for each setting of a job with one of these keys.
std::string rows_text(const std::set<std::string>& keys);
// A line for each setting of tune.
std::string tune_rows_text();
// The parameters of every pass, and of the camera.
std::string passes_text();
// The tables from which make_stub.py makes the stub.
pybind11::object tables();

}  // namespace postchain::python

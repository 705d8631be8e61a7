// Docstrings and the stub, from the parameter tables.
#pragma once

#include <pybind11/pybind11.h>

#include <set>
#include <string>

#include "chain/base/parameter.h"

namespace postchain::python {

// A line for each row of the table with one of these keys.
std::string rows_text(const ParameterTable& table, const std::set<std::string>& keys);
// The parameters of every pass, and of the camera.
std::string passes_text();
// The tables from which make_stub.py makes the stub.
pybind11::object tables();

}  // namespace postchain::python

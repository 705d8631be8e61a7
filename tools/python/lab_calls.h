// The calls of the lab: ab(), bench(), study() and tune(). Without the lab (no_lab.cpp) they raise.
#pragma once

#include <pybind11/pybind11.h>

#include "tools/sequence/files/json.h"

namespace postchain::python {

void add_lab(pybind11::module_& module);
// Their rows and keys, for the stub: "ab", "bench", "tune", "experiment_input_keys",
// "tune_input_keys".
void add_lab_tables(io::Json& tables);

}  // namespace postchain::python

// The classes Chain and Frame of the module.
#pragma once

#include <pybind11/pybind11.h>

namespace postchain::python {

void add_chain(pybind11::module_& module);
void add_frame(pybind11::module_& module);

}  // namespace postchain::python

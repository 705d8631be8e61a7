// In place of lab/, in a module that is built without the lab.
#include "tools/python/lab_calls.h"

#include "tools/python/errors.h"

namespace py = pybind11;

namespace postchain::python {

void add_lab(py::module_& module) {
    for (const char* name : {"ab", "bench", "study", "tune"})
        module.def(
            name,
            [name](const py::args&, const py::kwargs&) {
                raise_usage(name, "(): this module was built without the lab (POSTCHAIN_LAB)");
            },
            "Not in this module, which was built without the lab.");
}

void add_lab_tables(io::Json& tables) {
    for (const char* name : {"ab", "bench", "tune"}) tables[name] = io::Json::object();
    for (const char* name : {"experiment_input_keys", "tune_input_keys"})
        tables[name] = io::Json::array();
}

}  // namespace postchain::python

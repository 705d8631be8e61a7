// Python values as text, JSON and the values of parameter tables, and back.
#pragma once

#include <pybind11/pybind11.h>

#include <pybind11/stl.h>

#include <array>
#include <string>

#include "chain/base/parameter.h"
#include "config/camera_file.h"
#include "tools/python/errors.h"
#include "tools/sequence/files/json.h"

namespace postchain::python {

// None, numbers, strings, lists and dicts.
pybind11::object python_of(const io::Json& json);
pybind11::object python_of(const std::string& json_text);

// JSON of a dict or list, in which numbers may be NumPy's and paths os.PathLike. Raises.
std::string json_text_of(const pybind11::handle& value);

// The name of a value's type, for messages.
std::string type_of(const pybind11::handle& value);

// The number of a frame, of the argument `frame`. Raises UsageError.
int frame_number_of(const pybind11::handle& value);

// A string, or the path of an os.PathLike. Raises UsageError naming `place`.
std::string path_of(const pybind11::handle& value, const std::string& place);

// A value for a row. Texts may be given as paths, numbers, or as lists of texts or numbers, which
// are joined by commas (range(1, 9), ["diffuse", "specular"]). Raises.
ParameterValue parameter_value(const pybind11::handle& value, const Parameter& row);

// The value of an argument as this type. Raises UsageError "size: is a str; give two integers".
template <class T>
T argument_of(const pybind11::handle& value, const std::string& name, const char* expected) {
    try {
        return value.cast<T>();
    } catch (const pybind11::cast_error&) {
        raise_usage(name, ": is a ", type_of(value), "; give ", expected);
    }
}

// Sets rows from keyword arguments; None leaves a row as it is. `place` begins the messages. All
// are keys of the table. Raises UsageError for a wrong value.
void set_rows(const ParameterTable& table, ParameterRef parameters, const pybind11::kwargs& values,
              const std::string& place);

// The camera of a dict, which has the keys of a camera file, with its aperture images read. Raises.
CameraFile camera_of(const pybind11::dict& camera);

}  // namespace postchain::python

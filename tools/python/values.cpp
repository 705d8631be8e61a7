#include "tools/python/values.h"

#include "tools/python/errors.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/settings/job_settings.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

[[noreturn]] void refuse(const std::string& place, const std::string& what) {
    raise_usage(place, ": ", what);
}

// For json.dumps(): NumPy's numbers and arrays, paths.
py::object plain_value(const py::object& value) {
    if (py::hasattr(value, "__fspath__")) return value.attr("__fspath__")();
    if (py::hasattr(value, "tolist")) return value.attr("tolist")();
    refuse("chain or camera",
           concat("a ", type_of(value),
                  " has no place in it; give numbers, strings, lists and dicts"));
}

// NumPy's arrays have __index__ too, which fails unless they hold one number.
bool is_integer(const py::handle& value) {
    if (!PyIndex_Check(value.ptr()) || py::isinstance<py::bool_>(value)) return false;
    if (py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()))) return true;
    PyErr_Clear();
    return false;
}

int64_t integer_of(const py::handle& value, const std::string& place) {
    const auto number = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
    if (!number) throw py::error_already_set();
    int overflow = 0;
    const int64_t integer = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
    if (overflow != 0) refuse(place, std::string(py::str(value)) + " is too large a number");
    return integer;
}

std::string word_of(const py::handle& value, const std::string& place) {
    if (is_integer(value)) return std::to_string(integer_of(value, place));
    return path_of(value, place);
}

std::string list_text_of(const py::handle& value, const std::string& place) {
    const bool one =
        py::isinstance<py::str>(value) || is_integer(value) || !py::isinstance<py::iterable>(value);
    if (one) return word_of(value, place);
    std::string text;
    for (const py::handle item : value) text += (text.empty() ? "" : ",") + word_of(item, place);
    if (text.empty()) refuse(place, "is empty; give at least one, or leave it out");
    return text;
}

}  // namespace

std::string type_of(const py::handle& value) {
    return py::str(py::type::handle_of(value).attr("__name__"));
}

int frame_number_of(const py::handle& value) {
    if (!is_integer(value)) refuse("frame", concat("is a ", type_of(value), "; give an integer"));
    const int64_t number = integer_of(value, "frame");
    if (number != int(number)) refuse("frame", concat(number, " is too large a number"));
    return int(number);
}

py::object python_of(const std::string& json_text) {
    return py::module_::import("json").attr("loads")(json_text);
}

py::object python_of(const io::Json& json) {
    return python_of(in_python(json.dump(-1, ' ', false, io::Json::error_handler_t::replace)));
}

std::string json_text_of(const py::handle& value) {
    return py::str(py::module_::import("json").attr("dumps")(
        value, py::arg("default") = py::cpp_function(plain_value)));
}

std::string path_of(const py::handle& value, const std::string& place) {
    if (!py::isinstance<py::str>(value) && !py::hasattr(value, "__fspath__"))
        refuse(place, "is a " + type_of(value) + "; give a string or a path");
    const py::object path = py::module_::import("os").attr("fspath")(value);
    if (!py::isinstance<py::str>(path)) refuse(place, "is a path of bytes; give a string");
    return py::str(path);
}

ParameterValue parameter_value(const py::handle& value, const Parameter& row) {
    switch (row.type) {
        case ParameterType::boolean:
            if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
            break;
        case ParameterType::integer:
        case ParameterType::number:
            if (is_integer(value)) return integer_of(value, row.key);
            if (py::isinstance<py::float_>(value) || py::hasattr(value, "__float__"))
                return py::float_(py::reinterpret_borrow<py::object>(value)).cast<double>();
            break;
        case ParameterType::point:
            if (py::isinstance<py::sequence>(value) && py::len(value) == 2)
                return argument_of<std::array<double, 2>>(value, row.key, "two numbers");
            break;
        case ParameterType::choice:
            return word_of(value, row.key);
        case ParameterType::text:
            return list_text_of(value, row.key);
    }
    refuse(row.key, concat("is a ", type_of(value), "; give ", row.domain()));
}

void set_rows(const ParameterTable& table, ParameterRef parameters, const py::kwargs& values,
              const std::string& place) {
    for (const auto& [name, value] : values) {
        const std::string key = py::str(name);
        if (value.is_none()) continue;
        const Parameter& row = *table.find(key);
        const Status status = table.set(parameters, key, parameter_value(value, row));
        if (!status.ok()) refuse(place + ": " + key, status.message());
    }
}

CameraFile camera_of(const py::dict& camera) {
    CameraFile file = parse_camera(json_text_of(camera), "camera");
    for (Diagnostic& one : file.diagnostics) {
        one.line = one.column = 0;  // of the JSON
        // A key that a program gives and nothing reads is a mistake, not another program's.
        if (one.severity == Severity::note) one.severity = Severity::warning;
    }
    if (const Status status = file.status(); !status.ok()) raise(status, file.diagnostics);
    warn(warnings_of(file.diagnostics));
    if (const Status status = sequence::read_aperture_images(file); !status.ok()) raise(status);
    return file;
}

}  // namespace postchain::python

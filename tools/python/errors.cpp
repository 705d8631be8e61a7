#include "tools/python/errors.h"

#include <regex>

#include "tools/python/job.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

py::object in_module(const char* name) {
    return py::module_::import("postchain._errors").attr(name);
}

// The names of a function's arguments, from the first line of its docstring.
std::vector<std::string> names_in_signature(const std::string& function) {
    const py::module_ module = py::module_::import("postchain._postchain");
    py::object found = py::getattr(module, function.c_str(), py::none());
    if (found.is_none()) found = py::getattr(module.attr("Chain"), function.c_str(), py::none());
    if (PyType_Check(found.ptr())) found = found.attr("__init__");
    const py::object text = py::getattr(found, "__doc__", py::none());
    if (text.is_none()) return {};
    const std::string documentation = py::str(text);
    const std::string line = documentation.substr(0, documentation.find('\n'));
    static const std::regex argument(R"re([(,] ?([a-z_]+): )re");
    std::vector<std::string> names;
    for (std::sregex_iterator one(line.begin(), line.end(), argument), end; one != end; ++one)
        if ((*one)[1] != "self") names.push_back((*one)[1]);
    return names;
}

}  // namespace

std::string in_python(const std::string& message) {
    return with_settings(message, [](const std::string& key, const std::string& value) {
        if (value.empty()) return key;
        if (value == "true" || value == "false")
            return key + (value == "true" ? "=True" : "=False");
        const Parameter* row = job_parameters().find(key);
        if (row ? row->type == ParameterType::number : std::isdigit(value.back()))
            return key + "=" + value;
        return key + "='" + std::regex_replace(value, std::regex(" or "), "' or '") + "'";
    });
}

void raise_unexpected(const std::string& function, const std::string& key,
                      std::vector<std::string> known) {
    std::string text = concat(function, "() got an unexpected keyword argument '", key, "'");
    for (auto& name : names_in_signature(function)) known.push_back(std::move(name));
    if (const std::string near = nearest_word(key, known); !near.empty())
        text += concat("; did you mean '", near, "'?");
    else if (job_parameters().find(key))
        text += concat("; it is an argument of run_sequence()");
    throw py::type_error(text);
}

void raise(const Status& status, const Diagnostics& diagnostics) {
    py::list listed;
    for (const Diagnostic& one : diagnostics)
        if (one.severity == Severity::error)
            listed.append(in_module("Diagnostic")(in_python(one.file), one.line, one.column,
                                                  one.path, in_python(one.message)));
    const py::object type = in_module("CLASSES")[name_of(status.code())];
    const py::object error = type(in_python(status.message()), listed);
    PyErr_SetObject(type.ptr(), error.ptr());
    throw py::error_already_set();
}

std::vector<std::string> warnings_of(const Diagnostics& diagnostics) {
    std::vector<std::string> warnings;
    for (const Diagnostic& one : diagnostics)
        if (one.severity == Severity::warning) warnings.push_back(one.text());
    return warnings;
}

void warn(const std::vector<std::string>& messages) {
    const py::object type = in_module("Warning");
    for (const std::string& message : messages)
        if (PyErr_WarnEx(type.ptr(), in_python(message).c_str(), 1) != 0)
            throw py::error_already_set();
}

}  // namespace postchain::python

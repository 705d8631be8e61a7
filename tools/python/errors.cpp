#include "tools/python/errors.h"

#include <regex>

namespace py = pybind11;

namespace postchain::python {
namespace {

py::object in_module(const char* name) {
    return py::module_::import("postchain._errors").attr(name);
}

}  // namespace

std::string in_python(const std::string& message) {
    static const std::regex option(R"re((^|[\s(])--([a-z]+(?:-[a-z]+)*))re");
    std::string text;
    auto at = message.cbegin();
    for (std::sregex_iterator found(message.begin(), message.end(), option), end; found != end;
         ++found) {
        text.append(at, (*found)[2].first - 2);
        for (const char c : (*found)[2].str()) text += c == '-' ? '_' : c;
        at = (*found)[2].second;
    }
    return text.append(at, message.cend());
}

void raise(const Status& status, const Diagnostics& diagnostics) {
    py::list listed;
    for (const Diagnostic& one : diagnostics)
        if (one.severity == Severity::error)
            listed.append(in_module("Diagnostic")(one.file, one.line, one.column, one.path,
                                                  in_python(one.message)));
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

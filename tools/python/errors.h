// Failures of the libraries as Python exceptions (package/_errors.py), and their warnings.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <utility>
#include <vector>

#include "chain/base/status.h"
#include "config/diagnostic.h"

namespace postchain::python {

// Settings as keyword arguments: "use {mkdir=true}" -> "use mkdir=True", "{on_existing=skip}" ->
// "on_existing='skip'", "{truth}" -> "truth".
std::string in_python(const std::string& message);

// Raises the class of the status's code. With diagnostics, the exception lists the errors among
// them with file, line, column and key.
[[noreturn]] void raise(const Status& status, const Diagnostics& diagnostics = {});

// StatusCode::usage, with the concat() of all parts as its message.
template <class... Parts>
[[noreturn]] void raise_usage(const Parts&... parts) {
    raise(Status(StatusCode::usage, concat(parts...)));
}

// TypeError: a function of the module, or a method of Chain, does not take the keyword argument.
// `known`: those that it takes beside the arguments of its signature.
[[noreturn]] void raise_unexpected(const std::string& function, const std::string& key,
                                   std::vector<std::string> known);

template <class T>
T value_of(Result<T> result) {
    if (!result.ok()) raise(result.status());
    return std::move(*result);
}

// The warnings among diagnostics.
std::vector<std::string> warnings_of(const Diagnostics& diagnostics);
// Python warnings of the class postchain.Warning.
void warn(const std::vector<std::string>& messages);

}  // namespace postchain::python

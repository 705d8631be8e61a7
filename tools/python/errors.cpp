#include "tools/python/errors.h"

#include <algorithm>
#include <regex>

#include "tools/python/job.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

py::object in_module(const char* name) {
    return py::module_::import("postchain._errors").attr(name);
}

// Words that are values of a setting whose values are texts.
constexpr const char* kValuesOfTexts[] = {"all", "filter", "generic", "view"};

bool is_value(const Parameter& row, const std::string& word) {
    if (row.type == ParameterType::boolean || word.empty()) return false;
    if (row.type == ParameterType::choice) return std::ranges::count(row.choices, word) > 0;
    return std::isdigit(word[0]) || std::ranges::count(kValuesOfTexts, word) > 0;
}

std::string quoted_value(const Parameter& row, const std::string& word) {
    const bool number = row.type == ParameterType::number || row.type == ParameterType::integer;
    return number ? word : concat("'", word, "'");
}

// An option as a keyword argument. `verb`: the word before it; `rest`: the text after it, of which
// its value is taken.
std::string argument_text(const std::string& verb, std::string key, std::string_view& rest) {
    std::ranges::replace(key, '-', '_');
    if (key.starts_with("no_"))
        if (const Parameter* row = job_parameters().find(key.substr(3));
            row && row->type == ParameterType::boolean)
            return row->key + "=False";
    static const Parameter device = [] {  // no row of a job
        Parameter row;
        row.type = ParameterType::choice;
        row.choices = {"auto", "gpu", "software"};
        return row;
    }();
    const Parameter* row = key == "device" ? &device : job_parameters().find(key);
    if (!row) return key;
    static const std::set<std::string> verbs = {"use", "give", "with", "under", "or"};
    if (row->type == ParameterType::boolean) return verbs.contains(verb) ? key + "=True" : key;
    static const std::regex one(R"re(^[ =]([A-Za-z0-9_.:,-]*[A-Za-z0-9_]))re");
    static const std::regex another(R"re(^ or ([a-z0-9]+))re");
    std::cmatch word;
    const auto take = [&](const std::regex& form) {
        const bool found = std::regex_search(rest.data(), rest.data() + rest.size(), word, form) &&
                           is_value(*row, word[1]);
        if (found) rest.remove_prefix(size_t(word.length()));
        return found;
    };
    if (!take(one)) return key;
    std::string text = key + "=" + quoted_value(*row, word[1]);
    while (take(another)) text += " or " + quoted_value(*row, word[1]);
    return text;
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
    static const std::regex option(R"re((?:^|[\s(`])--([a-z]+(?:-[a-z]+)*))re");
    std::string text;
    std::string_view rest = message;
    std::cmatch found;
    while (std::regex_search(rest.data(), rest.data() + rest.size(), found, option)) {
        const auto begin = size_t(found.position(1)) - 2;
        text.append(rest.substr(0, begin));
        const size_t space = text.find_last_not_of(' ');
        const std::string before = text.substr(0, space == std::string::npos ? 0 : space + 1);
        const std::string verb = before.substr(before.find_last_of(" (") + 1);
        const std::string key = found[1];
        rest.remove_prefix(begin + 2 + key.size());
        text += argument_text(verb, key, rest);
    }
    return text.append(rest);
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

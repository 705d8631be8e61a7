#include "tools/python/chain_object.h"

#include "config/chain_file.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/python/errors.h"
#include "tools/python/values.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

ChainPtr finished(ChainFile file, std::string name, bool is_file) {
    if (const Status status = file.status(); !status.ok()) raise(status, file.diagnostics);
    io::ApertureFiles pictures;
    if (const Status status = pictures.read(file.chain.camera); !status.ok())
        raise(status.at("camera.aperture_image"));
    warn(warnings_of(file.diagnostics));
    return std::make_shared<const ChainObject>(
        ChainObject{std::move(file.chain), std::move(name), is_file});
}

// Values that are set, by key.
io::Json values_of(const ParameterTable& table, ConstParameterRef parameters) {
    io::Json json = io::Json::object();
    for (const Parameter& row : table.rows())
        if (const ParameterValue value = row.get(parameters);
            value != ParameterValue() && table.unread(row, parameters).empty())
            json[row.key] = io::json_of(value);
    return json;
}

}  // namespace

std::vector<std::string> overrides_of(const py::object& set) {
    std::vector<std::string> overrides;
    if (set.is_none()) return overrides;
    if (!py::isinstance<py::dict>(set)) {
        for (const py::handle one : set) overrides.push_back(py::str(one));
        return overrides;
    }
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(set)) {
        const bool text = py::isinstance<py::str>(value);
        overrides.push_back(concat(std::string(py::str(key)), "=",
                                   text ? std::string(py::str(value)) : json_text_of(value)));
    }
    return overrides;
}

ChainPtr chain_from_text(const std::string& text, const std::string& name, const py::object& set) {
    return finished(parse_chain(text, name, builtin_passes(), overrides_of(set)), name, false);
}

ChainPtr chain_of(const py::object& source, const py::object& set) {
    if (py::isinstance<ChainObject>(source) && set.is_none()) return source.cast<ChainPtr>();
    const bool is_chain = py::isinstance<ChainObject>(source);
    if (is_chain || py::isinstance<py::dict>(source)) {
        const std::string text =
            is_chain ? write_chain(source.cast<ChainPtr>()->chain) : json_text_of(source);
        ChainFile file = parse_chain(text, "chain", builtin_passes(), overrides_of(set));
        for (Diagnostic& one : file.diagnostics) one.line = one.column = 0;  // of the JSON
        return finished(std::move(file), is_chain ? source.cast<ChainPtr>()->name : "chain", false);
    }
    const std::string path = path_of(source, "chain");
    const auto found = value_of(find_chain(path));
    return finished(parse_chain(found, builtin_passes(), overrides_of(set)), path, !found.shipped);
}

py::dict dict_of(const ChainObject& object) {
    io::Json json = {{"postchain", kChainFileVersion}};
    json["camera"] = values_of(camera_parameters(), &object.chain.camera);
    json["passes"] = io::Json::array();
    for (const ChainLink& link : object.chain.links) {
        io::Json values = values_of(*link.type->parameters, link.pass->parameters());
        values.update(values_of(link_parameters(), &link));
        json["passes"].push_back({{link.type->name, std::move(values)}});
    }
    return python_of(json);
}

}  // namespace postchain::python

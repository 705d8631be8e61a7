#include "tools/sequence/source/resolved_values.h"

#include <algorithm>
#include <cstdio>

#include "chain/base/printable.h"
#include "chain/pass/resolved_chain.h"
#include "tools/sequence/files/json.h"

namespace postchain::sequence {
namespace {

using io::Json;

const Origin* find(const Origins& origins, const std::string& key) {
    const auto found = origins.find(key);
    return found == origins.end() ? nullptr : &found->second;
}

// The origin of a camera value: the chain's value takes precedence over the frame's.
Origin of_camera(const Chain& chain, const SourceFrame& frame, const std::string& row) {
    if (const Origin* stated = find(chain.origins, "camera." + row)) return *stated;
    if (const Origin* stated = find(frame.header.camera_origins, row)) return *stated;
    return {kFromDefault, ""};
}

Origin origin_of(const Chain& chain, const SourceFrame& frame, size_t pass, const UsedValue& used) {
    switch (used.of) {
        case UsedValue::Of::camera:
            return of_camera(chain, frame, used.row);
        case UsedValue::Of::pass:
            if (const Origin* stated = find(chain.origins, concat("passes[", pass, "].", used.row)))
                return *stated;
            break;
        case UsedValue::Of::frame:
            return {kFromFrame, ""};
        case UsedValue::Of::standard:
            break;
    }
    return {kFromDefault, ""};
}

Json json_of(const std::vector<ResolvedValue>& values) {
    Json json = Json::object();
    for (const auto& one : values) {
        Json& entry = json[one.key];
        entry["value"] = io::json_of(one.value);
        if (!one.unit.empty()) entry["unit"] = one.unit;
        entry["from"] = one.origin.from;
        if (!one.origin.where.empty()) entry["where"] = one.origin.where;
    }
    return json;
}

// "4.2 scene units"
std::string amount(const ResolvedValue& one) {
    std::string text;
    if (const auto* number = std::get_if<double>(&one.value)) {
        char digits[32];
        std::snprintf(digits, sizeof(digits), "%.6g", *number);
        text = digits;
    } else if (one.value == ParameterValue()) {
        return "infinitely far";
    } else {
        text = text_of(one.value);
    }
    return one.unit.empty() ? text : text + " " + one.unit;
}

std::string origin_text(const Origin& origin) {
    if (origin.where.empty()) return origin.from;
    // These name themselves.
    if (origin.from == kFromOption) return origin.where;
    return origin.from + " " + origin.where;
}

}  // namespace

ResolvedValues resolve_values(const Chain& chain, const SourceFrame& frame, const FramePlan& plan) {
    ResolvedValues resolved;
    for (const auto& row : camera_parameters().rows()) {
        const ParameterValue value = row.get(&plan.description.camera);
        if (value == ParameterValue()) continue;
        resolved.camera.push_back({row.key, value, row.unit, of_camera(chain, frame, row.key)});
    }
    for (size_t i = 0; i < chain.links.size(); ++i) {
        PassValues pass{chain.links[i].type->name, plan.passes[i].elided, {}};
        const auto on_frame = resolve_link(chain, i, plan.description);
        for (UsedValue& used :
             on_frame.ok() ? (*on_frame)->used_values() : std::vector<UsedValue>()) {
            Origin origin = origin_of(chain, frame, i, used);
            pass.values.push_back({std::move(used.key), std::move(used.value), std::move(used.unit),
                                   std::move(origin)});
        }
        resolved.passes.push_back(std::move(pass));
    }
    return resolved;
}

Json resolved_json(const ResolvedValues& resolved) {
    Json passes = Json::array();
    for (const auto& pass : resolved.passes)
        passes.push_back(
            {{"pass", pass.type}, {"left_out", pass.left_out}, {"values", json_of(pass.values)}});
    return {{"camera", json_of(resolved.camera)}, {"passes", passes}};
}

std::string resolved_text(const ResolvedValues& resolved) {
    std::string text;
    for (size_t i = 0; i < resolved.passes.size(); ++i) {
        const PassValues& pass = resolved.passes[i];
        if (pass.values.empty()) continue;
        text +=
            concat("values of pass ", i, " ", pass.type, pass.left_out ? " (left out)" : "", "\n");
        size_t keys = 0, amounts = 0;
        for (const auto& one : pass.values) {
            keys = std::max(keys, one.key.size());
            amounts = std::max(amounts, amount(one).size());
        }
        for (const auto& one : pass.values) {
            const std::string value = amount(one);
            text += "  " + one.key + std::string(keys + 2 - one.key.size(), ' ') + value +
                    std::string(amounts + 2 - value.size(), ' ') +
                    printable(origin_text(one.origin)) + "\n";
        }
    }
    return text;
}

}  // namespace postchain::sequence

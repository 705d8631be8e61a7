#include "tools/sequence/record/record.h"

#include <filesystem>

#include "chain/base/text.h"
#include "config/chain_file.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/source/resolved_values.h"

namespace postchain::sequence {
namespace {

using io::Json;

std::string whole_path(const std::string& path) {
    std::error_code failed;
    const auto whole = std::filesystem::absolute(path, failed);
    return failed ? path : whole.lexically_normal().string();
}

// --input with absolute paths, without the layer behind.
std::string input_text(io::InputSpec input) {
    input.patterns.erase(Role::behind);
    if (!input.separate_files()) return whole_path(input.color().text());
    std::string text;
    for (const auto& [role, pattern] : input.patterns)
        text += concat(text.empty() ? "" : ",", io::InputSpec::word_of(role), "=",
                       whole_path(pattern.text()));
    return text;
}

// Places in files with absolute paths: a record does not depend on the working folder.
ResolvedValues with_whole_paths(ResolvedValues resolved) {
    const auto make_whole = [](Origin& origin) {
        if (origin.from != kFromChain && origin.from != kFromCameraFile) return;
        const size_t colon = origin.where.rfind(':');
        const std::string path = origin.where.substr(0, colon);
        std::error_code failed;
        if (colon != std::string::npos && std::filesystem::exists(path, failed))
            origin.where.replace(0, colon, whole_path(path));
    };
    for (auto& one : resolved.camera) make_whole(one.origin);
    for (auto& pass : resolved.passes)
        for (auto& one : pass.values) make_whole(one.origin);
    return resolved;
}

// The values that the camera file gave, as a camera file.
Json camera_json(const ResolvedValues& resolved) {
    Json camera = Json::object();
    for (const auto& one : resolved.camera)
        if (one.origin.from == kFromCameraFile) camera[one.key] = io::json_of(one.value);
    return camera;
}

}  // namespace

std::string record_text(const Chain& chain, const RunSettings& settings,
                        const FrameReport& report) {
    Json given = Json::object();
    for (const auto& [key, value] : settings.given) {
        const auto* text = std::get_if<std::string>(&value);
        if (key == "input")
            given[key] = input_text(settings.input);
        else if (text && (key == "camera" || key == "ocio" ||
                          (key == "profile" && text->find_first_of("/.") != std::string::npos)))
            given[key] = whole_path(*text);
        else
            given[key] = io::json_of(value);
    }
    if (const auto behind = settings.input.patterns.find(Role::behind);
        behind != settings.input.patterns.end())
        given["behind"] = whole_path(behind->second.text());
    Json inputs = Json::array();
    for (const auto& file : report.stamps)
        inputs.push_back({{"file", whole_path(file.path)}, {"bytes", file.bytes}});
    Json json = {{"version", settings.version}, {"work", report.provenance},
                 {"frame", report.frame},       {"chain", write_chain(chain)},
                 {"settings", given},           {"inputs", inputs}};
    if (const auto& camera = settings.source.camera)
        json["camera"] = {{"hash", hex_of(camera->text_hash)},
                          {"values", camera_json(*report.resolved)}};
    json["resolved"] = resolved_json(with_whole_paths(*report.resolved));
    return io::json_text(json);
}

Result<Record> read_record(const std::string& path) {
    ASSIGN_OR_RETURN(auto file, io::open_pixels(path));
    for (const auto& part : file->parts()) {
        const auto found = part.attributes.find(kRecordAttribute);
        if (found == part.attributes.end()) continue;
        const auto damaged = [&](const std::string& why) {
            return Status(StatusCode::input,
                          concat(path, ": its attribute ", kRecordAttribute, " is damaged: ", why,
                                 "; give chain and settings as options"));
        };
        const auto read = io::read_json(found->second, kRecordAttribute);
        if (!read.ok()) return damaged(read.status().message());
        try {
            const Json& json = *read;
            Record record;
            record.version = json.at("version").get<std::string>();
            record.work = json.at("work").get<std::string>();
            record.frame = json.at("frame").get<int>();
            record.chain = json.at("chain").get<std::string>();
            for (const auto& [key, value] : json.at("settings").items())
                record.settings[key] = io::value_of(value).value_or(ParameterValue());
            for (const auto& input : json.at("inputs"))
                record.inputs.push_back(
                    {input.at("file").get<std::string>(), input.at("bytes").get<uint64_t>(), 0});
            if (const auto camera = json.find("camera"); camera != json.end()) {
                record.camera = camera->at("values").dump();
                record.camera_hash = camera->at("hash").get<std::string>();
            }
            return record;
        } catch (const Json::exception&) {
            return damaged("a member is missing or of another type");
        }
    }
    return Status(
        StatusCode::input,
        concat(path, ": no attribute ", kRecordAttribute,
               "; {like} takes an output that `run` of this version or a later one wrote"_keyed));
}

}  // namespace postchain::sequence

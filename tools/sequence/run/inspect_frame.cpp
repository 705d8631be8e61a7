#include "tools/sequence/run/inspect_frame.h"

#include <filesystem>

#include "config/profile_match.h"
#include "tools/sequence/files/folder_scan.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

using io::Json;

Json describe_file(const io::PixelFile& file) {
    Json parts = Json::array();
    for (const auto& part : file.parts()) {
        Json channels = Json::array();
        for (const auto& channel : part.channels)
            channels.push_back({{"name", channel.name}, {"type", io::name_of(channel.type)}});
        Json one = {{"name", part.name},
                    {"type", part.type},
                    {"compression", part.compression},
                    {"data_window", part.data_window.text()},
                    {"display_window", part.display_window.text()},
                    {"pixel_aspect", part.pixel_aspect},
                    {"channels", channels},
                    {"attributes", part.attributes}};
        if (!part.view.empty()) one["view"] = part.view;
        if (!part.views.empty()) one["views"] = part.views;
        parts.push_back(std::move(one));
    }
    return {{"file", file.path()}, {"bytes", file.file_bytes()}, {"parts", parts}};
}

Json describe_roles(const ProfileMatch& match) {
    Json roles = Json::object();
    for (const auto& [role, where] : match.roles)
        roles[name_of(role)] = {{"part", where.part}, {"channels", where.channels}};
    Json missing = Json::object();
    for (const auto& [role, names] : match.missing) missing[name_of(role)] = names;
    return {{"profile", match.profile}, {"detected", match.detected},
            {"why", match.why},         {"view_layer", match.view_layer},
            {"view", match.view},       {"roles", roles},
            {"missing", missing},       {"notes", match.notes}};
}

// `window`: that of the planes, larger than the data window of a cropped frame.
Json describe_frame(const FrameDescription& frame, const io::Window& window) {
    Json json = {{"window", window.text()},
                 {"width", frame.width},
                 {"height", frame.height},
                 {"display_width", frame.display_width},
                 {"display_height", frame.display_height},
                 {"luma_weights", frame.luma_weights}};
    Json camera = Json::object();
    for (const auto& row : camera_parameters().rows())
        if (const auto value = row.get(&frame.camera); value != ParameterValue())
            camera[row.key] = io::json_of(value);
    json["camera"] = camera;
    return json;
}

// Attributes in the file that the table in docs/profiles.md lists.
Json describe_attributes(const std::vector<io::FoundAttribute>& found) {
    Json list = Json::array();
    for (const auto& one : found) {
        Json entry = {{"attribute", one.row->name}, {"value", one.text}};
        if (!one.gives.empty())
            entry["gives"] = one.gives;
        else
            entry["not_used"] = one.why;
        list.push_back(std::move(entry));
    }
    return list;
}

Json describe_signs(const SignCheck& check) {
    Json candidates = Json::array();
    for (const auto& candidate : check.candidates)
        candidates.push_back({{"vectors", candidate.text()},
                              {"error", candidate.error},
                              {"pixels_apart", candidate.pixels_apart},
                              {"margin", candidate.margin},
                              {"as_converted", candidate.as_converted()}});
    Json json = {{"verdict", name_of(check.verdict())},
                 {"pixels", check.pixels},
                 {"still_error", check.still_error},
                 {"margin", check.margin()},
                 {"candidates", candidates}};
    if (!check.why_not.empty()) json["why_not"] = check.why_not;
    if (const std::string remedy = check.remedy(); !remedy.empty()) json["remedy"] = remedy;
    return json;
}

// Range of visible distances, from the bounds of inverse depth; null = sky.
Json distances(const FrameBounds& bounds) {
    const auto distance = [](double inverse) { return inverse > 0 ? Json(1 / inverse) : Json(); };
    return {{"nearest", distance(bounds.max_inverse_depth)},
            {"farthest", distance(bounds.min_inverse_depth)}};
}

const RoleSet kLookedAt = {Role::inverse_depth, Role::motion, Role::motion_back};

// A frame without planes, and its thumbnail.
Result<SourceFrame> look_at(const RunSettings& settings, const FrameHeader& header,
                            Thumbnail& thumbnail) {
    ASSIGN_OR_RETURN(auto source,
                     read_source_frame(settings.source, header, kLookedAt, io::Keep::nothing));
    thumbnail = Thumbnail(*source.planes.at(Role::color));
    source.planes.clear();
    return source;
}

}  // namespace

Result<Json> inspect_folder(const std::string& folder) {
    ASSIGN_OR_RETURN(const auto found, io::scan_folder(folder));
    Json list = Json::array();
    for (const auto& sequence : found)
        list.push_back({{"input", sequence.pattern},
                        {"first", sequence.frames.front()},
                        {"last", sequence.frames.back()},
                        {"frames", sequence.frames.size()},
                        {"missing", sequence.gaps}});
    return Json{{"folder", folder}, {"sequences", list}};
}

InspectedFrame inspect_frame(const RunSettings& settings, const std::map<Role, std::string>& files,
                             int frame, SequenceSurvey& survey) {
    InspectedFrame found;
    Json& json = found.json;
    const auto failed = [&](const Status& status) {
        survey.add_failed(frame, status);
        found.status = status;
        return std::move(found);
    };
    auto opened = io::open_frame(files, frame);
    if (!opened.ok()) return failed(opened.status());
    for (const auto& [role, file] : opened->files)
        json["files"][name_of(role)] = describe_file(*file);
    auto header = open_source_frame(settings.source, files, frame);
    if (!header.ok()) return failed(header.status());
    Thumbnail thumbnail;
    auto source = look_at(settings, *header, thumbnail);
    if (!source.ok()) return failed(source.status());
    survey.add(frame, *source, thumbnail);
    json["match"] = describe_roles(source->header.match);
    json["frame"] = describe_frame(source->description, source->header.window);
    json["camera_attributes"] = describe_attributes(header->camera_attributes);
    json["frame"]["memory_to_filter"] = bytes_text(frame_bytes(
        *header, planes_of(*header, kLookedAt), io::Keep::all, header->window.height()));
    add_findings(json, source->description.bounds, source->findings);
    if (source->description.planes.has(Role::inverse_depth))
        json["frame"]["distance"] = distances(source->description.bounds);
    std::map<Role, std::string> next_files;
    for (const auto& [role, pattern] : settings.input.patterns) {
        const auto all = pattern.discover();
        if (const auto next = all.find(frame + 1); next != all.end() && pattern.has_token())
            next_files[role] = next->second;
    }
    if (next_files.count(Role::color) && !settings.source.cuts.contains(frame) &&
        source->description.planes.has(Role::motion)) {
        auto next = open_source_frame(settings.source, next_files, frame + 1);
        found.signs = next.ok() ? scan_signs(settings.source, *header, *next)
                                : Result<SignCheck>(next.status());
        if (found.signs->ok()) json["sign_check"] = describe_signs(**found.signs);
    }
    found.source = std::move(*source);
    return found;
}

Status survey_others(const RunSettings& settings, const io::FrameList& list,
                     const std::vector<int>& frames, SequenceSurvey& survey,
                     const std::function<bool(size_t done)>& progress) {
    for (size_t i = 1; i < frames.size(); ++i) {
        if (!progress(i)) return Status(StatusCode::canceled, "inspect: stopped");
        const int frame = frames[i];
        const auto files = list.files.find(frame);
        auto header =
            files == list.files.end()
                ? Result<FrameHeader>(
                      Status(StatusCode::input,
                             "one of its files is not on disk; render it, or leave the frame out"))
                : open_source_frame(settings.source, files->second, frame);
        Thumbnail thumbnail;
        auto source = header.ok() ? look_at(settings, *header, thumbnail)
                                  : Result<SourceFrame>(header.status());
        if (source.ok())
            survey.add(frame, *source, thumbnail);
        else
            survey.add_failed(frame, source.status());
    }
    progress(frames.size());
    return Status();
}

std::vector<int> frames_to_survey(const io::FrameList& list) {
    uint64_t bytes = 0;
    std::error_code error;
    for (const auto& [role, path] : list.files.begin()->second)
        if (const auto size = std::filesystem::file_size(path, error); !error) bytes += size;
    return frames_to_survey(list.frames, bytes);
}

}  // namespace postchain::sequence

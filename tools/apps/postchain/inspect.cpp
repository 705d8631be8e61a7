#include "tools/apps/postchain/inspect.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <set>

#include "chain/printable.h"
#include "config/profile_match.h"
#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/print_line.h"
#include "tools/apps/postchain/stop_on_signal.h"
#include "tools/sequence/files/folder_scan.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/frame_scan.h"
#include "tools/sequence/run/frame_task.h"
#include "tools/sequence/run/memory.h"
#include "tools/sequence/run/sequence_survey.h"
#include "tools/sequence/run/sidecar.h"

namespace postchain {
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
    return {{"profile", match.profile}, {"detected", match.detected}, {"why", match.why},
            {"layer", match.layer},     {"view", match.view},         {"roles", roles},
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
    for (const auto& row : camera_parameters().rows()) {
        const auto value = row.get(&frame.camera);
        if (const auto* number = std::get_if<double>(&value)) camera[row.key] = *number;
    }
    json["camera"] = camera;
    return json;
}

// Attributes in the file that the table in docs/camera_metadata.md lists.
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

void print_attributes(const std::vector<io::FoundAttribute>& found) {
    if (found.empty()) std::printf("camera metadata: none\n");
    for (const auto& one : found) {
        const std::string what = one.gives.empty() ? "not used: " + one.why : "gives " + one.gives;
        std::printf("camera metadata: %s (%s, %s): %s\n", one.row->name, one.row->writer,
                    one.row->unit, printable(what).c_str());
    }
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
    return json;
}

// Attributes that the line of a part and those of its channels show.
const std::set<std::string> kShownAttributes = {
    "name", "type", "compression", "dataWindow", "displayWindow", "pixelAspectRatio", "channels"};

void print_file(const Json& file) {
    std::printf("%s: %llu bytes\n", printable(file["file"].get<std::string>()).c_str(),
                (unsigned long long)file["bytes"].get<uint64_t>());
    for (size_t i = 0; i < file["parts"].size(); ++i) {
        const auto& part = file["parts"][i];
        const auto word = [&](const char* key) { return printable(part[key].get<std::string>()); };
        std::printf("part %zu %s %s %s, data window %s, display window %s, pixel aspect %g\n", i,
                    word("name").c_str(), word("type").c_str(), word("compression").c_str(),
                    word("data_window").c_str(), word("display_window").c_str(),
                    part["pixel_aspect"].get<double>());
        for (const auto& channel : part["channels"])
            std::printf("  %s (%s)\n", printable(channel["name"].get<std::string>()).c_str(),
                        channel["type"].get<std::string>().c_str());
        for (const auto& [key, value] : part["attributes"].items())
            if (!kShownAttributes.contains(key))
                std::printf("  %s: %s\n", printable(key).c_str(),
                            printable(value.get<std::string>()).c_str());
    }
}

// Prints "key: value" lines; nested objects as "key.key: value".
void print_values(const Json& values, const std::string& prefix = "") {
    for (const auto& [key, value] : values.items()) {
        if (value.is_object())
            print_values(value, prefix + key + ".");
        else
            std::printf("%s%s: %s\n", prefix.c_str(), key.c_str(),
                        printable(io::json_text(value)).c_str());
    }
}

void print_signs(const SignCheck& check, int next) {
    if (check.candidates.empty()) {
        std::printf("sign self-check: not possible (%s)\n", printable(check.why_not).c_str());
        return;
    }
    std::printf(
        "sign self-check against frame %d over %zu moving pixels (error without a warp "
        "%.4f):\n",
        next, check.pixels, check.still_error);
    for (const auto& candidate : check.candidates) {
        const std::string note = candidate.as_converted()       ? "as converted"
                                 : !check.told_apart(candidate) ? "same displacement"
                                                                : "";
        std::printf("  %-22s %.4f%s%s\n", candidate.text().c_str(), candidate.error,
                    note.empty() ? "" : "  <- ", note.c_str());
    }
    switch (check.verdict()) {
        case SignVerdict::confirmed:
            std::printf(
                "  confirmed: other sign combinations that differ have at least %.2f times "
                "the error\n",
                check.margin());
            return;
        case SignVerdict::undecided:
            std::printf("  undecided: no combination is clearly the best (margin %.2f)\n",
                        check.margin());
            return;
        case SignVerdict::contradicted:
            std::printf(
                "  the profile's signs are NOT the best: another combination has %.2f "
                "times their error\n",
                check.margin());
            return;
    }
}

int inspect_folder(const std::string& folder, bool json) {
    const auto found = io::scan_folder(folder);
    if (!found.ok()) return fail(found.status());
    Json list = Json::array();
    for (const auto& sequence : *found) {
        const std::vector<int>& frames = sequence.frames;
        if (json) {
            list.push_back({{"input", sequence.pattern},
                            {"first", frames.front()},
                            {"last", frames.back()},
                            {"frames", frames.size()},
                            {"missing", sequence.gaps}});
            continue;
        }
        std::string text = concat(sequence.pattern, ": ");
        if (frames.size() == 1)
            text += concat("frame ", frames[0]);
        else
            text += concat(frames.size(), " frames, ", frames.front(), " to ", frames.back());
        if (!sequence.gaps.empty())
            text += concat("; ", sequence.gaps.size(),
                           " missing: ", sequence::frames_text(sequence.gaps));
        std::printf("%s\n", printable(text).c_str());
    }
    if (json) print_line({{"folder", folder}, {"sequences", list}});
    return kExitOk;
}

// Range of visible distances, from the bounds of inverse depth; null = sky.
Json distances(const FrameBounds& bounds) {
    const auto distance = [](double inverse) { return inverse > 0 ? Json(1 / inverse) : Json(); };
    return {{"nearest", distance(bounds.max_inverse_depth)},
            {"farthest", distance(bounds.min_inverse_depth)}};
}

const RoleSet kLookedAt = {Role::inverse_depth, Role::motion, Role::motion_back};

Result<sequence::SourceFrame> look_at(const sequence::RunSettings& settings,
                                      const sequence::FrameHeader& header,
                                      sequence::Thumbnail& thumbnail) {
    return sequence::scan_source_frame(
        settings.source, header, kLookedAt, sequence::strip_rows(header),
        [&](const FramePlanes& planes, int first) {
            thumbnail.add(planes.at(Role::color), first, header.window.height());
        });
}

// Shows progress: on a terminal continuously, otherwise every ten seconds.
class LookedAt {
  public:
    explicit LookedAt(size_t total) : total_(total) {}
    ~LookedAt() { log::progress(""); }

    void say(size_t done) {
        const std::string text = concat("examined ", done, " of ", total_, " frames");
        log::progress(text);
        const auto now = std::chrono::steady_clock::now();
        if (log::progress_is_shown() || now - said_ < std::chrono::seconds(10)) return;
        said_ = now;
        log::info(text);
    }

  private:
    size_t total_;
    std::chrono::steady_clock::time_point said_ = std::chrono::steady_clock::now();
};

// Surveys every frame after the first. Returns the exit code of a stop signal, otherwise kExitOk.
int look_at_others(const sequence::RunSettings& settings, const io::FrameList& list,
                   sequence::SequenceSurvey& survey) {
    uint64_t bytes = 0;
    std::error_code error;
    for (const auto& [role, path] : list.files.begin()->second)
        if (const auto size = std::filesystem::file_size(path, error); !error) bytes += size;
    const std::vector<int> frames = sequence::frames_to_survey(list.frames, bytes);
    if (frames.size() < list.frames.size())
        log::info(concat("examines ", frames.size(), " of ", list.frames.size(),
                         " frames, evenly spaced, because all are more than 64 GiB; --frames RANGE "
                         "examines a whole range"));
    const StopOnSignal stop;
    LookedAt progress(frames.size());
    for (size_t i = 1; i < frames.size(); ++i) {
        if (stop.asked()) return stop.interrupted("run the same command again");
        const int frame = frames[i];
        const auto files = list.files.find(frame);
        auto header = files == list.files.end()
                          ? Result<sequence::FrameHeader>(
                                Status(StatusCode::input, "one of its files is not on disk"))
                          : sequence::open_source_frame(settings.source, files->second, frame);
        sequence::Thumbnail thumbnail;
        auto source = header.ok() ? look_at(settings, *header, thumbnail)
                                  : Result<sequence::SourceFrame>(header.status());
        if (source.ok())
            survey.add(frame, *source, thumbnail);
        else
            survey.add_failed(frame, source.status());
        progress.say(i + 1);
    }
    return kExitOk;
}

}  // namespace

int inspect_subcommand(const Options& options) {
    if (options.camera_metadata) {
        std::fputs(io::camera_attributes_as_markdown().c_str(), stdout);
        return kExitOk;
    }
    if (options.job.input.empty())
        return fail(Status(StatusCode::usage, "inspect: give a frame, a pattern or a folder"));
    std::error_code error;
    if (std::filesystem::is_directory(options.job.input, error))
        return inspect_folder(options.job.input, options.json);
    auto settings = run_settings_of(options);
    if (!settings.ok()) return fail(settings.status());
    io::set_exr_threads(threads_of(options));
    auto list = io::find_frames(settings->input, settings->frames);
    if (!list.ok()) return fail(list.status());
    // Without --frames the first frame is printed, and all are surveyed.
    std::vector<int> shown = list->frames;
    if (!settings->frames) shown.resize(std::min<size_t>(1, shown.size()));
    int code = kExitOk;
    sequence::SequenceSurvey survey;
    for (int frame : shown) {
        const auto files = list->files.find(frame);
        if (files == list->files.end()) {
            code = fail(Status(StatusCode::input,
                               settings->input.color().format(frame) + ": frame is not on disk"));
            continue;
        }
        auto opened = io::open_frame(files->second, frame);
        if (!opened.ok()) {
            survey.add_failed(frame, opened.status());
            code = fail(opened.status());
            continue;
        }
        Json json;
        for (const auto& [role, file] : opened->files)
            json["files"][name_of(role)] = describe_file(*file);
        std::set<std::string> printed;  // several planes may be in one file
        for (const auto& [role, file] : json["files"].items())
            if (!options.json && printed.insert(file["file"]).second) print_file(file);
        auto header = sequence::open_source_frame(settings->source, files->second, frame);
        sequence::Thumbnail thumbnail;
        auto source = header.ok() ? look_at(*settings, *header, thumbnail)
                                  : Result<sequence::SourceFrame>(header.status());
        if (!source.ok()) {
            survey.add_failed(frame, source.status());
            if (options.json) print_line(json);
            code = fail(source.status());
            continue;
        }
        survey.add(frame, *source, thumbnail);
        for (const auto& warning : source->warnings) log::warning(warning);
        const Camera& camera = source->description.camera;
        if (camera.metadata_focus_m && !camera.meters_per_unit)
            log::info(concat(source->input.files.color_file().path(), ": the focus is ",
                             *camera.metadata_focus_m,
                             " m; without meters_per_unit a scene unit is assumed "
                             "to be 1 m"));
        json["match"] = describe_roles(source->match);
        json["frame"] = describe_frame(source->description, source->input.window);
        json["camera_attributes"] = describe_attributes(header->camera_attributes);
        json["frame"]["memory_to_filter"] = sequence::bytes_text(
            sequence::frame_bytes(*header, sequence::planes_of(*header, kLookedAt), io::Keep::all,
                                  header->window.height()));
        sequence::add_findings(json, source->description.bounds, source->health,
                               source->surface_health);
        if (source->description.planes.has(Role::inverse_depth))
            json["frame"]["distance"] = distances(source->description.bounds);
        if (!options.json) {
            std::fputs(printable(source->match.text() + "\n", Lines::keep).c_str(), stdout);
            print_attributes(header->camera_attributes);
            for (const char* key : {"frame", "bounds", "health"}) print_values(json[key]);
        }
        std::map<Role, std::string> next_files;
        for (const auto& [role, pattern] : settings->input.patterns) {
            const auto all = pattern.discover();
            if (const auto next = all.find(frame + 1); next != all.end() && pattern.has_token())
                next_files[role] = next->second;
        }
        if (next_files.count(Role::color) && source->description.planes.has(Role::motion)) {
            auto next = sequence::open_source_frame(settings->source, next_files, frame + 1);
            auto check = next.ok() ? sequence::scan_signs(settings->source, *header, *next,
                                                          source->description.bounds.max_speed_px,
                                                          sequence::strip_rows(*header))
                                   : Result<SignCheck>(next.status());
            if (check.ok()) {
                json["sign_check"] = describe_signs(*check);
                if (!options.json) print_signs(*check, frame + 1);
            } else {
                log::warning("no sign self-check: " + check.status().message());
            }
        }
        if (options.json) print_line(json);
    }
    if (list->files.size() < 2 || list->frames.size() < 2) return code;
    if (!settings->frames)
        if (const int stopped = look_at_others(*settings, *list, survey); stopped != kExitOk)
            return stopped;
    if (!list->gaps.empty())
        log::warning(concat(settings->input.color().text(), ": frames missing in the sequence: ",
                            sequence::frames_text(list->gaps)));
    if (options.json)
        print_line({{"sequence", survey.json()}});
    else
        std::fputs(printable(survey.text(), Lines::keep).c_str(), stdout);
    return code == kExitOk && survey.failed() ? kExitSomeFailed : code;
}

}  // namespace postchain

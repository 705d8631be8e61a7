// postchain inspect: what a file contains, how it is interpreted, and whether its motion vectors
// have the profile's signs.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <set>

#include "chain/base/printable.h"
#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/inspect_frame.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain {
namespace {

using io::Json;

// Printable. A manifest may have megabytes: --json prints it whole.
std::string shortened(const std::string& value) {
    size_t shown = 300;
    if (value.size() <= shown) return printable(value);
    while (shown > 0 && (value[shown] & 0xc0) == 0x80) --shown;  // inside a character
    return concat(printable(value.substr(0, shown)), " ... (", value.size(),
                  " bytes; --json prints all)");
}

void print_attributes(const std::vector<io::FoundAttribute>& found) {
    if (found.empty()) std::printf("camera metadata: none\n");
    for (const auto& one : found) {
        const std::string what = one.gives.empty() ? "not used: " + one.why : "gives " + one.gives;
        std::printf("camera metadata: %s (%s, %s): %s\n", one.row->name, one.row->writer,
                    one.row->unit, shortened(what).c_str());
    }
}

// Attributes that the line of a part and those of its channels show.
const std::set<std::string> kShownAttributes = {
    "name", "type", "compression", "dataWindow", "displayWindow", "pixelAspectRatio", "channels"};

void print_file(const Json& file) {
    std::printf("%s: %llu bytes\n", printable(file["file"].get<std::string>()).c_str(),
                (unsigned long long)file["bytes"].get<uint64_t>());
    for (size_t i = 0; i < file["parts"].size(); ++i) {
        const auto& part = file["parts"][i];
        const auto word = [&](const char* key) { return shortened(part[key].get<std::string>()); };
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
                            shortened(value.get<std::string>()).c_str());
    }
}

// Prints "key: value" lines; nested objects as "key.key: value".
void print_values(const Json& values, const std::string& prefix = "") {
    for (const auto& [key, value] : values.items()) {
        if (value.is_object())
            print_values(value, prefix + key + ".");
        else
            std::printf(
                "%s%s: %s\n", prefix.c_str(), key.c_str(),
                printable(value.is_string() ? value.get<std::string>() : io::json_text(value))
                    .c_str());
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
                "  contradicted: another combination has %.2f times the error of the profile's "
                "signs; %s\n",
                check.margin(), check.remedy().c_str());
            return;
    }
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
    const std::vector<int> frames = sequence::frames_to_survey(list);
    if (frames.size() < list.frames.size())
        log::info(concat("examines ", frames.size(), " of ", list.frames.size(),
                         " frames, evenly spaced, because all are more than 64 GiB; --frames RANGE "
                         "examines a whole range"));
    const StopOnSignal stop;
    LookedAt progress(frames.size());
    const Status status = sequence::survey_others(settings, list, frames, survey, [&](size_t done) {
        progress.say(done);
        return !stop.asked();
    });
    return status.ok() ? kExitOk : stop.interrupted("run the same command again");
}

void print_folder(const Json& folder) {
    for (const Json& sequence : folder["sequences"]) {
        const int first = sequence["first"], last = sequence["last"];
        const size_t frames = sequence["frames"];
        std::string text = concat(sequence["input"].get<std::string>(), ": ");
        if (frames == 1)
            text += concat("frame ", first);
        else
            text += concat(frames, " frames, ", first, " to ", last);
        if (const std::vector<int> missing = sequence["missing"]; !missing.empty())
            text += "; " + sequence::gaps_text(missing);
        std::printf("%s\n", printable(text).c_str());
    }
}

void print_frame(const sequence::InspectedFrame& found, int frame) {
    if (found.json.contains("files")) {
        std::set<std::string> printed;  // several planes may be in one file
        for (const auto& [role, file] : found.json["files"].items())
            if (printed.insert(file["file"]).second) print_file(file);
    }
    if (!found.status.ok()) return;
    print_text(found.source->header.match.text() + "\n");
    print_attributes(found.source->header.camera_attributes);
    for (const char* key : {"frame", "bounds"}) print_values(found.json[key]);
    // Counts of what was found (input_...) are warnings where they matter.
    for (const auto& [key, value] : found.json["health"].items())
        if (!key.starts_with("input_") && value != 0)
            std::printf("%s: %s\n", key.c_str(), io::json_text(value).c_str());
    if (found.signs && found.signs->ok()) print_signs(**found.signs, frame + 1);
}

void log_notes(const sequence::InspectedFrame& found) {
    for (const auto& warning : found.source->warnings) log::warning(warning);
    const Camera& camera = found.source->description.camera;
    if (camera.metadata_focus_m && !camera.meters_per_unit)
        log::info(concat(color_path(found.source->header), ": the focus is ",
                         *camera.metadata_focus_m,
                         " m; without meters_per_unit a scene unit is assumed "
                         "to be 1 m"));
    if (found.signs && !found.signs->ok())
        log::warning("no sign self-check: " + found.signs->status().message());
}

// A warning; under --strict an error, and the exit code if nothing else fails.
void report_contradiction(const SignCheck& check, int frame, bool strict, Status& strict_fault) {
    const std::string text =
        concat("frame ", frame, ": the sign self-check contradicts the profile; ", check.remedy());
    if (!strict) return log::warning(text);
    strict_fault = Status(StatusCode::health, text);
    fail(strict_fault);
}

Result<int> inspect_subcommand(const Options& options) {
    if (options.camera_metadata) {
        std::fputs(io::camera_attributes_as_markdown().c_str(), stdout);
        return kExitOk;
    }
    if (options.job.input.empty())
        return Status(StatusCode::usage, "inspect: give a frame, a pattern or a folder");
    std::error_code error;
    if (std::filesystem::is_directory(options.job.input, error)) {
        for (const auto& [key, value] : sequence::given_values(options.job, builtin_passes()))
            if (key != "input")
                return Status(
                    StatusCode::usage,
                    concat(option_name(key),
                           ": has no effect on the list of a folder's sequences; name one "
                           "of them in place of ",
                           options.job.input, ", or leave the option out"));
        ASSIGN_OR_RETURN(const auto folder, sequence::inspect_folder(options.job.input));
        if (options.json)
            print_line(folder);
        else
            print_folder(folder);
        return kExitOk;
    }
    ASSIGN_OR_RETURN(auto settings, run_settings_of(options));
    io::set_exr_threads(sequence::threads_of(options.threads));
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
    // Without --frames the first frame is printed, and all are surveyed.
    std::vector<int> shown = list.frames;
    if (!settings.frames) shown.resize(std::min<size_t>(1, shown.size()));
    Status first_failure, contradicted;
    sequence::SequenceSurvey survey;
    FrameErrors errors;
    const auto failed = [&](int frame, const Status& status) {
        errors.add(frame, status);
        if (first_failure.ok()) first_failure = status;
    };
    for (int frame : shown) {
        const auto files = list.files.find(frame);
        if (files == list.files.end()) {
            failed(frame, sequence::absent_frame(frame, settings));
            continue;
        }
        const auto found = sequence::inspect_frame(settings, files->second, frame, survey);
        if (!options.json)
            print_frame(found, frame);
        else if (!found.json.is_null())
            print_line(found.json);
        if (!found.status.ok()) {
            failed(frame, found.status);
            continue;
        }
        log_notes(found);
        if (found.signs && found.signs->ok() &&
            (*found.signs)->verdict() == SignVerdict::contradicted)
            report_contradiction(**found.signs, frame, settings.strict, contradicted);
    }
    errors.finish();
    const auto code = [&] {
        return contradicted.ok() || !first_failure.ok()
                   ? exit_code(first_failure, survey.readable())
                   : exit_code(contradicted);
    };
    if (list.files.size() < 2 || list.frames.size() < 2) return code();
    if (!settings.frames)
        if (const int stopped = look_at_others(settings, list, survey); stopped != kExitOk)
            return stopped;
    if (!list.gaps.empty())
        log::warning(concat(settings.input.color().text(), ": ", sequence::gaps_text(list.gaps)));
    if (options.json)
        print_line({{"sequence", survey.json()}});
    else
        print_text(survey.text());
    return first_failure.ok() && survey.failed() ? kExitSomeFailed : code();
}

}  // namespace

RunSubcommand add_inspect(CLI::App& subcommand, Options& options) {
    add_settings(subcommand, job_parameters(), sequence::kInputGroup, &options.job);
    subcommand.add_flag("--json", options.json, "one JSON object per frame");
    add_confine(subcommand, options);
    subcommand.add_flag("--strict", options.job.strict,
                        "motion vectors that the sign self-check contradicts are an error");
    subcommand.add_flag("--camera-metadata", options.camera_metadata,
                        "print only a Markdown table of the camera attributes that are read");
    subcommand.get_option("--input")->required(false);
    subcommand.add_option("IN", options.job.input,
                          "frame or pattern, as for --input, or a folder, to list its sequences");
    return [&options] { return inspect_subcommand(options); };
}

}  // namespace postchain

#include "tools/sequence/settings/run_settings.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "chain/base/text.h"

namespace postchain::sequence {

namespace fs = std::filesystem;

RunSettings settings_for(RunSettings settings, const std::vector<const Chain*>& chains) {
    std::vector<std::string>& mattes = settings.source.layers.mattes;
    for (const Chain* chain : chains)
        for (const std::string& name : mattes_of(*chain))
            if (std::find(mattes.begin(), mattes.end(), name) == mattes.end())
                mattes.push_back(name);
    settings.source.layers.written = settings.exr;
    return settings;
}

const char* name_of(FrameStep step) {
    switch (step) {
        case FrameStep::read:
            return "read";
        case FrameStep::filter:
            return "filtered";
        case FrameStep::write:
            return "written";
    }
    return "";
}

std::string frames_text(const std::vector<int>& frames, size_t most) {
    std::string text;
    size_t shown = 0;
    for (size_t i = 0; i < frames.size(); ++shown) {
        if (shown == most) return text + ", ...";
        size_t last = i;
        while (last + 1 < frames.size() && frames[last + 1] == frames[last] + 1) ++last;
        text += concat(text.empty() ? "" : ", ", frames[i]);
        if (last > i) text += concat("-", frames[last]);
        i = last + 1;
    }
    return text;
}

std::string gaps_text(const std::vector<int>& gaps) {
    if (gaps.size() >= io::kMaxFrames)
        return concat("at least ", gaps.size(), " frames missing, from ", gaps[0], " on");
    return concat(gaps.size(), gaps.size() == 1 ? " frame" : " frames",
                  " missing: ", frames_text(gaps));
}

std::string absent_files(int frame, const RunSettings& settings) {
    std::string list;
    for (const auto& [role, pattern] : settings.input.patterns) {
        const std::string path = pattern.format(frame);
        std::error_code error;
        if (!settings.input.separate_files() || !fs::exists(path, error))
            list += (list.empty() ? "" : ", ") + path;
    }
    return list;
}

Status absent_frame(int frame, const RunSettings& settings) {
    return Status(StatusCode::input, absent_files(frame, settings) +
                                         ": frame is not on disk; render it, or leave it out");
}

namespace {

std::string missing_text(const std::vector<int>& frames, const RunSettings& settings) {
    return concat(absent_files(frames[0], settings),
                  ": requested frames are not on disk: ", frames_text(frames),
                  " ({missing=skip or hold} continues without them)"_keyed);
}

Status check_output_name(const RunSettings& settings) {
    const std::string extension = fs::path(settings.output.text()).extension().string();
    if (lower_case(extension) == ".exr" || io::image_format_of(settings.output.text()))
        return Status();
    return Status(StatusCode::usage, concat(settings.output.text(), ": outputs end in .exr, ",
                                            io::image_extensions()));
}

// With --watch, files are looked for later.
Result<io::FrameList> frames_to_come(const RunSettings& settings) {
    io::FrameList list;
    if (settings.frames)
        list.frames = settings.frames->frames;
    else if (!frames_are_unknown(settings))
        list.frames = {settings.input.color().literal_frame()};
    return list;
}

}  // namespace

bool frames_are_unknown(const RunSettings& settings) {
    return settings.watch && !settings.frames && settings.input.color().has_token();
}

Result<std::vector<FrameTask>> plan_tasks(const RunSettings& settings, bool writes,
                                          std::vector<int>& gaps) {
    if (writes) RETURN_IF_ERROR(check_output_name(settings));
    ASSIGN_OR_RETURN(auto list, settings.watch ? frames_to_come(settings)
                                               : io::find_frames(settings.input, settings.frames));
    if (settings.missing == MissingPolicy::hold && !settings.frames && !list.gaps.empty()) {
        if (list.gaps.size() >= io::kMaxFrames)
            return Status(
                StatusCode::usage,
                concat("{missing=hold}: more than "_keyed, io::kMaxFrames,
                       " frames are missing in the sequence; choose some with {frames}"_keyed));
        list.frames.insert(list.frames.end(), list.gaps.begin(), list.gaps.end());
        std::sort(list.frames.begin(), list.frames.end());
        list.missing = std::exchange(list.gaps, {});
    }
    list.keep(settings.chunk);
    gaps = list.gaps;
    const bool many = list.frames.size() > 1 || frames_are_unknown(settings);
    if (!list.missing.empty() && settings.missing == MissingPolicy::error)
        return Status(StatusCode::input, missing_text(list.missing, settings));
    if (writes && many && !settings.output.has_token())
        return Status(StatusCode::usage,
                      concat(settings.output.text(), ": the output name is the same for ",
                             list.frames.empty() ? "all" : std::to_string(list.frames.size()),
                             " frames; add #### to the name"));
    // A frame may be held from any frame on disk, requested or not, so that a part of a sequence
    // gives the same result as the whole.
    decltype(list.files) on_disk;
    if (!list.missing.empty() && settings.missing == MissingPolicy::hold)
        if (auto all = io::find_frames(settings.input, std::nullopt); all.ok())
            on_disk = std::move(all->files);
    std::vector<FrameTask> tasks;
    for (int frame : list.frames) {
        FrameTask task;
        task.frame = task.source = frame;
        if (writes) task.output = settings.output.format(frame);
        auto found = list.files.find(frame);
        if (found != list.files.end()) {
            task.files = found->second;
        } else if (!on_disk.empty()) {
            found = on_disk.upper_bound(frame);
            if (found != on_disk.begin()) --found;
            task.source = found->first;
            task.files = found->second;
        }
        tasks.push_back(std::move(task));
    }
    return tasks;
}

}  // namespace postchain::sequence

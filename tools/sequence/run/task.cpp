#include "tools/sequence/run/task.h"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace postchain::sequence {

namespace fs = std::filesystem;

std::string preview_path(const std::string& output) {
    return fs::path(output).replace_extension(".png").string();
}

std::string frames_text(const std::vector<int>& frames) {
    constexpr size_t kShown = 20;
    std::string list;
    for (size_t i = 0; i < frames.size() && i < kShown; ++i)
        list += (i ? ", " : "") + std::to_string(frames[i]);
    return frames.size() > kShown ? list + ", ..." : list;
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

Status check_none_exists(const std::vector<Task>& tasks, const RunSettings& settings) {
    size_t count = 0;
    std::string first;
    for (const Task& task : tasks) {
        for (const auto& path : {task.output, settings.preview ? preview_path(task.output) : ""}) {
            std::error_code error;
            if (path.empty() || !fs::exists(path, error)) continue;
            if (count++ == 0) first = path;
        }
    }
    if (count == 0) return Status();
    return Status(StatusCode::output,
                  concat(first, ": exists", count > 1 ? concat(", and ", count - 1, " more") : "",
                         " (choose --on-existing skip or overwrite)"));
}

namespace {

std::string missing_text(const std::vector<int>& frames, const RunSettings& settings) {
    return concat(absent_files(frames[0], settings), ": ", frames.size(),
                  " of the requested frames are not on disk: ", frames_text(frames),
                  " (--missing skip or hold continues without them)");
}

Status check_output_name(const RunSettings& settings) {
    std::string extension = fs::path(settings.output.text()).extension().string();
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
    if (extension == ".exr") return Status();
    return Status(StatusCode::usage, settings.output.text() +
                                         ": outputs are OpenEXR files; the name must end in .exr");
}

}  // namespace

Result<std::vector<Task>> plan_tasks(const RunSettings& settings, bool writes,
                                     std::vector<int>& gaps) {
    if (writes)
        if (Status status = check_output_name(settings); !status.ok()) return status;
    auto list = io::find_frames(settings.input, settings.frames);
    if (!list.ok()) return list.status();
    gaps = list->gaps;
    if (!list->missing.empty() && settings.missing == MissingPolicy::error)
        return Status(StatusCode::input, missing_text(list->missing, settings));
    if (writes && list->frames.size() > 1 && !settings.output.has_token())
        return Status(StatusCode::usage,
                      concat(settings.output.text(), ": one output name for ", list->frames.size(),
                             " frames; add #### to the name"));
    // A frame is held from what is on disk, asked for or not: a part of a sequence must give what
    // the whole gives.
    decltype(list->files) on_disk;
    if (!list->missing.empty() && settings.missing == MissingPolicy::hold)
        if (auto all = io::find_frames(settings.input, std::nullopt); all.ok())
            on_disk = std::move(all->files);
    std::vector<Task> tasks;
    for (int frame : list->frames) {
        Task task;
        task.frame = task.source = frame;
        if (writes) task.output = settings.output.format(frame);
        auto found = list->files.find(frame);
        if (found != list->files.end()) {
            task.files = found->second;
        } else if (!on_disk.empty()) {
            found = on_disk.upper_bound(frame);
            if (found != on_disk.begin()) --found;
            task.source = found->first;
            task.files = found->second;
        }
        for (const auto& [role, path] : task.files) {
            std::error_code error;
            if (writes && fs::equivalent(path, task.output, error))
                return Status(StatusCode::usage,
                              task.output +
                                  ": the output would replace its own input; name "
                                  "another file");
        }
        tasks.push_back(std::move(task));
    }
    if (writes && settings.on_existing == io::OnExisting::fail &&
        settings.on_error == ErrorPolicy::stop)
        if (Status status = check_none_exists(tasks, settings); !status.ok()) return status;
    return tasks;
}

namespace {

// A file cut off by a few bytes may still have a header whose chunks all begin inside it.
bool whole(io::ExrFile& file) {
    for (size_t part = 0; part < file.parts().size(); ++part)
        if (!file.parts()[part].deep && !file.read_part(int(part)).ok()) return false;
    return true;
}

}  // namespace

bool same_work_done(const Task& task, const std::string& work, const RunSettings& settings) {
    std::error_code error;
    if (settings.preview && !fs::exists(preview_path(task.output), error)) return false;
    auto existing = io::ExrFile::open(task.output);
    if (!existing.ok()) return false;
    bool same = false;
    for (const auto& part : existing->parts()) {
        const auto found = part.attributes.find("postchain");
        same |= found != part.attributes.end() && found->second == work;
    }
    if (!same || !settings.sidecar) return same && whole(*existing);
    std::ifstream file(task.output + ".json");
    const auto json = nlohmann::json::parse(file, nullptr, false);
    return json.is_object() && json.value("work", nlohmann::json()) == work &&
           json.value("output_bytes", nlohmann::json()) == existing->file_bytes();
}

std::string work_text(const Chain& chain, const RunSettings& settings, const FrameHeader& header,
                      const std::map<Role, std::string>& files, int frame) {
    std::string text = concat(chain.text(), camera_parameters().text(&header.camera), "\n",
                              name_of(settings.plan.precision), " frame ", frame, "\n");
    const auto& options = header.match.options;
    for (const auto* motion : {&options.motion, &options.motion_back})
        text += concat(int(motion->unit), " ", motion->scale_x, " ", motion->scale_y, " ",
                       motion->bias, " ", motion->sentinel, "\n");
    text += concat(int(options.depth), " ", options.unpremultiplied, " ",
                   int(settings.source.nonfinite_color), " ", int(settings.overflow), "\n");
    // Of the rules that are on by default only this one changes pixels.
    const std::set<std::string> rules = settings.plan.rules(chain);
    for (const auto& rule : settings.plan.rules_on)
        if (rules.count(rule)) text += rule + "\n";
    if (settings.source.cuts.count(frame) && rules.count(kRuleCameraCut)) text += "camera cut\n";
    for (const auto& [role, where] : header.assignment) {
        text += concat(postchain::name_of(role), " ", where.part);
        for (const auto& channel : where.channels) text += " " + channel;
        text += "\n";
    }
    for (const auto& [role, path] : files) {
        std::error_code error;
        const auto size = fs::file_size(path, error);
        const auto time = fs::last_write_time(path, error).time_since_epoch().count();
        text += concat(fs::path(path).filename().string(), " ", size, " ", time, "\n");
    }
    return concat("postchain ", settings.version, " chain ", hex_of(chain.hash()), " work ",
                  hex_of(hash_text(text)));
}

}  // namespace postchain::sequence

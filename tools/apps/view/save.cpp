#include "tools/apps/view/save.h"

#include <utility>

#include "tools/sequence/files/json.h"

namespace postchain::view {

io::OnExisting on_existing(bool replace) {
    return replace ? io::OnExisting::overwrite : io::OnExisting::fail;
}

Result<NewFile> new_file(const sequence::RunSettings& settings, const std::string& path,
                         const std::string& what, bool replace) {
    if (path.empty()) return Status(StatusCode::usage, what + ": give it a file name");
    io::OutputFiles files(on_existing(replace), "replace");
    for (const auto& [role, pattern] : settings.input.patterns) files.read(pattern, "the input");
    for (const io::InputFile& file : settings.other_inputs) files.read(file);
    files.write(io::OutputFile{path, what, "name another file"});
    RETURN_IF_ERROR(files.check());
    files.remove_left_temporaries();
    ASSIGN_OR_RETURN(const auto permitted, files.permit(path));
    ASSIGN_OR_RETURN(auto file, io::AtomicFile::create(path));
    return NewFile{std::move(file), permitted};
}

Status save_text(const sequence::RunSettings& settings, const std::string& path,
                 const std::string& text, const std::string& what, bool replace) {
    ASSIGN_OR_RETURN(auto made, new_file(settings, path, what, replace));
    RETURN_IF_ERROR(made.file.write(text.data(), text.size()));
    return made.file.commit(made.on_existing).status();
}

Result<std::string> camera_with_focus(const std::string& camera, const Camera& values,
                                      const std::map<int, double>& focus) {
    io::Json json = io::Json::object();
    if (camera.empty()) {
        for (const Parameter& row : camera_parameters().rows())
            if (const ParameterValue value = row.get(&values);
                row.key != "focus_distance" && value != ParameterValue())
                json[row.key] = io::json_of(value);
    } else {
        auto read = io::read_json(camera, "", io::kReportLimits);
        if (!read.ok() || !read->is_object())
            return Status(StatusCode::input,
                          "the camera file is not JSON, so that its keys cannot be edited; "
                          "convert it to JSON");
        json = std::move(*read);
    }
    io::Json& frames = json["frames"];
    if (!frames.is_object()) frames = io::Json::object();
    std::map<std::string, io::Json*> given;
    for (auto& [frame, own] : frames.items()) given[frame] = &own;
    io::Json added = io::Json::object();
    for (const auto& [frame, distance] : focus) {
        const auto found = given.find(std::to_string(frame));
        if (found != given.end())
            (*found->second)["focus_distance"] = distance;
        else
            io::append(added, std::to_string(frame), {{"focus_distance", distance}});
    }
    for (auto& [frame, own] : added.items()) io::append(frames, frame, std::move(own));
    return io::json_text(json, 1) + "\n";
}

}  // namespace postchain::view

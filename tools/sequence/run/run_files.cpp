#include "tools/sequence/run/run_files.h"

#include <algorithm>
#include <map>
#include <set>

#include "chain/base/stop.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/planes/cryptomatte.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/settings/job_settings.h"

namespace postchain::sequence {
namespace {

class StageNames {
  public:
    StageNames(const Chain& chain, const std::vector<FrameTask>& tasks) {
        for (size_t i = 0; i < chain.links.size(); ++i)
            starts_.push_back(concat(i, ".", chain.links[i].type->name, "."));
        for (const FrameTask& task : tasks) ends_.insert(stage_path("", "", task.frame));
    }
    bool operator()(const std::string& name) const {
        for (const std::string& start : starts_) {
            if (!name.starts_with(start)) continue;
            // "0.fxaa.luma.0001.exr": the frame's part, from this dot, is the same for all stages.
            const size_t dot = name.rfind('.', name.size() - 5);
            return ends_.count("/" + name.substr(dot)) > 0;
        }
        return false;
    }

  private:
    std::vector<std::string> starts_;
    std::set<std::string> ends_;
};

// Whether the file name is that of an image, sidecar or preview of any frame.
bool is_output_name(const std::string& name, const RunSettings& settings) {
    const std::string sidecar_end = sidecar_path("");
    if (settings.output.match(name)) return true;
    if (settings.sidecar && name.ends_with(sidecar_end) &&
        settings.output.match(name.substr(0, name.size() - sidecar_end.size())))
        return true;
    if (!settings.preview) return false;
    const auto preview = io::PathPattern::parse(io::preview_path(settings.output.text()));
    return preview.ok() && preview->match(name);
}

// Manifests of cryptomattes that frames name. They are read if a matte is made from ids, or ids are
// chosen by name.
void read_manifests(const Chain& chain, const RunSettings& settings,
                    const std::vector<FrameTask>& tasks, io::OutputFiles& files) {
    const auto mattes = mattes_of(chain);
    if (settings.source.layers.ids.empty() &&
        std::none_of(mattes.begin(), mattes.end(), is_matte_of_ids))
        return;
    const std::map<int, std::string> on_disk = settings.input.color().discover();
    std::set<int> opened;
    for (const FrameTask& task : tasks) {
        for (int frame : {task.source - 1, task.source, task.source + 1}) {
            if (is_stopped() || !on_disk.contains(frame) || !opened.insert(frame).second) continue;
            const auto file = io::open_pixels(on_disk.at(frame));
            if (!file.ok()) continue;
            const auto cryptomattes = io::find_cryptomattes(**file, io::Manifests::not_read);
            if (!cryptomattes.ok()) continue;
            for (const io::Cryptomatte& one : *cryptomattes)
                if (!one.manifest_file.empty())
                    files.read({one.manifest_file, "the manifest of cryptomatte " + one.name});
        }
    }
}

}  // namespace

std::string stage_path(const std::string& folder, const std::string& stage, int frame) {
    char number[32];
    std::snprintf(number, sizeof(number), ".%04d.exr", frame);
    return folder + "/" + stage + number;
}

std::vector<std::string> outputs_of(const FrameTask& task, const RunSettings& settings) {
    std::vector<std::string> paths = {task.output};
    if (settings.sidecar) paths.push_back(sidecar_path(task.output));
    if (settings.preview) paths.push_back(io::preview_path(task.output));
    return paths;
}

void read_inputs(const RunSettings& settings, io::OutputFiles& files) {
    for (const auto& [role, pattern] : settings.input.patterns)
        files.read(pattern, role == Role::color           ? "the input"
                            : role == Role::inverse_depth ? "the depth"
                            : role == Role::behind        ? "the layer behind"
                                                          : concat("the ", name_of(role)));
    for (const auto& file : settings.other_inputs) files.read(file);
}

io::OutputFiles files_of_run(const Chain& chain, const RunSettings& settings,
                             const std::vector<FrameTask>& tasks) {
    io::OutputFiles files(settings.on_existing, "skip or overwrite");
    read_inputs(settings, files);
    read_manifests(chain, settings, tasks, files);
    const std::string other = "name another output with {output}"_keyed;
    for (const FrameTask& task : tasks) {
        if (is_stopped()) break;
        const std::string of = concat(" of frame ", task.frame);
        files.write(io::OutputFile{task.output, "the output" + of, other});
        if (settings.sidecar)
            files.write(io::OutputFile{sidecar_path(task.output), "the sidecar" + of,
                                       "go without it ({sidecar=false}), or "_keyed + other});
        if (settings.preview)
            files.write(io::OutputFile{io::preview_path(task.output), "the preview" + of,
                                       "go without {png}, or "_keyed + other});
    }
    if (frames_are_unknown(settings))
        files.write(io::OutputFamily{
            settings.output.folder(),
            [settings](const std::string& name) { return is_output_name(name, settings); },
            "an output", other});
    if (!settings.dump_folder.empty())
        files.write(io::OutputFamily{settings.dump_folder, StageNames(chain, tasks), "a stage",
                                     "name another folder with {dump_stages}"_keyed});
    return files;
}

}  // namespace postchain::sequence

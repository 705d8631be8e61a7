// postchain scene: renders a generated sequence.
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "config/camera_file.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/scenes/scene.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain {
namespace {

struct SceneOptions {
    std::string name;
    std::string folder;
    std::string size = "640x360";
    std::string frames = "1-8";
    int truth_samples = 0;
    std::string truth = "all";
    bool behind = false;
    bool deep = false;
    io::OnExisting on_existing = io::OnExisting::fail;
    Camera camera;  // overrides the scene's
};

// "generated scene: wheels (...), poles (...)"
std::string help_of_scenes() {
    std::string text;
    for (const auto& scene : scenes::scenes())
        text += (text.empty() ? "" : "; ") + scene.name + ": " + scene.help;
    return text;
}

Result<int> scene_subcommand(const Options& options, const SceneOptions& scene) {
    scenes::SceneRequest request;
    request.name = scene.name;
    request.folder = scene.folder;
    request.truth_samples = scene.truth_samples;
    if (scene.truth != "all")
        std::erase_if(request.truths,
                      [&](scenes::Picture truth) { return scene.truth != scenes::name_of(truth); });
    request.behind = scene.behind;
    request.deep = scene.deep;
    request.camera = scene.camera;
    request.on_existing = scene.on_existing;
    ASSIGN_OR_RETURN(const auto size, parse_size(scene.size));
    request.width = size[0];
    request.height = size[1];
    ASSIGN_OR_RETURN(auto range, io::FrameRange::parse(scene.frames).at("--frames"));
    request.frames = std::move(range.frames);
    resolve_files(request.camera, "");
    io::ApertureFiles pictures;
    RETURN_IF_ERROR(pictures.read(request.camera).at("--aperture-image"));
    RETURN_IF_ERROR(scenes::model_for(request).status());

    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto context, choose_device(options));
    ASSIGN_OR_RETURN(auto renderer, scenes::SceneRenderer::create(context));
    const Status status =
        scenes::write_scene(*renderer, request, [&](const scenes::SceneProgress& progress) {
            char percent[16];
            std::snprintf(percent, sizeof(percent), "%.0f %%", 100 * progress.done);
            log::progress(concat("frame ", progress.frame, " ", scenes::name_of(progress.picture),
                                 ", ", percent));
            return !stop.asked();
        });
    log::progress("");
    if (stop.asked())
        return stop.interrupted(
            "the scene is incomplete; run the same command again with --on-existing overwrite");
    RETURN_IF_ERROR(status);
    log::info(concat(request.frames.size(),
                     request.frames.size() == 1 ? " frame of " : " frames of ", scene.name,
                     " written to ", scene.folder));
    return kExitOk;
}

}  // namespace

std::vector<std::string> scene_names() {
    std::vector<std::string> names;
    for (const auto& scene : scenes::scenes()) names.push_back(scene.name);
    return names;
}

RunSubcommand add_scene(CLI::App& subcommand, Options& options) {
    const auto scene = std::make_shared<SceneOptions>();
    subcommand.add_option("NAME", scene->name, help_of_scenes())->required();
    subcommand
        .add_option("-o,--output", scene->folder, "output folder; created if it does not exist")
        ->type_name("DIR")
        ->required();
    subcommand.add_option("--size", scene->size, "width x height in pixels")->capture_default_str();
    subcommand.add_option("--frames", scene->frames, "frames to render")->capture_default_str();
    subcommand
        .add_option("--truth-samples", scene->truth_samples,
                    "samples over shutter and lens of each ground truth; 0 = none")
        ->check(number_within(CLI::Range(0, 1 << 20)))
        ->capture_default_str();
    std::vector<std::string> truths = {"all"};
    for (const scenes::Picture truth : scenes::SceneRequest().truths)
        truths.push_back(scenes::name_of(truth));
    subcommand
        .add_option("--truth", scene->truth,
                    "ground truth that is written: mb of the shutter, dof of the lens, both")
        ->check(CLI::IsMember(truths))
        ->capture_default_str();
    subcommand.add_flag("--behind", scene->behind,
                        "also render the layer behind, for run --behind");
    subcommand.add_flag("--deep", scene->deep,
                        "also write deep files with the frame and the layer behind");
    add_on_existing(subcommand, "if an output file exists", scene->on_existing);
    add_settings(subcommand, camera_parameters(), "", &scene->camera);
    add_device(subcommand, options);
    return [&options, scene] { return scene_subcommand(options, *scene); };
}

}  // namespace postchain

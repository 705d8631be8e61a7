// postchain-view: the program that `postchain view` starts.
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/program.h"
#include "tools/apps/common/state.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/apps/view/window.h"
#include "tools/scenes/scene.h"
#include "tools/sequence/source/memory.h"

namespace postchain {
namespace {

constexpr std::string_view kScene = "scene:";

struct ViewOptions {
    std::string truth;
    std::string other;
    std::string shaders;
    std::string state_file;
    std::optional<int> frame;  // empty: the first
    double ui_scale = 0;
    std::string size = "1280x800";
};

// A generated scene, rendered into a folder that lives as long as this.
class RenderedScene {
  public:
    ~RenderedScene() {
        std::error_code ignored;
        if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
    }
    // Replaces input and camera by the scene's files. Errors: those of write_scene().
    Status render(Options& options, const egl::ContextOptions& context,
                  const std::atomic<bool>& stop) {
        std::string name = (std::filesystem::temp_directory_path() / "postchain-view-XXXXXX");
        if (!mkdtemp(name.data()))
            return Status(StatusCode::output, name + ": folder of the scene cannot be created");
        folder_ = name;
        scenes::SceneRequest request;
        request.name = options.job.input.substr(kScene.size());
        request.folder = folder_ + "/scene";
        request.frames = {1, 2, 3, 4, 5, 6};
        request.sharp_samples = 1;  // `gbuf` is shown
        RETURN_IF_ERROR(scenes::model_for(request).status());
        ASSIGN_OR_RETURN(auto renderer, scenes::SceneRenderer::create(context));
        options.job.input = request.folder + "/gbuf.####.exr";
        if (options.job.camera.empty()) options.job.camera = request.folder + "/camera.json";
        const Status status =
            scenes::write_scene(*renderer, request, [&](const scenes::SceneProgress& progress) {
                log::progress(concat("rendering ", request.name, ", frame ", progress.frame));
                return !stop;
            });
        log::progress("");
        return status;
    }

  private:
    std::string folder_;
};

Result<view::SessionSettings> session_of(const Options& options, const ViewOptions& view,
                                         const egl::ContextOptions& context) {
    view::SessionSettings session;
    session.context = context;
    ASSIGN_OR_RETURN(auto text, find_chain(options.chain));
    ASSIGN_OR_RETURN(auto chain, load_chain_of(options));
    session.open = {.name = options.chain,
                    .text = text.text,
                    .is_file = !text.shipped,
                    .sets = options.sets,
                    .chain = std::move(chain.chain),
                    .recovery_folder = ""};
    Options with_view = options;
    with_view.job.preview = true;  // uses the view of previews
    ASSIGN_OR_RETURN(session.run, run_settings_of(with_view));
    session.run.preview = false;
    if (session.open.is_file) session.run.other_inputs.push_back({options.chain, "the chain file"});
    if (session.run.source.max_memory == 0)
        session.run.source.max_memory = sequence::default_memory_limit();
    if (!view.truth.empty()) {
        Options truth = options;
        truth.job.input = view.truth;
        truth.job.camera = truth.job.profile = truth.job.view_layer = truth.job.view = "";
        ASSIGN_OR_RETURN(session.truth, run_settings_of(truth).at("--truth"));
    }
    if (!view.other.empty()) {
        Options other = options;
        other.chain = view.other;
        ASSIGN_OR_RETURN(auto loaded, load_chain_of(other));
        session.other = std::move(loaded.chain);
    }
    if (!view.shaders.empty()) {
        if (!std::filesystem::is_directory(view.shaders))
            return Status(
                StatusCode::usage,
                "--shaders: " + view.shaders + ": is not a folder; name that of the GLSL sources");
        // The executor reads it when it is made.
        setenv("POSTCHAIN_SHADER_DIR", view.shaders.c_str(), 1);
        session.shaders = view.shaders;
    }
    session.frame = view.frame;
    if (const std::string state = state_folder(); !state.empty())
        session.open.recovery_folder = state + "/view";
    return session;
}

// The settings with other files, which are the open ones from then on.
Result<view::SessionSettings> session_with(const view::OpenRequest& request, Options& options,
                                           ViewOptions& view, const egl::ContextOptions& context) {
    Options changed = options;
    ViewOptions changed_view = view;
    if (!request.chain.empty()) {
        changed.chain = request.chain;
        changed.sets.clear();
    }
    if (!request.input.empty()) {
        changed.job.input = request.input;
        // These belong to the former frames.
        changed.job.frames = changed.job.behind = "";
        changed_view.truth = "";
        changed_view.frame.reset();
    }
    if (!request.camera.empty()) changed.job.camera = request.camera;
    if (!request.truth.empty()) changed_view.truth = request.truth;
    ASSIGN_OR_RETURN(auto session, session_of(changed, changed_view, context));
    options = std::move(changed);
    view = std::move(changed_view);
    return session;
}

Result<int> view_subcommand(Options& options, ViewOptions& view) {
    ASSIGN_OR_RETURN(const auto context, choose_device(options));
    const StopOnSignal stop;
    RenderedScene scene;
    if (options.job.input.starts_with(kScene)) {
        const Status status = scene.render(options, context, stop.flag());
        if (stop.asked()) return stop.exit_code();
        RETURN_IF_ERROR(status);
    }
    ASSIGN_OR_RETURN(auto session, session_of(options, view, context));
    ASSIGN_OR_RETURN(const auto size, parse_size(view.size));
    const auto opener = [&](const view::OpenRequest& request) {
        return session_with(request, options, view, context);
    };
    RETURN_IF_ERROR(view::show_window(std::move(session), opener,
                                      {size, view.ui_scale, view.state_file}, stop.flag()));
    return stop.asked() ? stop.exit_code() : kExitOk;
}

RunSubcommand add_view(CLI::App& subcommand, Options& options) {
    const auto shared = std::make_shared<ViewOptions>();
    ViewOptions& view = *shared;
    add_chain(subcommand, options);
    for (const char* group : {sequence::kInputGroup, sequence::kPlanGroup})
        add_settings(subcommand, job_parameters(), group, &options.job);
    for (const char* key : {"ocio_display", "ocio_view"})
        add_setting(subcommand, *job_parameters().find(key), &options.job);
    subcommand.add_option("-r,--truth", view.truth, "ground truth to compare with, as for --input")
        ->type_name("IN");
    subcommand.add_option("--beside", view.other, "another chain to compare with")
        ->type_name("CHAIN");
    subcommand
        .add_option("--shaders", view.shaders,
                    "folder with GLSL sources, compiled again after each change")
        ->type_name("DIR");
    subcommand.add_option("--frame", view.frame, "frame to begin with")
        ->check(number_within(CLI::Range(-io::kMaxFrameNumber, io::kMaxFrameNumber)))
        ->type_name("N");
    subcommand.add_option("--size", view.size, "width x height of the window")
        ->capture_default_str();
    subcommand
        .add_option("--ui-scale", view.ui_scale, "size of text and widgets (default: the screen's)")
        ->check(number_within(CLI::Range(0.5, 4.0)));
    subcommand
        .add_option("--state-file", view.state_file,
                    "JSON file with the viewer's state, for programs that drive it; written "
                    "again after each change")
        ->type_name("FILE");
    add_device(subcommand, options);
    return [&options, shared] { return view_subcommand(options, *shared); };
}

}  // namespace
}  // namespace postchain

int main(int argc, char** argv) {
    using namespace postchain;
    const Subcommand subcommands[] = {{"view", add_view, shipped_chains}};
    return run_program({"postchain-view", "Shows a sequence through a chain, and edits the chain.",
                        &kView, subcommands, "view"},
                       argc, argv);
}

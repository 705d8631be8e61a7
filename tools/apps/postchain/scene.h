// postchain scene: renders a generated sequence.
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

struct SceneOptions {
    std::string name;
    std::string folder;
    std::string size = "640x360";
    std::string frames = "1-8";
    int truth_samples = 0;
    bool behind = false;
    bool deep = false;
    io::OnExisting on_existing = io::OnExisting::fail;
    Camera camera;  // overrides the scene's
};
void add_scene(CLI::App& subcommand, Options& options, SceneOptions& scene);
int scene_subcommand(const Options& options, const SceneOptions& scene);

}  // namespace postchain

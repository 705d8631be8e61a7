// Files of generated scenes, 160 x 90 pixels: frames 1 to 3, their layers behind, both as deep
// files, and the ground truth of frame 2. They are rendered when the first of them is asked for.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tools/scenes/scene.h"

namespace postchain::sequence {

inline void render_scene(const std::string& name, const std::string& folder,
                         const std::vector<int>& frames, int truth_samples) {
    auto renderer = scenes::SceneRenderer::create();
    scenes::SceneRequest request;
    request.name = name;
    request.folder = folder;
    request.width = 160;
    request.height = 90;
    request.behind = request.deep = truth_samples == 0;
    request.on_existing = io::OnExisting::overwrite;
    request.frames = frames;
    request.truth_samples = truth_samples;
    EXPECT_TRUE(renderer.ok() && scenes::write_scene(**renderer, request).ok()) << name;
}

inline std::string rendered_once(const std::string& scene, const std::string& name,
                                 const std::vector<int>& frames, int truth_samples) {
    static const test::TempFolder folder;
    const std::string path = folder.path(concat(scene, truth_samples > 0 ? "_truth" : ""));
    // A renderer makes a context current: on a thread of its own, the executor's stays current
    // here.
    if (!std::filesystem::exists(path))
        std::thread([&] { render_scene(scene, path, frames, truth_samples); }).join();
    return path + "/" + name;
}

inline std::string scene_file(const std::string& scene, const std::string& name) {
    return rendered_once(scene, name, {1, 2, 3}, 0);
}
inline std::string truth_file(const std::string& scene, const std::string& name) {
    return rendered_once(scene, name, {2}, 64);
}

}  // namespace postchain::sequence

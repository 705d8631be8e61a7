// Files of generated scenes, 160 x 90 pixels: frames 1 to 3, their layers behind, both as deep
// files, and for frame 2 the ground truth. A scene is rendered when its first file is asked for.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <thread>

#include "tests/support/temp_folder.h"
#include "tools/measure/scenes/scene.h"

namespace postchain::sequence {

inline void render_scene(const std::string& name, const std::string& folder) {
    auto renderer = scenes::SceneRenderer::create();
    scenes::SceneRequest request;
    request.name = name;
    request.folder = folder;
    request.width = 160;
    request.height = 90;
    request.behind = request.deep = true;
    request.on_existing = io::OnExisting::overwrite;
    request.frames = {1, 3};
    bool ok = renderer.ok() && scenes::write_scene(**renderer, request).ok();
    request.frames = {2};
    request.truth_samples = 64;
    ok = ok && scenes::write_scene(**renderer, request).ok();
    EXPECT_TRUE(ok) << name;
}

inline std::string scene_file(const std::string& scene, const std::string& name) {
    static const test::TempFolder folder;
    const std::string path = folder.path(scene);
    // A renderer makes a context current: on a thread of its own, the executor's stays current
    // here.
    if (!std::filesystem::exists(path)) std::thread([&] { render_scene(scene, path); }).join();
    return path + "/" + name;
}

}  // namespace postchain::sequence

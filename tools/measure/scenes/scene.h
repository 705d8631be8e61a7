// The generated scenes of `postchain scene`: sequences with depth, vectors and truth, without any
// renderer at hand.
//
//   NAME -> SceneModel -> SceneRenderer -> DIR/gbuf, sharp [, mb, dof, both] .####.exr, camera.json
//                                          [, aperture.exr]
//
// Files follow the `cycles` convention (docs/frame.md); docs/scenes.md says what each plane holds.
// A picture depends on scene, size, frame number and sample counts alone, so that any split of a
// sequence gives identical pixels.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "chain/frame.h"
#include "tools/measure/scenes/renderer.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::scenes {

struct SceneInfo {
    std::string name;
    std::string help;  // one line
    SceneModel (*make)() = nullptr;
};
const std::vector<SceneInfo>& scenes();

struct SceneRequest {
    std::string name;    // of scenes()
    std::string folder;  // made when it is not there; its parent must be
    int width = 640;
    int height = 360;
    std::vector<int> frames = {1};
    int truth_samples = 0;   // per pixel of each truth; 0 = no truth
    int sharp_samples = 16;  // per pixel of `sharp`
    // f_stop, aperture, sensor_width_mm, near_clip, far_clip and shutter_frames replace the
    // scene's; focal_length_mm and focus_distance too, in every frame. The scenes are in meters: a
    // meters_per_unit other than 1 is a usage error. A picture of the aperture must be read.
    Camera camera;
    io::OnExisting on_existing = io::OnExisting::fail;  // or overwrite
};

enum class Picture {
    gbuf,   // one sample at the pixel's center, with depth and vectors
    sharp,  // the mean over the pixel: color and vectors; depth of the center, hard at silhouettes
    mb,     // truth of the shutter, pinhole; color only
    dof,    // truth of the lens, frozen; color only
    both,   // truth of shutter and lens; color only
};
const char* name_of(Picture picture);  // "gbuf"
bool is_truth(Picture picture);

// The scene with the request's camera laid over it. Errors (usage): unknown scene (its message
// lists them), camera values that are not above 0 (shutter_frames: below 0), blades beside a
// picture of the aperture.
Result<SceneModel> model_for(const SceneRequest& request);

// Focal length, focus and the rest, at one frame.
Camera camera_at(const SceneModel& model, double frame);

// Errors: those of model_for() and of SceneRenderer::render(); (usage): a truth of 0 samples.
Result<ScenePlanes> render_frame(SceneRenderer& renderer, const SceneRequest& request, int frame,
                                 Picture picture, const Progress& progress = {});

// Text of camera.json for these frames.
std::string camera_json(const SceneRequest& request, const SceneModel& model);

// What write_scene is at. Called before each picture and as it grows; false stops.
struct SceneProgress {
    int frame = 0;
    Picture picture = Picture::gbuf;
    double done = 0;  // of the whole request, 0..1
};
using SceneCallback = std::function<bool(const SceneProgress&)>;

// Renders and writes every picture, then the aperture's, if it has one, and camera.json. Errors:
// those of render_frame(); (output): folder or file cannot be written, naming it, or is there under
// OnExisting::fail (then nothing is rendered); (canceled): stopped by the callback.
Status write_scene(SceneRenderer& renderer, const SceneRequest& request,
                   const SceneCallback& callback = {});

}  // namespace postchain::scenes

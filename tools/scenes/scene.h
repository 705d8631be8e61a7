// The generated scenes of `postchain scene`: sequences with depth, motion vectors and ground truth,
// without an external renderer.
//
//   NAME -> SceneModel -> SceneRenderer -> DIR/gbuf, sharp [, behind] [, deep]
//                                          [, mb, dof, both] .####.exr,
//                                          camera.json [, aperture.exr]
//
// Files follow the `cycles` convention (docs/frame.md); docs/scenes.md describes each plane. An
// image depends only on scene, size, frame number and sample counts, so that any split of a
// sequence gives identical pixels.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "chain/frame/frame.h"
#include "tools/scenes/renderer.h"
#include "tools/scenes/scene_models.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::scenes {

enum class Picture {
    gbuf,    // one sample at the pixel center, with depth and motion vectors
    sharp,   // mean over the pixel: color and vectors; depth at the center, aliased
    behind,  // like sharp, without the object that each pixel's center shows: the layer behind
    deep,    // sharp and behind as samples of one deep file
    mb,      // ground truth of the shutter, pinhole; color only
    dof,     // ground truth of the lens, instantaneous; color only
    both,    // ground truth of shutter and lens; color only
};
const char* name_of(Picture picture);  // "gbuf"
bool is_truth(Picture picture);

struct SceneRequest {
    std::string name;    // a name from scenes()
    std::string folder;  // created if it does not exist; its parent must exist
    int width = 640;
    int height = 360;
    std::vector<int> frames = {1};
    int truth_samples = 0;  // per pixel of each ground truth; 0 = none
    std::vector<Picture> truths = {Picture::mb, Picture::dof, Picture::both};
    int sharp_samples = 16;  // per pixel of `sharp`
    bool behind = false;     // also `behind`, of as many
    bool deep = false;       // also `deep`, of both
    // f_stop, aperture, sensor_width_mm, near_clip, far_clip and shutter_frames replace the scene's
    // values; focal_length_mm and focus_distance do so in every frame. Scenes are in meters:
    // another meters_per_unit is a usage error. An aperture image must already be loaded.
    Camera camera;
    io::OnExisting on_existing = io::OnExisting::fail;  // or overwrite
};

// The scene with the request's camera. Errors (usage): unknown scene (the message lists the known
// ones), camera values not above 0 (shutter_frames: below 0), blades together with an aperture
// image.
Result<SceneModel> model_for(const SceneRequest& request);

Camera camera_at(const SceneModel& model, double frame);

// Planes of Picture::deep are those of `behind`. Errors: those of model_for() and
// SceneRenderer::render(); (usage): ground truth with 0 samples.
Result<ScenePlanes> render_frame(SceneRenderer& renderer, const SceneRequest& request, int frame,
                                 Picture picture, const Progress& progress = {});

std::string camera_json(const SceneRequest& request, const SceneModel& model);

// State of write_scene(). The callback runs before each image and during it; false stops.
struct SceneProgress {
    int frame = 0;
    Picture picture = Picture::gbuf;
    double done = 0;  // fraction of the whole request, 0..1
};
using SceneCallback = std::function<bool(const SceneProgress&)>;

// Renders and writes every image, then the aperture image if there is one, and camera.json. Errors:
// those of render_frame(); (output), with the name: a folder or file cannot be written, or exists
// under OnExisting::fail (then nothing is rendered); (canceled): stopped by the callback.
Status write_scene(SceneRenderer& renderer, const SceneRequest& request,
                   const SceneCallback& callback = {});

}  // namespace postchain::scenes

// Ray casts a SceneModel on the GPU, one image at a time.
//
//   model + time samples --poses in double--> pose sets, one per time sample
//   pose sets + bounds --cull--> objects of each 16x16 tile
//   sample points (time = (i+0.5)/N; lens and pixel: sample_points())
//   --render.comp, a few samples per dispatch--> sums --> mean
//
// A request always gives the same bits on one machine and driver.
#pragma once

#include <functional>
#include <memory>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "chain/egl/context.h"
#include "chain/plan/plan.h"
#include "tools/scenes/model.h"

namespace postchain::scenes {

struct RenderSettings {
    int width = 640;
    int height = 360;
    double time = 0;            // frames
    int samples = 1;            // per pixel; 1 without shutter and lens = pixel center
    double shutter_frames = 0;  // open time; 0 = instantaneous
    double shutter_center = 0;  // its center, frames after `time`
    bool lens = false;          // thin lens of the model's f-stop, otherwise pinhole
    bool vectors = false;       // also render depth and motion vectors
    bool behind = false;        // without the object that each pixel's center shows
    uint32_t seed = 0;          // seed of shutter and lens noise
};

struct ScenePlanes {
    ImageF color;    // 4 channels: premultiplied scene-linear Rec. 709, mean over the pixel
    ImageF depth;    // 1: along the view axis, scene units, 1e10 if no surface; last sample
    ImageF vectors;  // 4: pixels, +y up; previous - this, this - next; mean over the samples
};

// Called with the fraction done, 0..1; false stops with StatusCode::canceled.
using Progress = std::function<bool(double)>;

class SceneRenderer {
  public:
    // Makes a GL context and keeps it current. Errors: gl.
    static Result<std::unique_ptr<SceneRenderer>> create(const egl::ContextOptions& options = {});
    ~SceneRenderer();

    // Errors (usage): sizes or samples out of range; (gl): memory; (canceled).
    Result<ScenePlanes> render(const SceneModel& model, const RenderSettings& settings,
                               const Progress& progress = {});

    const gl::Device& device() const;

  private:
    SceneRenderer();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// Low-discrepancy points in the unit 4-cube: lens (x, y), pixel (x, y).
// Dimensions 1-2 of the Sobol sequence (a (0,2)-sequence), the better pair, go to the lens if there
// is one, otherwise to the pixel. The other pair is Roberts' R2 sequence (2018: multiples of 1/g
// and 1/g^2, g the plastic number), which shares no structure with it. All are shifted by half of
// 1/count, so that the Sobol points are centered; with time = (i+0.5)/count they form a Hammersley
// set. A single point is the pixel center.
std::vector<glm::vec4> sample_points(int count, bool lens);

// Renders the model; `vectors`, `lens`, `behind`: of the settings.
ProgramKey program_for(const SceneModel& model, bool vectors, bool lens, bool behind = false);

// Radius of the lens in scene units: f / (2 N), with the focal length in meters.
double lens_radius(double focal_length_mm, double f_stop);

// Diameter in pixels of the circle of confusion of a point at depth z:
// f^2/N |z - s| / (z s) width / sensor, all lengths in meters.
double circle_of_confusion_px(double focal_length_mm, double f_stop, double sensor_width_mm,
                              double focus_distance, double z, int width);

}  // namespace postchain::scenes

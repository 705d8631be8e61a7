// Shared by the pass benchmarks: a synthetic frame, planes on the device, order statistics.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "chain/base/status.h"
#include "chain/frame/frame.h"
#include "chain/gl/executor.h"
#include "chain/gl/texture_pool.h"
#include "chain/plan/plan.h"
#include "tests/bench/arguments.h"

namespace postchain::bench {

// Ends the program if it is an error.
void require(const Status& status);

template <class T>
T require(Result<T> result) {
    require(result.status());
    return std::move(*result);
}

struct BenchFrame {
    FrameDescription description;
    FramePlanes planes;  // color, inverse_depth, motion
    double still = 0;    // fraction of the pixels
};

// All surfaces have waves and bars, so that FXAA finds edges. Color values fit in half, like those
// of most files.
//
// Still sky, ground of which the right half moves, and a disc in front, in focus, that turns by 60
// px a frame at its rim. The camera's pan adds `pan_px` to x of all vectors.
BenchFrame make_frame(int width, int height, double pan_px = 0);

// The frames that games show most of the time, with no known bounds. Motion scales with the width.
enum class Scene {
    third_person,  // the camera pans slowly; a figure in focus, far blur of 2 px radius
    race,          // the camera drives forward, fast; no lens
    dialog,        // a head in focus, one in front of it and the wall behind blurred by 20 to 40 px
    menu           // nothing moves, all is sharp
};
inline constexpr std::array<std::pair<Scene, const char*>, 4> kScenes = {
    {{Scene::third_person, "third person"},
     {Scene::race, "race"},
     {Scene::dialog, "dialog"},
     {Scene::menu, "menu"}}};
BenchFrame make_frame(int width, int height, Scene scene);

struct Settings {
    int width;
    int height;
    int iterations;
};
inline constexpr const char* kSettingsUsage = "[--size=WIDTHxHEIGHT] [--iterations=N]";
Settings take_settings(Arguments& arguments, int iterations);

// A frame's planes as textures, each in the requested format; uploaded once per format.
class DevicePlanes {
  public:
    explicit DevicePlanes(const FramePlanes& planes) : planes_(planes) {}
    unsigned texture(Role role, Format format);
    // The plan's imports, in the formats it states.
    std::map<Role, unsigned> inputs_of(const Plan& plan);

  private:
    const FramePlanes& planes_;
    gl::TexturePool pool_;
    std::map<std::pair<Role, Format>, unsigned> textures_;
};

// Adds a separate pass of one dispatch that copies the input's color.
void add_copy(Plan& plan, int width, int height);

// The times of the last run, after waiting for the device.
std::vector<PassTime> finished_times(Executor& executor);

// CPU time of all threads of this process in milliseconds; varies less than wall-clock time if
// other programs run.
double cpu_milliseconds();

double quantile(std::vector<double> values, double q);

// Renderer and number of threads, for the head of a table.
std::string device_text(const gl::Device& device);

}  // namespace postchain::bench

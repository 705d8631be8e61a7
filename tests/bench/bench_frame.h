// What the benchmarks of passes share: synthetic frames, planes on the device, order statistics.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/frame.h"
#include "chain/gl/executor.h"
#include "chain/gl/texture_pool.h"
#include "chain/plan.h"
#include "chain/status.h"

namespace postchain::bench {

// Prints and ends the program: a benchmark has no caller to report to.
[[noreturn]] void fail(const std::string& text);
void require(const Status& status);

template <class T>
T require(Result<T> result) {
    require(result.status());
    return std::move(*result);
}

struct BenchFrame {
    FrameDescription description;
    FramePlanes planes;  // color, inverse_depth, motion
    double still = 0;    // share of the pixels
};

// Sky above; ground; a disc in front, in focus. Everything carries waves and bars, so that FXAA
// finds edges. Color values are such as a half holds, as those of most files are.
//
//   mixed       the sky is still, the ground moves in its right half alone, the disc turns, 60 px a
//               frame at its rim
//   still       nothing moves
//   pan         everything moves by (24.3, -7.1) px
//   highlights  as mixed, with points of radiance 20 to 30000, and the ground at 1/1000
//   glare       as highlights, with points up to 300000: more than a half holds
const std::vector<std::string>& scenes();
BenchFrame make_frame(const std::string& scene, int width, int height);

// What the programs take on the command line.
struct Settings {
    int width = 1280;
    int height = 720;
    int iterations;    // runs or pairs
    std::string only;  // part of a row's name; empty = all
};
// Takes --size=WIDTHxHEIGHT, --iterations=N and --only=PART_OF_NAME out of the arguments; what is
// left is for other readers.
Settings take_settings(int& argc, char** argv, int iterations);
// The same, for programs that know no other argument.
Settings parse_settings(int argc, char** argv, int iterations);

// A frame's planes as textures, each in the format asked for; uploaded once per format.
class DevicePlanes {
  public:
    explicit DevicePlanes(const FramePlanes& planes) : planes_(planes) {}
    unsigned texture(Role role, Format format);
    // What the plan imports, in the formats it states.
    std::map<Role, unsigned> inputs_of(const Plan& plan);

  private:
    const FramePlanes& planes_;
    gl::TexturePool pool_;
    std::map<std::pair<Role, Format>, unsigned> textures_;
};

// Adds one dispatch that copies the input's color, as a pass of its own.
void add_copy(Plan& plan, int width, int height);

// The times of the last run, once the device has run past them.
std::vector<PassTime> finished_times(Executor& executor);

// CPU time of all threads of this process, milliseconds: varies less than the wall clock where
// other programs run.
double cpu_milliseconds();

double quantile(std::vector<double> values, double q);

// Renderer and number of threads, as a line for the head of a table.
std::string device_text(const gl::Device& device);

}  // namespace postchain::bench

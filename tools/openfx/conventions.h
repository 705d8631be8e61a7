// The meaning of channels of clips: motion vectors, depth and mattes, in the words of the profiles
// (config/profile.h) and of the encodings of depth (chain/frame/convert.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/frame/convert.h"
#include "tools/openfx/host.h"

namespace postchain::openfx {

// A meaning of motion vectors, by which writer or what they are.
struct MotionMeaning {
    std::string name;  // the choice
    std::string help;
    MotionConvention forward;
    std::optional<MotionConvention> back;
    int forward_at = 0;  // first of its two channels
    int back_at = 2;
};
const std::vector<MotionMeaning>& motion_meanings();

// Names of the choices of the parameters below.
inline constexpr const char* kMotionMeaning = "motion_meaning";
inline constexpr const char* kMotionChannels = "motion_channels";
inline constexpr const char* kMotionScale = "motion_scale";
inline constexpr const char* kDepthMeaning = "depth_meaning";
inline constexpr const char* kDepthChannel = "depth_channel";
inline constexpr const char* kMatteChannel = "matte_channel";
const std::vector<std::string>& motion_channel_names();
const std::vector<std::string>& depth_meaning_names();
const std::vector<std::string>& channel_names();

// The conventions of one frame.
struct Conventions {
    const MotionMeaning* meaning = nullptr;
    ConvertOptions options;  // with `motion_scale`, and at a proxy's size
    int forward_at = 0;
    int back_at = -1;  // -1: no vectors of that direction
    int depth_at = 0;
    int matte_at = 3;
    enum class Normalized { no, near_is_0, near_is_1 } normalized = Normalized::no;

    std::string text() const;  // of the parts that motion vectors depend on
};

// Those that the values of an effect's parameters state. Error (chain): Values::choice().
// `scale_x`, `scale_y`: of the render.
Result<Conventions> read_conventions(const Values& values, double scale_x, double scale_y);

}  // namespace postchain::openfx

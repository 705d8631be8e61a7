// The canonical frame: the description of one frame besides its pixels.
//
// Every input is converted once, at the border (chain/frame/convert.h), into the planes of
// chain/frame/role.h. No pass ever sees another convention. Described in docs/frame.md.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/parameter.h"
#include "chain/frame/bokeh_kernel.h"
#include "chain/frame/role.h"

namespace postchain {

// True for an inverse depth (1/scene units) of the sky, and of the distances that writers use for
// it (1e9 and more).
inline constexpr bool is_infinitely_far(float inverse_depth) {
    return inverse_depth <= 1e-9f;
}

// Where the frame's own time lies in the time that the shutter is open.
enum class ShutterPosition { start, center, end };
inline const std::vector<std::string>& shutter_position_names() {
    static const std::vector<std::string> names = {"start", "center", "end"};
    return names;
}

// Lens, shutter and clip planes of one frame. A member without a value is unknown; code
// that needs it reports an error or applies the stated default. Lengths in millimeters or scene
// units as named.
struct Camera {
    std::optional<double> focal_length_mm;
    std::optional<double> sensor_width_mm;
    std::optional<double> f_stop;
    std::optional<double> focus_distance;             // scene units, along the view axis
    std::optional<double> near_clip;                  // scene units
    std::optional<double> far_clip;                   // scene units
    std::optional<double> shutter_frames;             // open time in frames
    std::optional<ShutterPosition> shutter_position;  // default: center
    std::optional<double> meters_per_unit;
    // The aperture as seen in a highlight behind the focus; before the focus it is turned by half a
    // turn. Unset: a disc. An image replaces blades and their curvature.
    std::optional<int> aperture_blades;  // below 3: a disc
    BokehKernel aperture_image;
    std::optional<double> aperture_rotation_deg;  // counterclockwise
    std::optional<double> aperture_curvature;     // curvature of the blades: 0 straight .. 1 a disc
    std::optional<double> aperture_ratio;         // height over width
    std::optional<double> cats_eye;  // how far the lens barrel cuts into it in the corners, 0 .. 1
    // The focus of a file's metadata, meters. While no focus distance is stated, that is this one
    // in the scene units that are known.
    std::optional<double> metadata_focus_m;

    // This camera with every value that is set in `over` replaced by it. An image of the aperture
    // also replaces blades and curvature, and either of these an image.
    Camera overlaid_by(const Camera& over) const;
    // "key=value" of every row, canonical, for hashes; an image that was read is written as its
    // values.
    std::string text() const;
    bool operator==(const Camera&) const = default;
};

// The rows of Camera, from which chain file, --set, --help and schema are made.
const ParameterTable& camera_parameters();

inline constexpr double kDefaultShutterFrames = 0.5;
inline constexpr double kDefaultMetersPerUnit = 1.0;

using Place = std::array<double, 2>;  // x, y in the display window, fractions from the top left

// Facts that a plan may rest on: bounds over a frame's pixels, found while they are converted. They
// do not cover its neighbors' planes. A default-constructed object knows nothing, as in an engine
// that reads nothing back: then no rule applies by it.
struct FrameBounds {
    static constexpr double kUnknown = std::numeric_limits<double>::infinity();
    double max_speed_px = kUnknown;       // largest |motion|, pixels per frame
    double max_speed_back_px = kUnknown;  // largest |motion_back|
    double min_inverse_depth = 0;         // over all pixels, sky included
    double max_inverse_depth = kUnknown;
    std::map<Place, double> inverse_depth_at;  // at places that passes need (chain/pass/depth_at.h)
    std::array<double, 4> min_color = {-kUnknown, -kUnknown, -kUnknown, -kUnknown};  // RGBA
    std::array<double, 4> max_color = {kUnknown, kUnknown, kUnknown, kUnknown};
    bool one_color = false;        // all pixels have the same color, and no channel is -0
    bool color_is_half = false;    // a half holds every color value
    bool layers_are_half = false;  // and every value of the extra layers
    bool camera_cut = false;       // motion leads across a cut: said by the caller, never found

    // The largest length of a vector, pixels per frame.
    double fastest_px(bool with_back) const {
        return with_back ? std::max(max_speed_px, max_speed_back_px) : max_speed_px;
    }
};

// Largest speeds over a frame's pixels, each times the part of it outside a matte; pixels per
// frame.
struct Speeds {
    double px = 0;       // largest |motion|
    double back_px = 0;  // largest |motion_back|
};

// Faults of a frame's input. Counts are pixels.
struct InputHealth {
    uint64_t nonfinite_color = 0;  // replaced on conversion
    uint64_t nonfinite_depth = 0;
    uint64_t nonfinite_motion = 0;
    uint64_t sentinel_motion = 0;  // |component| >= the profile's sentinel, treated as 0
    uint64_t negative_depth = 0;   // d <= 0, treated as infinitely far
    bool motion_all_zero = false;  // a vectors channel without a single vector
    bool motion_in_0_1 = false;    // every stored component that is a vector lies in 0..1
    double fastest_stored_px = 0;  // largest |motion| of the file; that of the sky may be added
    // The largest distance that is not infinitely far, scene units; 0: no surface.
    double farthest_surface = 0;
    std::optional<std::array<int, 2>> first_nonfinite;  // x, y of the first in the planes

    uint64_t nonfinite() const { return nonfinite_color + nonfinite_depth + nonfinite_motion; }
};

enum class Precision { fp16, fp32 };  // storage of intermediate planes
const char* name_of(Precision precision);

// One frame, as a plan needs to know it.
struct FrameDescription {
    int width = 0;  // of the planes (the data window), pixels
    int height = 0;
    uint64_t pixels() const { return uint64_t(width) * uint64_t(height); }
    int display_width = 0;  // of the display window: W in every formula of the lens
    int display_height = 0;
    int origin_x = 0;  // of the planes' first pixel in the display window
    int origin_y = 0;
    double pixel_aspect = 1;  // width over height of a pixel on the display
    // Where the user gives values of the camera, for messages.
    // With the marks of "{camera}"_keyed, which would allocate for each frame.
    const char* camera_place =
        "by \uFDD0camera\uFDD1 (a file that Blender's add-on writes), or in the file's metadata";
    int frame_number = 0;   // seeds come from it
    RoleSet planes;         // which planes the frame brings, its neighbors' among them
    RoleSet not_converted;  // others that its files have and no pass needs
    int layers = 0;         // extra color layers: their number in the plane Role::layers
    int fill_layer = -1;    // which of them is the fill mask (chain/frame/layers.h); -1: none
    // Which of the mattes (the plane Role::mattes) holds for each pass of the chain, in its order;
    // -1, or beyond the end: no matte.
    std::vector<int> mattes;
    bool without_mattes = false;  // its passes run without those that they name
    // Largest speeds beside a matte, by its index, if they are known (chain/pass/matte.h).
    std::map<int, Speeds> speeds_beside;
    // Why a neighbor brings no planes: "frame 4 is not on disk".
    std::map<Neighbor, std::string> missing_neighbors;
    Camera camera;
    FrameBounds bounds;
    // Luminance weights of the file's primaries (Rec. 709 unless its chromaticities say otherwise).
    std::array<double, 3> luma_weights = {0.2126, 0.7152, 0.0722};
};

// The number of planes stacked in one of this role (is_stacked()); 0: it is a single plane.
int stacked_planes(Role role, const FrameDescription& frame);

// Planes of one frame on the CPU, all of one size; channels as channels_of(role) says. For a role
// that is_stacked(), one plane as wide as the frame, with the planes one below another
// (chain/frame/layers.h).
using FramePlanes = std::map<Role, ImageF>;

// Planes that frames share: the planes of one frame are `before` and `after` to others.
using SharedPlanes = std::map<Role, std::shared_ptr<const ImageF>>;

// A read-only view of either; valid as long as the planes exist.
class PlaneView {
  public:
    PlaneView() = default;
    PlaneView(const FramePlanes& planes) {
        for (const auto& [role, plane] : planes) planes_[role] = &plane;
    }
    PlaneView(const SharedPlanes& planes) {
        for (const auto& [role, plane] : planes) planes_[role] = plane.get();
    }
    // Null if there is none.
    const ImageF* find(Role role) const {
        const auto found = planes_.find(role);
        return found == planes_.end() ? nullptr : found->second;
    }
    const ImageF& at(Role role) const { return *planes_.at(role); }
    auto begin() const { return planes_.begin(); }  // of pairs: role, pointer
    auto end() const { return planes_.end(); }

  private:
    std::map<Role, const ImageF*> planes_;
};

}  // namespace postchain

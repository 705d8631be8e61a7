// Opens the files of one frame: matches their channels with a profile, finds layers, window and
// camera, and decides whether motion vectors are made from the camera. Reads headers only.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/camera_file.h"
#include "config/profile.h"
#include "config/profile_match.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/layers/frame_layers.h"
#include "tools/sequence/planes/camera_metadata.h"
#include "tools/sequence/planes/frame_reader.h"
#include "tools/sequence/source/camera_motion.h"

namespace postchain::sequence {

// Window to filter if a frame was cropped: its data window leaves out part of the display window.
enum class DataWindow {
    grow,  // data and display window; the written data window grows
    keep,  // only the data window; light that leaves it is lost
};

// The settings that need no conversion: a job's rows set them (settings/job_settings.h).
struct SourceChoices {
    std::string view_layer;  // empty = the only one
    std::string view;        // empty = the default one; kAllViews: FrameHeader::match
    NonfiniteColor nonfinite_color = NonfiniteColor::clamp;
    DataWindow data_window = DataWindow::grow;
    CameraMotion camera_motion = CameraMotion::missing;
};

struct SourceSettings : SourceChoices {
    std::optional<Profile> profile;  // none = detected from channel names
    bool behind = false;             // deep samples: those behind each pixel's surface
    bool all_views = false;          // kAllViews may be chosen
    std::optional<CameraFile> camera;
    std::set<int> cuts;  // frames that a camera cut follows
    // Pattern of neighboring frames, for their cameras.
    std::optional<io::PathPattern> color_frames;
    uint64_t max_memory = 0;                     // bytes for frames; 0 = no limit
    std::optional<io::Transfer> input_transfer;  // non-EXR images; none = as the file says
    LayerSettings layers;
};

struct FrameHeader {
    io::FrameFiles files;
    ProfileMatch match;           // its roles are read; at a cut they lack the vectors across it
    RoleSet to_read;              // planes, by the reader of a sequence (source/sequence_reader.h)
    io::Window window;            // the window that is filtered
    Camera camera;                // metadata overridden by the camera file
    Origins camera_origins;       // origins of the camera's values
    std::optional<SkyViews> sky;  // if matrices exist and motion vectors are made from them
    bool looked_for_cameras = false;  // in the files of the frames before and after
    bool sky_is_still = false;        // matrices exist, of a camera that neither turns nor zooms
    bool has_behind = false;          // a file of the layer behind is given, or color is deep
    bool motion_crosses_cut = false;  // and is not replaced by that of the other side
    bool makes_motion = false;        // all vectors are made from `sky`, replacing the file's
    std::optional<Zoom> zoom;         // to add to the file's motion vectors
    std::vector<io::FoundAttribute> camera_attributes;  // camera attributes of color's part
    FrameLayers layers;                                 // layers of color's file
    std::vector<std::string> warnings;                  // one line each
};

// `files` as in io::FrameList::files. Errors (input) name the file, what was looked for and found.
Result<FrameHeader> open_source_frame(const SourceSettings& settings,
                                      const std::map<Role, std::string>& files, int frame);
// Reads the headers of open files; `files.frame_number` is the frame.
Result<FrameHeader> header_of(const SourceSettings& settings, io::FrameFiles files);

const RoleChannels& color_channels(const FrameHeader& header);
const io::ExrPart& color_part(const FrameHeader& header);
// "shot.0001.exr", the file of color.
std::string color_path(const FrameHeader& header);

// The frame as a plan knows it from headers: sizes, number and camera.
FrameDescription describe(const FrameHeader& header);

// At most io::kMaxSide pixels a side, so it can be filtered.
bool fits(const io::Window& window);

// Roles that the frame can supply by itself: channels in its files, layers, mattes, generated
// motion.
RoleSet roles_in_files(const FrameHeader& header);

// The channels of a file, for messages: " R G B Z".
std::string names_in(const io::PixelFile& file);

}  // namespace postchain::sequence

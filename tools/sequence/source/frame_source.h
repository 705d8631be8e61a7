// Reads one frame of a sequence and converts it to a canonical frame.
//
//   files --open, match profile, camera--> FrameHeader     (headers only)
//   FrameHeader --read, convert--> SourceFrame        (pixels)
//
// All programs that read sequences use it: run, plan, inspect, diff and the reports.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/frame.h"
#include "chain/planner.h"
#include "config/camera_file.h"
#include "config/profile.h"
#include "config/profile_match.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/frame/camera_metadata.h"
#include "tools/sequence/frame/frame_reader.h"
#include "tools/sequence/layers/frame_layers.h"
#include "tools/sequence/source/edge_check.h"
#include "tools/sequence/source/sky_motion.h"

namespace postchain::sequence {

// Window to filter if a frame was cropped: its data window leaves out part of the display window.
enum class DataWindow {
    grow,  // data and display window; the written data window grows
    keep,  // only the data window; light that leaves it is lost
};

struct SourceSettings {
    std::optional<Profile> profile;  // none = detected from channel names
    bool behind = false;             // deep samples: those behind each pixel's surface
    std::string layer;               // empty = the only one
    std::string view;                // empty = the default one; kAllViews: FrameHeader::match
    bool all_views = false;          // kAllViews may be chosen
    std::optional<CameraFile> camera;
    NonfiniteColor nonfinite_color = NonfiniteColor::clamp;
    std::set<int> cuts;  // frames that a camera cut follows
    DataWindow data_window = DataWindow::grow;
    CameraMotion camera_motion = CameraMotion::missing;
    // Pattern of neighboring frames, for their cameras.
    std::optional<io::PathPattern> color_frames;
    uint64_t max_memory = 0;                     // bytes for frames; 0 = no limit
    std::optional<io::Transfer> input_transfer;  // of non-EXR images; none = as the file says
    LayerSettings layers;
};

struct FrameHeader {
    io::OpenFrame files;
    ProfileMatch match;
    io::ChannelAssignment assignment;
    io::Window window;                // the window that is filtered
    Camera camera;                    // metadata overridden by the camera file
    Origins camera_origins;           // of the camera's values
    std::optional<SkyViews> sky;      // if matrices exist and motion vectors are made from them
    bool looked_for_cameras = false;  // in the files of the frames before and after
    bool sky_is_still = false;        // matrices exist, of a camera that neither turns nor zooms
    bool has_behind = false;          // a file of the layer behind is given, or color is deep
    bool motion_crosses_cut = false;  // and is not replaced by that of the other side
    bool makes_motion = false;        // all vectors are made from `sky`, replacing the file's
    std::optional<Zoom> zoom;         // to add to the file's motion vectors
    std::vector<io::FoundAttribute> camera_attributes;  // of color's part
    FrameLayers layers;                                 // of color's file
    std::vector<std::string> warnings;                  // one line each
};

// `files` as in io::FrameList::files. Errors (input) name the file, what was looked for and found.
Result<FrameHeader> open_source_frame(const SourceSettings& settings,
                                      const std::map<Role, std::string>& files, int frame);
// The same for files that are open; `files.frame_number` is the frame.
Result<FrameHeader> header_of(const SourceSettings& settings, io::OpenFrame files);

// Surface statistics from depth and motion vectors, collected while a frame is read.
struct SurfaceHealth {
    MixedEdges mixed_edges;
    uint64_t clear_edges = 0;             // pixels, clear_edges.h
    uint64_t sky_without_motion = 0;      // pixels, sky_motion.h
    uint64_t sky_motion_from_camera = 0;  // pixels
    uint64_t motion_from_camera = 0;      // pixels
    uint64_t zoom_motion_added = 0;       // pixels
};

// The filtered cryptomattes of a frame, in the order of FrameLayers::cryptomattes.
struct FrameCryptomattes {
    io::Window window;
    std::vector<std::string> names;
    std::vector<io::RankedCoverage> ranks;
};

// Layers that are filtered without the neighbors that lack them (layers_apart.h).
struct LayersApart {
    std::vector<size_t> layers;  // indices into FrameLayers::filtered
    SharedPlanes planes;         // Role::layers, and those of the neighbors that have them
};

struct SourceFrame {
    io::InputFrame input;          // its planes have moved into `planes`, with input.window
    FrameDescription description;  // bounds and camera included
    SharedPlanes planes;           // canonical; neighbors' planes: source/sequence_reader.h
    InputHealth health;            // first_nonfinite in file coordinates
    SurfaceHealth surface_health;
    ProfileMatch match;
    Origins camera_origins;  // of description.camera
    FrameLayers layers;
    std::vector<LayersApart> layers_apart;  // layers not in `planes`
    // Empty if they stay as rendered.
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    std::map<Neighbor, std::shared_ptr<const FrameCryptomattes>> neighbor_cryptomattes;
    std::vector<SourceFrame> other_views;  // ProfileMatch::other_views of the same files
    ConvertOptions conversion;
    std::vector<std::string> warnings;
    Status strict_fault;  // what --strict says of the pixels that were read, neighbors' included
    double read_ms = 0;
    double convert_ms = 0;

    std::string first_nonfinite_text() const;  // "(12, -3)"
};

const io::ExrPart& color_part(const FrameHeader& header);

// At most io::kMaxSide pixels a side, so it can be filtered.
bool fits(const io::Window& window);

// Roles that the frame can supply by itself: channels in its files, layers, mattes, generated
// motion.
RoleSet roles_in_files(const FrameHeader& header);

// Planes to read for this chain: those that a plan without facts reads, as if all neighbors
// existed, and those that its neighbors read from it. If the chain cannot be planned, all planes
// that it could use; plan_source_frame() then reports why.
RoleSet planes_needed(const Chain& chain, const SourceSettings& settings, const FrameHeader& header,
                      const PlanOptions& options);

// Reads color and the available planes of `wanted`. Writing the frame back needs Keep::all.
Result<SourceFrame> read_source_frame(const SourceSettings& settings, FrameHeader header,
                                      RoleSet wanted, io::Keep keep);

// The description that is planned: with the chain's camera and the depths that its passes need.
FrameDescription planned_description(const Chain& chain, const SourceFrame& frame);

// make_plan() for this frame. Errors name the file and, if a plane is missing, the channel names
// looked for and found.
Result<Plan> plan_source_frame(const Chain& chain, const SourceFrame& frame,
                               const PlanOptions& options);

SharedPlanes shared(FramePlanes planes);

// Converts color back to the file's convention: undoes ConvertOptions::unpremultiplied. If alpha is
// 0, division is impossible: pixels that were clear in the file (`stored`) and received no light
// get their color back. Values that the chain did not change are those stored, bit for bit.
void to_file_convention(ImageF& color, const ConvertOptions& conversion, const ImageF& stored);
// to_file_convention() for a layer, which is stored like color; `color` holds its alpha.
void layer_to_file_convention(ImageF& layer, const ConvertOptions& conversion, const ImageF& color);

// Color in the convention of the file, for a frame read with Keep::all.
ImageF stored_color(const io::InputFrame& input);

}  // namespace postchain::sequence

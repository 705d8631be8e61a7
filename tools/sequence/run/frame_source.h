// One frame of a sequence, from its files to the canonical frame.
//
//   files --open, match profile, camera--> FrameHeader     (headers only)
//   FrameHeader --read, convert--> SourceFrame        (pixels)
//
// Everything that looks at a sequence goes through here: run, plan, inspect, diff and the reports.
#pragma once

#include <array>
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
#include "tools/sequence/run/edge_check.h"
#include "tools/sequence/run/frame_layers.h"
#include "tools/sequence/run/sky_motion.h"

namespace postchain::sequence {

// What is filtered of a frame whose data window leaves out a part of the display window (it was
// cropped to what is not clear).
enum class DataWindow {
    grow,  // data and display window: light leaves the data window, which is written larger
    keep,  // the data window alone: light that leaves it is lost
};

struct SourceSettings {
    std::optional<Profile> profile;  // none: detected from channel names
    std::string layer;               // empty: the only one
    std::string view;                // empty: the default one
    std::optional<CameraFile> camera;
    NonfiniteColor nonfinite_color = NonfiniteColor::zero;
    std::set<int> cuts;  // frames whose motion leads across a camera cut
    DataWindow data_window = DataWindow::grow;
    CameraMotion camera_motion = CameraMotion::missing;
    // Where a frame's neighbors are, for their cameras.
    std::optional<io::PathPattern> color_frames;
    uint64_t max_memory = 0;                     // bytes for frames; 0: no limit
    std::optional<io::Transfer> input_transfer;  // of pictures; none: as the file says
    LayerSettings layers;
};

// Headers, roles and camera of one frame.
struct FrameHeader {
    io::OpenFrame files;
    ProfileMatch match;
    io::ChannelAssignment assignment;
    io::Window window;                // that is filtered
    Camera camera;                    // metadata overlaid by the camera file
    Origins camera_origins;           // of its values
    std::optional<SkyViews> sky;      // where there are matrices, and vectors are made of them
    bool looked_for_cameras = false;  // in the files of the frames before and after
    bool makes_motion = false;        // every vector by `sky`, in place of the file's if any
    std::vector<io::FoundAttribute> camera_attributes;  // of the color's part
    FrameLayers layers;                                 // of color's file
    std::vector<std::string> warnings;                  // one line each
};

// `files` as in io::FrameList::files. Errors: input, with file, what was looked for and found.
Result<FrameHeader> open_source_frame(const SourceSettings& settings,
                                      const std::map<Role, std::string>& files, int frame);

// What depth and vectors say of surfaces, found when a frame is read.
struct SurfaceHealth {
    MixedEdges mixed_edges;
    uint64_t clear_edges = 0;             // pixels, clear_edges.h
    uint64_t sky_without_motion = 0;      // pixels, sky_motion.h
    uint64_t sky_motion_from_camera = 0;  // pixels
    uint64_t motion_from_camera = 0;      // pixels
};

// The cryptomattes of a frame that are filtered, in the order of FrameLayers::cryptomattes.
struct FrameCryptomattes {
    io::Window window;
    std::vector<std::string> names;
    std::vector<io::RankedCoverage> ranks;
};

// Layers that are filtered without the neighbors that lack them (layers_apart.h).
struct LayersApart {
    std::vector<size_t> layers;  // of FrameLayers::filtered
    SharedPlanes planes;         // Role::layers, and those of the neighbors that have them
};

struct SourceFrame {
    io::InputFrame input;          // its planes have moved into `planes`, of input.window
    FrameDescription description;  // bounds and camera included
    SharedPlanes planes;           // canonical; those of neighbors: run/sequence_reader.h
    InputHealth health;            // its first_nonfinite as in the file
    SurfaceHealth surface_health;
    ProfileMatch match;
    Origins camera_origins;  // of description.camera
    FrameLayers layers;
    std::vector<LayersApart> layers_apart;  // `planes` has the others
    // None where they stay as they are.
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    std::map<Neighbor, std::shared_ptr<const FrameCryptomattes>> neighbor_cryptomattes;
    ConvertOptions conversion;
    std::vector<std::string> warnings;
    Status strict_fault;  // what --strict says of the pixels that were read, neighbors' included
    double read_ms = 0;
    double convert_ms = 0;

    std::string first_nonfinite_text() const;  // "(12, -3)"
};

const io::ExrPart& color_part(const FrameHeader& header);

// What the frame can bring by itself: the roles that have channels in its files, layers and mattes,
// and motion that is made.
RoleSet roles_in_files(const FrameHeader& header);

// The planes to read for this chain: those that a plan reads of which no fact is known yet, of
// its neighbors too, as if they were there; and those that its neighbors would read of it. All that
// a chain could use where it cannot be planned; plan_source_frame() then says why.
RoleSet planes_needed(const Chain& chain, const SourceSettings& settings, const FrameHeader& header,
                      const PlanOptions& options);

// Reads color and those of `wanted` that the frame has. Keep::all is needed to write it back.
Result<SourceFrame> read_source_frame(const SourceSettings& settings, FrameHeader header,
                                      RoleSet wanted, io::Keep keep);

// The frame as its plan has it: with the camera of the chain and the depths that its passes ask
// for.
FrameDescription planned_description(const Chain& chain, const SourceFrame& frame);

// make_plan() for this frame. An error names the file and, for a plane that is missing, the
// channel names that were looked for and those that the file has.
Result<Plan> plan_source_frame(const Chain& chain, const SourceFrame& frame,
                               const PlanOptions& options);

SharedPlanes shared(FramePlanes planes);

// Color as the file wants it back: undoes ConvertOptions::unpremultiplied. Where alpha is 0
// nothing can be divided: what was clear in the file, `stored`, and has got no light, has its color
// again. What the chain left as it was is what is stored, to the bit.
void to_file_convention(ImageF& color, const ConvertOptions& conversion, const ImageF& stored);
// The same of a further layer, which is stored as color is: `color` has its alpha.
void layer_to_file_convention(ImageF& layer, const ConvertOptions& conversion, const ImageF& color);

// Color as the file of a frame that was read with Keep::all has it.
ImageF stored_color(const io::InputFrame& input);

}  // namespace postchain::sequence

// Reads one frame of a sequence and converts it to a canonical frame.
//
//   files --open_source_frame--> FrameHeader    headers only: source/frame_header.h
//   FrameHeader --decode, convert--> SourceFrame    pixels
//   SourceFrame --plan_source_frame--> Plan    source/frame_plan.h
//
// All programs that read sequences use it: run, plan, inspect, diff and the reports.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/frame/frame.h"
#include "tools/sequence/source/frame_header.h"
#include "tools/sequence/source/surface_edges.h"

namespace postchain::sequence {

// Times one step of the work.
using Clock = std::chrono::steady_clock;

inline double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Findings in the pixels of a frame, and the time that reading took.
struct FrameFindings {
    InputHealth health;  // first_nonfinite in file coordinates
    MixedEdgeCounts edges;
    uint64_t clear_edges = 0;             // pixels, surface_edges.h
    SkyCounts sky;                        // if it may need motion, camera_motion.h
    uint64_t sky_motion_from_camera = 0;  // pixels
    uint64_t motion_from_camera = 0;      // pixels
    uint64_t zoom_motion_added = 0;       // pixels
    bool half_depth = false;
    double read_ms = 0;
    double convert_ms = 0;

    std::string first_nonfinite_text() const;  // "(12, -3)"
};

// The filtered cryptomattes of a frame, in the order of FrameLayers::cryptomattes.
struct FrameCryptomattes {
    io::Window window;
    std::vector<std::string> names;
    std::vector<io::RankedCoverage> ranks;
};

// Layers that are filtered without the neighbors that lack them (neighbor_planes.h).
struct SeparateLayers {
    std::vector<size_t> layers;  // indices into FrameLayers::filtered
    SharedPlanes planes;         // Role::layers, and those of the neighbors that have them
};

struct SourceFrame {
    FrameHeader header;            // its warnings have moved into `warnings`
    FrameDescription description;  // describe(header), with planes and bounds
    SharedPlanes planes;           // canonical; neighbors' planes: source/sequence_reader.h
    io::StoredFrame stored;        // for the writer; its planes have become `planes`
    FrameFindings findings;
    std::vector<SeparateLayers> separate_layers;  // layers not in `planes`
    // Empty if they stay as rendered.
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    std::map<Neighbor, std::shared_ptr<const FrameCryptomattes>> neighbor_cryptomattes;
    std::vector<SourceFrame> other_views;  // ProfileMatch::other_views of the same files
    std::vector<std::string> warnings;
    Status strict_fault;  // what --strict says of the pixels that were read, neighbors' included
};

// Reads color and the available planes of `wanted`. Writing the frame back needs Keep::all.
Result<SourceFrame> read_source_frame(const SourceSettings& settings, FrameHeader header,
                                      RoleSet wanted, io::Keep keep);

// Color and the planes of `wanted` that the frame has.
RoleSet planes_of(const FrameHeader& header, RoleSet wanted);

// Rows per strip: about 64 MiB of color, depth and vectors, in whole blocks of lines or tiles.
int strip_rows(const FrameHeader& header);

// Receives the planes of each strip, starting at row `first`.
using StripObserver = std::function<void(const FramePlanes& planes, int first)>;

// Reads color of a frame, of which `rows` rows are in memory at a time. Returns the number of
// strips. Errors: those of read_source_frame().
Result<int> scan_source_frame(const SourceSettings& settings, const FrameHeader& header, int rows,
                              const StripObserver& observer);

// How much color differs between two images: the mean over blocks of 8 x 8 pixels, which have
// little noise, of the difference of their means, each value after x/(1 + x); 0 to 1.
double color_change(const ImageF& color, const ImageF& next);

// Of the edges along rows and columns that rise by a fifth as shown between two even sides, the
// part that does so from one pixel to the next: about 0.8 and more with one sample a pixel, 0.4 and
// less with many. Empty with too few edges.
std::optional<double> part_of_hard_edges(const ImageF& color);

// Why vectors seem to have another unit: all are far below a pixel, but color changes so much from
// frame to frame. Empty if they do not.
std::string doubt_of_speed(double max_speed_px, double change);

SharedPlanes shared(FramePlanes planes);

// Color in the convention of the file, for a frame read with Keep::all.
ImageF stored_color(const SourceFrame& frame);

// Color of one file for comparison and display, as the file has it, non-finite values included;
// premultiplied.
struct ColorFile {
    ImageF rgba;
    io::Window window;  // of `rgba`
    io::Window display_window;
    std::array<double, 3> luma_weights;
    std::string profile;
};

// Found by profile. Errors (input): no color, unreadable; (memory) two such images exceed the limit
// of `settings`.
Result<ColorFile> read_color(const SourceSettings& settings, const std::string& path, int frame);

}  // namespace postchain::sequence

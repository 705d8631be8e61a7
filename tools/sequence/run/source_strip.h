// Rows of one frame, read and converted, and what they show: frames that are only looked at are
// never in memory whole.
#pragma once

#include <cstdint>

#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// What the pixels of some rows show; of all rows one after the other, of the frame.
struct SourceFindings {
    FrameBounds bounds;
    InputHealth health;  // its first_nonfinite in the planes of the whole frame
    MixedEdgeCounts edges;
    uint64_t clear_edges = 0;
    uint64_t sky_motion_from_camera = 0;
    uint64_t motion_from_camera = 0;
    SkyCounts sky;
    bool half_depth = false;

    void add(const SourceFindings& next);
};

struct SourceStrip {
    io::InputFrame input;  // as read: rows that are looked at besides are in it too
    FrameDescription description;
    FramePlanes planes;  // canonical, rows first .. end - 1 of FrameHeader::window
    SourceFindings findings;
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    std::vector<std::string> warnings;
    double read_ms = 0;
    double convert_ms = 0;
};

// Those of `wanted` that the frame has, and color.
RoleSet planes_of(const FrameHeader& header, RoleSet wanted);

// Layers and mattes only of all rows. Errors: those of read_source_frame().
Result<SourceStrip> read_source_strip(const SourceSettings& settings, const FrameHeader& header,
                                      RoleSet present, io::Keep keep, int first, int end);

// Makes a frame of its last strip, whose findings are those of all: everything but planes and
// times. `header` is that of the strip.
void conclude(SourceFrame& frame, const SourceSettings& settings, FrameHeader header,
              SourceStrip strip);

}  // namespace postchain::sequence

// Reads and converts rows of one frame and analyzes them, so that frames are never in memory whole
// when only their findings are needed.
#pragma once

#include <cstdint>

#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Findings in the rows read so far; after all strips, those of the frame.
struct SourceFindings {
    FrameBounds bounds;
    InputHealth health;  // first_nonfinite in planes of the whole frame
    MixedEdgeCounts edges;
    uint64_t clear_edges = 0;
    uint64_t sky_motion_from_camera = 0;
    uint64_t motion_from_camera = 0;
    uint64_t zoom_motion_added = 0;
    SkyCounts sky;
    bool half_depth = false;

    void add(const SourceFindings& next);
};

struct SourceStrip {
    io::InputFrame input;  // as read, with extra rows for edge detection
    FrameDescription description;
    FramePlanes planes;  // canonical, rows first .. end - 1 of FrameHeader::window
    SourceFindings findings;
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    MatteFindings mattes;
    double read_ms = 0;
    double convert_ms = 0;
};

// Color and the planes of `wanted` that the frame has.
RoleSet planes_of(const FrameHeader& header, RoleSet wanted);

// Layers and mattes are read only if all rows are. Errors: those of read_source_frame().
Result<SourceStrip> read_source_strip(const SourceSettings& settings, const FrameHeader& header,
                                      RoleSet present, io::Keep keep, int first, int end);

// Fills a frame, except planes and times, from its last strip, which holds the findings of all
// strips. `header` is the strip's.
void conclude(SourceFrame& frame, const SourceSettings& settings, FrameHeader header,
              SourceStrip strip);

}  // namespace postchain::sequence

// Previews (one reduced frame through a chain) and thumbnails: the CPU part. The worker filters.
#pragma once

#include <string>

#include "chain/plan.h"
#include "tools/sequence/run/frame_source.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

struct PreparedPreview {
    Plan plan;
    SharedPlanes planes;
};
// Reads the request's frame with its neighbors and the chain's mattes, and reduces it: color and
// mattes by mean, depth and motion vectors by center pixel. Scales motion vectors and the passes'
// lengths in pixels. Errors: those of reading and planning.
Result<PreparedPreview> prepare_preview(JobRequest& request);

// The color of a file as 8-bit PNG, at most 320 pixels wide and high. Errors (input), (output).
Result<std::string> thumbnail_png(const std::string& path, int frame,
                                  const sequence::SourceSettings& settings);

}  // namespace postchain::service

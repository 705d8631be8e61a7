// One frame through a chain, reduced, and thumbnails: what is done on the CPU. Filtering stays with
// the worker.
#pragma once

#include <string>

#include "chain/image.h"
#include "chain/plan.h"
#include "tools/sequence/run/frame_source.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

// Of this size: each pixel is the mean of what it covers. Errors: none; 1 pixel at least.
ImageF mean_reduced(const ImageF& image, int width, int height);
// Each pixel is that in the middle of what it covers: values of one surface, never mixed.
ImageF middle_reduced(const ImageF& image, int width, int height);

struct PreparedPreview {
    Plan plan;
    SharedPlanes planes;
};
// Reads the request's frame with its neighbors and the chain's mattes, and reduces it: color and
// mattes by mean, depth and vectors by the middle, vectors and the passes' lengths in pixels by the
// scale. Errors: those of reading and planning.
Result<PreparedPreview> prepare_preview(JobRequest& request);

// The color of a file at most this wide and high, as 8-bit PNG. Errors (input), (output).
Result<std::string> thumbnail_of(const std::string& path, int frame,
                                 const sequence::SourceSettings& settings);

}  // namespace postchain::service

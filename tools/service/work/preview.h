// Previews (one reduced frame through a chain) and images of files: the CPU part. previews.h
// filters.
#pragma once

#include <string>

#include "chain/plan.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct PreparedPreview {
    Plan plan;
    SharedPlanes planes;
};
// Reads the request's frame with its neighbors and the chain's mattes, and reduces it: color and
// mattes by mean, depth and motion vectors by center pixel. Scales motion vectors and the passes'
// lengths in pixels. Errors: those of reading and planning.
Result<PreparedPreview> prepare_preview(JobRequest& request);

// The distance to the surface at each pixel of the request's frame, scene units, reduced like the
// preview; infinity in the sky. Errors (input): those of reading, or the frame has no depth.
Result<ImageF> distances_of(const JobRequest& request);

// The bytes of an image in the reply: a PNG, an EXR, or the values for a page (kPictureType).
Result<std::string> bytes_of(const ImageF& color, const std::string& type);
// The color of a file, reduced. Errors (input), (output).
Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageWanted& wanted);

}  // namespace postchain::service

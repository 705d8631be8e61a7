// The method `gilham`: its plan. Its double-precision reference is in gilham_reference.h.
#pragma once

#include "chain/pass.h"
#include "passes/common/circle_of_confusion.h"
#include "passes/depth_of_field/depth_of_field.h"

namespace postchain::depth_of_field {

// Sizes and widths that plan and reference both start from. The circle of confusion of parameters
// and frame must be known and checked.
struct GilhamSizes {
    int factor = 1;     // of the downsampling
    int low_width = 0;  // ceil(width / factor)
    int low_height = 0;
    double low_sigma = 0;     // of the Gaussian, pixels of the downsampled image
    int taps = 0;             // on one side: ceil(3 low_sigma)
    double full_blur_px = 1;  // max(2 blur_sigma_px, 1)
};
GilhamSizes gilham_sizes(const Parameters& parameters, const FrameDescription& frame);

// The Gaussian's taps on the copy, a box more for the bilinear taps, and the boxes themselves.
Reach gilham_reach(const Parameters& parameters, const FrameDescription& frame);

// Errors: StatusCode::chain when the kernel has more taps than the shader's table holds.
Status check_gilham(const Parameters& parameters, const FrameDescription& frame);
void plan_gilham(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                 PassPlanner& planner);
// Pass::shape and Pass::values of it.
ShapeNumbers gilham_shape(const Parameters& parameters, const PlanContext& context);
void write_gilham_values(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                         const PlanContext& context, UniformWriter& uniforms);

}  // namespace postchain::depth_of_field

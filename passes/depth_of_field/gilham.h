// The method `gilham`. Its double-precision reference is in gilham_reference.h.
#pragma once

#include <array>

#include "chain/pass/pass.h"
#include "passes/common/circle_of_confusion.h"
#include "passes/depth_of_field/depth_of_field.h"

namespace postchain::depth_of_field {

// Sizes and widths shared by plan and reference.
struct GilhamSizes {
    int factor = 1;             // of the downsampling
    int width = 0, height = 0;  // of the frame
    int low_width = 0;          // ceil(width / factor)
    int low_height = 0;
    // Along x and y: standard deviation of the Gaussian, pixels of the downsampled image; taps on
    // one side, ceil(3 low_sigma).
    std::array<double, 2> low_sigma = {};
    std::array<int, 2> taps = {};
    double full_blur_px = 1;  // max(2 blur_sigma_px, 1)

    Area low() const { return Area().in_squares(factor); }  // the downsampled image
};

// Errors: StatusCode::chain if the kernel has more taps than the shader's table holds.
Result<GilhamSizes> gilham_sizes(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                                 const FrameDescription& frame);
// One for each factor that a lens can lead to.
std::vector<GilhamSizes> every_gilham_size(const Parameters& parameters,
                                           const FrameDescription& frame);

// The pass on a frame, without its identity. Steps and textures: gilham.cpp.
class Gilham : public PassOnFrame {
  public:
    Gilham(const Parameters& parameters, const lens::CircleOfConfusion& coc,
           const FrameDescription& frame, const GilhamSizes& sizes)
        : parameters_(parameters), coc_(coc), frame_(frame), sizes_(sizes) {}

    // No exceeded limits: radii beyond two deviations of the Gaussian look the same, clamped or
    // not.
    std::vector<UsedValue> used_values() const override;
    Reach reach() const override;
    ShapeNumbers shape(const PlanContext& context) const override;
    void plan(PassPlanner& planner) const override;
    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override;
    void reference(const PlanContext& context, ReferenceFrame& frame) const override;

  private:
    const Parameters& parameters_;
    const lens::CircleOfConfusion coc_;
    const FrameDescription& frame_;
    const GilhamSizes sizes_;
};

}  // namespace postchain::depth_of_field

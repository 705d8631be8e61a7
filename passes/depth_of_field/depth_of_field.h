// Depth of field: parameters and pass type.
//
// Described in docs/depth_of_field.md. The method `gilham` is the documented core of D. Gilham,
// Real-Time Depth-of-Field Implemented with a Post-Processing only Technique, ShaderX5, 2006:
// signed circle of confusion, downsampled image, separable Gaussian, interpolation with the sharp
// image. Its kernel, tap counts and leak test are not public; ours are in gilham.cpp and
// docs/depth_of_field.md. The method `inverse_warp` is passes/inverse_warp/inverse_warp.h.
#pragma once

#include <optional>

#include "chain/pass/pass.h"
#include "passes/inverse_warp/inverse_warp.h"

namespace postchain::depth_of_field {

enum class Method { gilham, inverse_warp };
enum class Leak { none, depth, coc };  // neighbors that the Gaussian may mix in

struct Parameters : inverse_warp::Parameters {
    Parameters() {
        samples = 32;
        noise.noise = noise::Kind::ign;
    }

    Method method = Method::inverse_warp;

    std::optional<int> downsample;        // unset = from the Gaussian's width, gilham.cpp
    std::optional<double> blur_sigma_px;  // unset = from the lens, gilham.cpp
    Leak leak = Leak::coc;
    bool hdr_weight = false;
};

// Its own rule of elision, for blocks that the device finds.
inline constexpr const char* kRuleFocusBlocks = "focus_blocks";

const PassType& pass_type();

}  // namespace postchain::depth_of_field

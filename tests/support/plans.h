// Chains and planes of few words.
#pragma once

#include <initializer_list>

#include "tests/support/gpu.h"

namespace postchain::test {

// Passes of every_pass() with their defaults, in this order.
inline Chain chain_of(std::initializer_list<const char*> types) {
    Chain chain;
    for (const char* type : types) append(chain, type);
    return chain;
}

// Those that are not empty.
inline FramePlanes planes_of(ImageF color, ImageF inverse_depth = {}, ImageF motion = {}) {
    FramePlanes planes;
    if (!color.empty()) planes[Role::color] = std::move(color);
    if (!inverse_depth.empty()) planes[Role::inverse_depth] = std::move(inverse_depth);
    if (!motion.empty()) planes[Role::motion] = std::move(motion);
    return planes;
}

}  // namespace postchain::test

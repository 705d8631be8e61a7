// Which textures of a plan share storage. Pure.
#pragma once

#include <optional>
#include <vector>

#include "chain/plan/plan.h"

namespace postchain {

// The largest frame of a plan.
struct MaxFrameSize {
    int width = 0, height = 0;
    bool operator==(const MaxFrameSize&) const = default;
};

// One image of a texture.
struct ImageOf {
    int slice = 0;  // of an array
    int level = 0;
    bool operator==(const ImageOf&) const = default;
};

struct StoragePlan {
    std::vector<Storage> all;
    std::vector<int> of;  // of each of the plan's textures, an index into `all`; -1: it needs none

    uint64_t bytes() const;
    // The number of each texture's storage. One that needs none, as the host's, has its own number.
    std::vector<int> numbers() const;
};

// Textures take storage at their first step and give it back after their last, as if the steps ran,
// so that textures with disjoint lifetimes share. They give it back only where a step waits in any
// case: sharing must not make another step wait. With `max_size`, storage is as large as frames up
// to that size need.
StoragePlan share_storage(const Plan& plan, const std::optional<MaxFrameSize>& max_size = {});

}  // namespace postchain

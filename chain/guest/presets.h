// Presets that a host names by one word: chains ("tier:fast"), for hosts without a reader of chain
// files, and the depth and motion vector conventions of engines.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "chain/base/status.h"
#include "chain/guest/postchain.h"
#include "chain/pass/chain.h"

namespace postchain::guest {

struct Tier {
    const char* name;
    const char* help;
    struct Pass {
        const char* type;
        std::vector<std::pair<const char*, ParameterValue>> values = {};
    };
    std::vector<Pass> passes;
};

const std::vector<Tier>& tiers();
// Errors (chain): unknown name; the message lists the names.
Result<Chain> make_tier(std::string_view name, const PassRegistry& registry);

// Sets depth_encoding, flags of rows and vectors, motion_scale and motion_bias. False: unknown
// engine; the frame is unchanged. Reads width and height; if they are 0, those of color.
bool use_conventions(std::string_view engine, pc_frame& frame);

// Their names, separated by commas.
std::string engines_text();

}  // namespace postchain::guest

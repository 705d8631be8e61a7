// Everyday shots of many frames with exact ground truth, and what a chain makes of them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "chain/frame/frame.h"
#include "chain/pass/chain.h"
#include "tools/metrics/compare.h"

namespace postchain::test::stability {

struct ShotFrame {
    FramePlanes planes;  // with those of its neighbors
    FrameDescription description;
    ImageF truth;
};

struct Shot {
    std::string name;
    std::string what;
    int frames;
    std::function<ShotFrame(int frame)> at;
};

const std::vector<Shot>& shots();

// The frames of a shot, rendered once for all chains.
std::vector<ShotFrame> render(const Shot& shot);

struct Measured {
    // error, the rms of displayed values, error_still and so on; then temporal errors.
    std::vector<metrics::Values> frames;
    metrics::Values means;  // over the frames that have a value

    double mean(const std::string& name) const;  // 0 if there is none
};
Measured measure(const std::vector<ShotFrame>& frames, const Chain& chain);

Chain shipped_chain(const std::string& name);

}  // namespace postchain::test::stability

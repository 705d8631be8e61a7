// Decides before each band whether a run goes on, waits for other work on the device, or stops.
#pragma once

#include <functional>

namespace postchain {

// The largest of several answers counts.
enum class Turn {
    go_on,
    wait,  // other work has the device: ask again
    stop,
};

// Must return at once. Called on the thread of the run.
using ContinueCallback = std::function<Turn()>;

}  // namespace postchain

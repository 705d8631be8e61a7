// The question that a run asks before each of its bands: may I go on? A stop, and other work that
// needs the device, answer it.
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
using AskTurn = std::function<Turn()>;

}  // namespace postchain

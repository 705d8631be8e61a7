// postchain selftest: whether this build gives the right pictures on this machine and device.
//
//   each pass of the registry, and both orders, over the reduced stability matrix (fp32)
//     --> against the double-precision reference, equal bits when run again and without elision
//   a frame of random values --> an EXR in a new folder --> read back, bit for bit
#pragma once

#include <string>

#include "tools/apps/postchain/options.h"

namespace CLI {
class App;
}

namespace postchain {

void add_selftest(CLI::App& verb, Options& options, std::string& only);
// `only`: as stress::matches(), of the names of the tests. kExitHealth where a test fails, after
// the table; 6 without GL.
int selftest_verb(const Options& options, const std::string& only);

}  // namespace postchain

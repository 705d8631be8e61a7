// postchain selftest: checks that this build renders correct images on this machine and device.
//
//   each pass of the registry, and both orders, over the reduced stability matrix (fp32)
//     --> against the double-precision reference; bit-identical when repeated and without elision
//   a frame of random values --> an EXR in a new folder --> read back, bit for bit
#pragma once

#include <string>

#include "tools/apps/postchain/options.h"

namespace CLI {
class App;
}

namespace postchain {

void add_selftest(CLI::App& subcommand, Options& options, std::string& only);
// `only`: pattern for test names, as in stress::matches(). Returns kExitHealth, after the table, if
// a test fails; 6 without GL.
int selftest_subcommand(const Options& options, const std::string& only);

}  // namespace postchain

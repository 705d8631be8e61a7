// One GL context and executor per test process, and short forms to make and run chains.
#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <utility>

#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "passes/registry.h"

namespace postchain::test {

// The passes of this build, and those of tests/passes.
const PassRegistry& every_pass();

Executor& executor();  // made on first use; throws without GL

using Settings = std::initializer_list<std::pair<std::string, ParameterValue>>;

// Appends a pass of every_pass() with these parameters; a bad key or value fails the test.
void append(Chain& chain, const std::string& type, Settings settings = {});
Chain chain_of(const std::string& type, Settings settings = {});

// Every pass without elision, except steps that nothing reads. (PlanOptions::elide = false runs
// those too.)
PlanOptions whole_passes();

// For the device of executor().
PlanOptions on_device(PlanOptions options);

// Plans for that device and filters on it; a failure fails the test. The plan is returned through
// `plan`.
FramePlanes filter(const Chain& chain, const FrameDescription& frame, const FramePlanes& planes,
                   const PlanOptions& options = {}, Plan* plan = nullptr);

// Every stage the plan writes, by texture name ("0.motion_blur.tile_max"), and the outputs.
struct Stages {
    FramePlanes outputs;
    std::map<std::string, ImageF> stages;
};
Stages filter_with_stages(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, const PlanOptions& options = {});

// The chain's double-precision reference, with the stages of that plan; a failure fails the test.
ReferenceFrame reference(const Chain& chain, const FrameDescription& frame,
                         const FramePlanes& planes, const PlanOptions& options = {});

}  // namespace postchain::test

// postchain plan: what would run on each frame, what is left out and why.
#pragma once

#include <string>

#include "tools/apps/postchain/options.h"

namespace postchain {

struct PlanSettings {
    std::string format = "text";
    std::string calibration;  // path of a sidecar, empty = none
};
void add_plan(CLI::App& subcommand, Options& options, PlanSettings& plan);
int plan_subcommand(const Options& options, const PlanSettings& plan);

}  // namespace postchain

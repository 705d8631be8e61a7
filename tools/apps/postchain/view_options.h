// Options of `postchain view`, shared by the command, which checks them, and the viewer.
#pragma once

#include <optional>
#include <string>

#include "tools/apps/postchain/options.h"

namespace postchain {

struct ViewOptions {
    std::string truth;
    std::string other;
    std::string shaders;
    std::string state_file;
    std::optional<int> frame;  // empty: the first
    double ui_scale = 0;
    std::string size = "1280x800";
};

void add_view(CLI::App& subcommand, Options& options, ViewOptions& view);

}  // namespace postchain

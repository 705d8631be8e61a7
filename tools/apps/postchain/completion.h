// Generates man page and bash completion from the command's options and the parameter tables.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace postchain {

std::string man_page(const CLI::App& app);
std::string bash_completion(const CLI::App& app);

}  // namespace postchain

// postchain view: starts the program postchain-view, which links what a window needs.
#include "tools/apps/postchain/subcommands.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "tools/apps/postchain/log.h"

namespace postchain {
namespace {

// Replaces this process by postchain-view with the words after `view`. Returns only if that
// fails.
Status view_subcommand(const std::vector<std::string>& command_line) {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    const std::string program = (self.parent_path() / "postchain-view").string();
    std::vector<char*> words = {const_cast<char*>(program.c_str())};
    const auto view = std::find(command_line.begin() + 1, command_line.end(), "view");
    for (auto word = view + 1; word < command_line.end(); ++word)
        words.push_back(const_cast<char*>(word->c_str()));
    words.push_back(nullptr);
    execv(program.c_str(), words.data());
    return Status(StatusCode::gl,
                  concat(program, ": cannot be started (", std::strerror(errno),
                         "); install the package postchain-view, or the component view of a build "
                         "with GLFW, Dear ImGui and fontconfig (cmake --install "
                         "build --component view). The page of postchain serve needs only a "
                         "browser"));
}

}  // namespace

RunSubcommand add_view(CLI::App& subcommand, Options& options) {
    const auto view = std::make_shared<ViewOptions>();
    add_view_options(subcommand, options, *view);
    return [&options, view] { return view_subcommand(options.command_line); };
}

}  // namespace postchain

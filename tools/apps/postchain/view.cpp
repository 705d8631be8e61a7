#include "tools/apps/postchain/view.h"

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <vector>

#include "tools/apps/postchain/exit_code.h"

namespace postchain {

int view_subcommand(int argc, char** argv) {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    const std::string program = (self.parent_path() / "postchain-view").string();
    std::vector<char*> words = {const_cast<char*>(program.c_str())};
    bool after = false;
    for (int i = 1; i < argc; ++i) {
        if (after) words.push_back(argv[i]);
        after = after || std::strcmp(argv[i], "view") == 0;
    }
    words.push_back(nullptr);
    execv(program.c_str(), words.data());
    return fail(Status(StatusCode::gl,
                       concat(program, ": cannot be started (", std::strerror(errno),
                              "); install the package postchain-view, or build postchain with "
                              "libglfw3-dev and libimgui-dev. The page of postchain serve needs "
                              "only a browser")));
}

}  // namespace postchain

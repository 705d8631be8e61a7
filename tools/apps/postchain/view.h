// postchain view: starts the program postchain-view, which links what a window needs.
#pragma once

namespace postchain {

// Replaces this process by postchain-view with the words after `view`. Returns only if that fails:
// an exit code.
int view_subcommand(int argc, char** argv);

}  // namespace postchain

// The folder in which programs keep a user's state between runs.
#pragma once

#include <string>

namespace postchain {

// "$XDG_STATE_HOME/postchain", or in ~/.local/state; "" if neither variable is set.
std::string state_folder();

// False if a process of the user has asked for this name in the last 24 hours. Always true if the
// state folder cannot be written. `name`: a file's name.
bool first_today(const std::string& name);

}  // namespace postchain

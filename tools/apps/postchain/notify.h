// What a service tells the system that started it: sd_notify(3), without its library.
#pragma once

#include <string>

namespace postchain {

// Sends "READY=1" and the like to the socket that $NOTIFY_SOCKET names. False: there is none, or
// there is no listener.
bool notify_system(const std::string& state);

}  // namespace postchain

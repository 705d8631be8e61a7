// Notifies the service manager: sd_notify(3) without its library.
#pragma once

#include <string>

namespace postchain {

// Sends a state such as "READY=1" to the socket named by $NOTIFY_SOCKET. False if it is unset or
// no one listens.
bool notify_system(const std::string& state);

}  // namespace postchain

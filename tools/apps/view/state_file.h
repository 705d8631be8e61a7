// The viewer's state as JSON, for programs that drive it.
#pragma once

#include <string>

#include "tools/apps/view/ui.h"

namespace postchain::view {

std::string state_json(const Session& session, const Ui& ui);

}  // namespace postchain::view

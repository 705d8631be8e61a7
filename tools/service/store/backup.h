// A copy of a store, made while its service runs.
#pragma once

#include <string>

#include "chain/status.h"

namespace postchain::service {

// Copies the store to `file` in one consistent state, with the copying of SQLite, which does not
// disturb the service. Replaces an earlier backup. Errors (usage): `file` is another file than a
// backup; (output): the store cannot be read, or the copy not written.
Status back_up(const std::string& store, const std::string& file);

}  // namespace postchain::service

// The operations of the service, their queries, and the schemas that no table of fields has.
#pragma once

#include "tools/sequence/files/json.h"

namespace postchain::service {

// {"operations", "queries", "schemas"}, as interface.cpp describes them.
const io::Json& service_interface();

}  // namespace postchain::service

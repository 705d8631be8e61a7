#pragma once

#include "tools/sequence/files/json.h"

namespace postchain {

// One line of standard output, also if a reader waits for it. Text may contain invalid UTF-8.
void print_line(const io::Json& json);

}  // namespace postchain

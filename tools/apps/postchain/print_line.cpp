#include "tools/apps/postchain/print_line.h"

#include <cstdio>

namespace postchain {

void print_line(const io::Json& json) {
    std::printf("%s\n", io::json_text(json).c_str());
    std::fflush(stdout);
}

}  // namespace postchain

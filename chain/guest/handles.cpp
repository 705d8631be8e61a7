#include "chain/guest/handles.h"

namespace postchain::guest {

std::string& create_error() {
    thread_local std::string text;
    return text;
}

}  // namespace postchain::guest

#include "chain/status.h"

namespace postchain {

const char* name_of(StatusCode code) {
    switch (code) {
        case StatusCode::ok:
            return "ok";
        case StatusCode::usage:
            return "usage";
        case StatusCode::chain:
            return "chain";
        case StatusCode::input:
            return "input";
        case StatusCode::memory:
            return "memory";
        case StatusCode::output:
            return "output";
        case StatusCode::gl:
            return "gl";
        case StatusCode::health:
            return "health";
        case StatusCode::canceled:
            return "canceled";
        case StatusCode::internal:
            return "internal";
    }
    return "unknown";
}

Status Status::at(const std::string& place) const {
    if (ok()) return *this;
    return Status(code_, place + ": " + message_);
}

}  // namespace postchain

#include "chain/base/status.h"

#include <exception>
#include <new>

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

Status input_error(std::string message) {
    return Status(StatusCode::input, std::move(message));
}

Status input_error(const std::string& path, const std::string& what) {
    return input_error(path + ": " + what);
}

Status out_of_memory(const std::string& place) noexcept {
    try {
        return Status(StatusCode::memory, place + ": not enough memory");
    } catch (...) {
        return Status(StatusCode::memory, "out of memory");  // short enough to need no allocation
    }
}

Status status_of_exception(const std::string& place) noexcept {
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return out_of_memory(place);
    } catch (const std::exception& error) {
        try {
            return Status(StatusCode::internal, place + ": unexpected failure: " + error.what());
        } catch (...) {
            return out_of_memory(place);
        }
    } catch (...) {
        return Status(StatusCode::internal, "unknown failure");
    }
}

}  // namespace postchain

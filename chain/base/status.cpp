#include "chain/base/status.h"

#include <exception>
#include <iterator>
#include <new>

namespace postchain {

const char* name_of(StatusCode code) {
    static constexpr const char* kNames[] = {"ok",     "usage", "chain",  "input",    "memory",
                                             "output", "gl",    "health", "canceled", "internal"};
    static_assert(std::size(kNames) == size_t(StatusCode::internal) + 1);
    return kNames[size_t(code)];
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

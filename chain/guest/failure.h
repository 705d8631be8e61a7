// Success, or a result of the C interface with its text. A success allocates nothing.
#pragma once

#include <string>

#include "chain/base/status.h"
#include "chain/guest/postchain.h"

namespace postchain::guest {

struct [[nodiscard]] Failure {
    pc_result result = PC_OK;
    std::string text = {};

    Failure() = default;
    Failure(pc_result code, const std::string& message) : result(code), text(as_keys(message)) {}
    Failure(const Status& status) : Failure(result_of(status.code()), status.message()) {}

    bool ok() const { return result == PC_OK; }

  private:
    static pc_result result_of(StatusCode code) {
        switch (code) {
            case StatusCode::ok:
                return PC_OK;
            case StatusCode::usage:
                return PC_ERROR_ARGUMENT;
            case StatusCode::chain:
                return PC_ERROR_CHAIN;
            case StatusCode::input:
                return PC_ERROR_INPUT;
            case StatusCode::memory:
                return PC_ERROR_MEMORY;
            case StatusCode::gl:
                return PC_ERROR_GL;
            default:
                return PC_ERROR_INTERNAL;
        }
    }
};

}  // namespace postchain::guest

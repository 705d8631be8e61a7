// Success, or a result of the C interface with its text. A success allocates nothing.
#pragma once

#include <string>
#include <utility>

#include "chain/base/status.h"
#include "chain/guest/postchain.h"

namespace postchain::guest {

struct [[nodiscard]] Failure {
    pc_result result = PC_OK;
    std::string text = {};

    Failure() = default;
    Failure(pc_result code, std::string message) : result(code), text(std::move(message)) {}
    Failure(const Status& status) : result(result_of(status.code())), text(status.message()) {}

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

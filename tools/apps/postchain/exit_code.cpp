#include "tools/apps/postchain/exit_code.h"

#include "tools/apps/postchain/log.h"

namespace postchain {

int exit_code(const Status& status) {
    switch (status.code()) {
        case StatusCode::ok:
            return kExitOk;
        case StatusCode::usage:
            return kExitUsage;
        case StatusCode::chain:
            return kExitChain;
        case StatusCode::input:
        case StatusCode::memory:
            return kExitInput;
        case StatusCode::output:
            return kExitOutput;
        case StatusCode::gl:
            return kExitGl;
        case StatusCode::health:
            return kExitHealth;
        case StatusCode::canceled:
        case StatusCode::internal:
            return kExitSomeFailed;
    }
    return kExitSomeFailed;
}

int fail(const Status& status) {
    if (!status.message().empty()) log::error(status.message());
    return exit_code(status);
}

Status already_said(const Status& status) {
    return status.ok() ? status : Status(status.code(), "");
}

}  // namespace postchain

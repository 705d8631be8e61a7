#include "tools/apps/postchain/exit_code.h"

#include "tools/apps/postchain/log.h"

namespace postchain {

int fail(const Status& status) {
    if (!status.message().empty()) log::error(status.message());
    return exit_code(status);
}

Status already_said(const Status& status) {
    return status.ok() ? status : Status(status.code(), "");
}

}  // namespace postchain

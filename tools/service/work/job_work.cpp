#include "tools/service/work/job_work.h"

#include "tools/sequence/run/exit_code.h"

namespace postchain::service {

WorkEnd WorkEnd::failed(const Status& status) {
    return {How::ended, JobState::failed, sequence::exit_code(status), status.message(), {}};
}

}  // namespace postchain::service

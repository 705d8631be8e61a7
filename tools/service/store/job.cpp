#include "tools/service/store/job.h"

namespace postchain::service {

const char* name_of(JobKind kind) {
    switch (kind) {
        case JobKind::run:
            return "run";
        case JobKind::ab:
            return "ab";
        case JobKind::bench:
            return "bench";
        case JobKind::study:
            return "study";
    }
    return "run";
}

const char* name_of(JobState state) {
    switch (state) {
        case JobState::queued:
            return "queued";
        case JobState::running:
            return "running";
        case JobState::done:
            return "done";
        case JobState::failed:
            return "failed";
        case JobState::canceled:
            return "canceled";
    }
    return "failed";
}

const char* name_of(FrameState state) {
    switch (state) {
        case FrameState::waiting:
            return "waiting";
        case FrameState::written:
            return "written";
        case FrameState::skipped:
            return "skipped";
        case FrameState::missing:
            return "missing";
        case FrameState::quarantined:
            return "quarantined";
    }
    return "quarantined";
}

}  // namespace postchain::service

#include "tools/service/store/job.h"

namespace postchain::service {

const char* name_of(JobKind kind) {
    constexpr std::array kNames = {"run", "ab", "bench", "study"};
    static_assert(kNames.size() == kJobKinds.size());
    return kNames[size_t(kind)];
}

const char* name_of(JobState state) {
    constexpr std::array kNames = {"queued", "running", "done", "failed", "canceled"};
    static_assert(kNames.size() == kJobStates.size());
    return kNames[size_t(state)];
}

const char* name_of(FrameState state) {
    constexpr std::array kNames = {"waiting", "written", "skipped", "missing", "quarantined"};
    static_assert(kNames.size() == kFrameStates.size());
    return kNames[size_t(state)];
}

}  // namespace postchain::service

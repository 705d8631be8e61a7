#include "chain/base/stop.h"

namespace postchain {
namespace {

thread_local const std::atomic<bool>* stop_of_thread = nullptr;

}  // namespace

StopFlag::StopFlag(const std::atomic<bool>* stop) : before_(stop_of_thread) {
    stop_of_thread = stop;
}

StopFlag::~StopFlag() {
    stop_of_thread = before_;
}

bool is_stopped() {
    return stop_of_thread && *stop_of_thread;
}

Status stopped_status() {
    return Status(StatusCode::internal, "stopped, because nobody waits for the result");
}

}  // namespace postchain

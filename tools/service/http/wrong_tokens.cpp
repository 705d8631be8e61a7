#include "tools/service/http/wrong_tokens.h"

#include <algorithm>
#include <cmath>

namespace postchain::service {
namespace {

constexpr size_t kMaxAddresses = 100'000;

double seconds(std::chrono::steady_clock::duration time) {
    return std::chrono::duration<double>(time).count();
}

}  // namespace

int WrongTokens::wait_s(const std::string& address, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    const auto found = tries_.find(address);
    if (found == tries_.end() || found->second.until <= now) return 0;
    return int(std::ceil(seconds(found->second.until - now)));
}

void WrongTokens::enter(const std::string& address, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (tries_.size() >= kMaxAddresses)
        std::erase_if(tries_, [&](const auto& one) {
            return seconds(now - one.second.last) > one.second.count * kForgivenS;
        });
    if (tries_.size() >= kMaxAddresses) tries_.clear();
    Tries& tries = tries_[address];
    if (tries.count > 0)
        tries.count = std::max(0.0, tries.count - seconds(now - tries.last) / kForgivenS);
    tries.last = now;
    if (++tries.count <= kFree) return;
    const double wait = std::exp2(std::min(tries.count - kFree, 10.0));
    tries.until =
        now + std::chrono::milliseconds(int64_t(1000 * std::min<double>(wait, kLongestWaitS)));
}

}  // namespace postchain::service

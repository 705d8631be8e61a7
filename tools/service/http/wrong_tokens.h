// Slows clients that try tokens: after some wrong ones of an address, it must wait.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

namespace postchain::service {

class WrongTokens {
  public:
    using Clock = std::chrono::steady_clock;

    // Seconds until the address may try again; 0 = now.
    int wait_s(const std::string& address, Clock::time_point now = Clock::now());
    void enter(const std::string& address, Clock::time_point now = Clock::now());

    static constexpr double kFree = 20;       // wrong tokens before the first wait
    static constexpr double kForgivenS = 10;  // each is forgotten after this time
    static constexpr int kLongestWaitS = 60;

  private:
    struct Tries {
        double count = 0;
        Clock::time_point last, until;
    };
    std::mutex mutex_;
    std::map<std::string, Tries> tries_;
};

}  // namespace postchain::service

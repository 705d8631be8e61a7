// Access checks on the header alone, before any byte of a body is read.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "chain/base/status.h"
#include "tools/service/http/client.h"
#include "tools/service/http/message.h"
#include "tools/service/store/users.h"

namespace postchain::service {

// Slows clients that try tokens: after some wrong ones of an address, it must wait.
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

struct GuardSettings {
    std::shared_ptr<const Users> users = std::make_shared<Users>();
    std::vector<std::string> hosts;  // names allowed in Host beside addresses and localhost
    Networks trusted;                // proxies
    std::string base;                // "/postchain": the path before every address; may be empty
};

class Guard {
  public:
    explicit Guard(const GuardSettings& settings) : settings_(settings) {}

    // A refusal, or nothing: framing that two readers could interpret differently (400, 501), an
    // unknown Host (421: a name that another site points here), an Origin of another site (403).
    std::optional<Reply> refuse_shape(const Request& request) const;
    // The user of the request's token, as Authorization: Bearer or by the cookie of a session. 401:
    // no token, or a wrong one; 429 after many wrong ones.
    std::variant<KnownUser, Reply> identify(const Request& request) const;
    bool asks_for_token() const { return settings_.users->asks_for_token(); }
    // Set-Cookie for a page that has sent the token. Scripts cannot read it and other sites cannot
    // send it. Empty `session`: removes the cookie.
    std::string cookie(const Request& request, const std::string& session) const;
    // The address without the base path, which some proxies remove and others do not.
    std::string without_base(const std::string& target) const;
    bool is_base(const std::string& target) const {
        return !settings_.base.empty() && target == settings_.base;
    }
    bool trusts(const std::string& address) const {
        return has_address(settings_.trusted, address);
    }

  private:
    GuardSettings settings_;
    mutable WrongTokens wrong_;
};

}  // namespace postchain::service

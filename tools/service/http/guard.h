// Access checks on the header alone, before any byte of a body is read.
//
// The client behind a proxy: its address and whether it came by TLS are those of X-Forwarded-For
// and X-Forwarded-Proto, or Forwarded (RFC 7239). Only proxies that the service trusts are
// believed.
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "chain/base/status.h"
#include "tools/service/http/message.h"
#include "tools/service/store/users.h"

namespace postchain::service {

// ------------------------------------------------------------------------------------ the client
// "10.0.0.0/8", "::1"
class Network {
  public:
    static Result<Network> parse(const std::string& text);  // errors (usage)
    bool has(const std::string& address) const;

  private:
    std::array<unsigned char, 16> bytes_ = {};  // IPv4 as ::ffff:a.b.c.d
    int bits_ = 128;
};
using Networks = std::vector<Network>;

bool has_address(const Networks& networks, const std::string& address);

struct Client {
    std::string address;
    bool secure = false;  // it came by TLS
};
Client client_of(const Request& request, const Networks& trusted);

// 127.0.0.0/8, ::1
bool is_loopback(const std::string& address);
bool is_address(const std::string& text);

// What counts as one client: an IPv4 address, or the first 64 bits of an IPv6 one, which a client
// may fill as it likes. "2001:db8:1:2::/64".
std::string place_of(const std::string& address);

// ------------------------------------------------------------------------------------ the checks
// Slows clients that send wrong tokens: after some of an address, further ones must wait.
class WrongTokens {
  public:
    using Clock = std::chrono::steady_clock;

    // Seconds until the address may send another wrong one; 0 = now.
    int wait_s(const std::string& address, Clock::time_point now = Clock::now());
    void enter(const std::string& address, Clock::time_point now = Clock::now());

    static constexpr double kFree = 20;       // wrong tokens before the first wait
    static constexpr double kForgivenS = 10;  // each is forgotten after this time
    static constexpr int kLongestWaitS = 60;
    static constexpr size_t kMaxAddresses = 100'000;  // that are remembered

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
    // no token, or a wrong one; 429: a wrong one after many of its address.
    std::variant<KnownUser, Reply> identify(const Request& request) const;
    // Whether the token or the session of a request that was admitted is still good. May be called
    // after the request; prolongs no session.
    std::function<bool()> validity_of(const Request& request) const;
    bool asks_for_token() const { return settings_.users->asks_for_token(); }
    // A session of the request's token, empty without one; the end of its cookie's session.
    std::string begin_session(const Request& request) const;
    void end_session(const Request& request) const;
    // The address of the client, behind a proxy too.
    std::string address_of(const Request& request) const;
    // Whose turn a request takes: its user's, or its client's if the user has no name.
    std::string share_of(const Request& request, const KnownUser& user) const;
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

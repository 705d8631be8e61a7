// Access checks on the header alone, before any byte of a body is read.
//
// Behind a proxy that the service trusts, the client's address is that of X-Forwarded-For, and the
// user is the one that the proxy names in a header.
#pragma once

#include <array>
#include <memory>
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

// The client's address, from the nearest proxy outward as far as proxies are trusted.
std::string client_of(const Request& request, const Networks& trusted);

// 127.0.0.0/8, ::1
bool is_loopback(const std::string& address);
bool is_address(const std::string& text);

// What counts as one client: an IPv4 address, or the first 64 bits of an IPv6 one, which a client
// may fill as it likes. "2001:db8:1:2::/64".
std::string place_of(const std::string& address);

// ------------------------------------------------------------------------------------ the checks
struct GuardSettings {
    std::shared_ptr<const Users> users = std::make_shared<Users>();
    std::vector<std::string> hosts;  // names allowed in Host beside addresses and localhost
    Networks trusted;                // proxies
    std::string user_header;         // in which they name the user; empty = they do not
};

class Guard {
  public:
    explicit Guard(const GuardSettings& settings) : settings_(settings) {}

    // A refusal, or nothing: framing that two readers could interpret differently (400, 501), an
    // unknown Host (421: a name that another site points here), an Origin of another site (403).
    std::optional<Reply> refuse_shape(const Request& request) const;
    // The user that a trusted proxy names, or that of the token (Authorization: Bearer). 401:
    // neither, or a wrong token; 403: the proxy's user is not in the file.
    std::variant<Sender, Reply> identify(const Request& request) const;
    const Users& users() const { return *settings_.users; }
    // The address of the client, behind a proxy too.
    std::string address_of(const Request& request) const {
        return client_of(request, settings_.trusted);
    }
    // Whose turn a request takes: its user's, or its client's if the user has no name.
    std::string share_of(const Request& request, const KnownUser& user) const;
    bool trusts(const std::string& address) const {
        return has_address(settings_.trusted, address);
    }

  private:
    GuardSettings settings_;
};

}  // namespace postchain::service

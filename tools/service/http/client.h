// The client behind a proxy: its address and whether it came by TLS, from X-Forwarded-For and
// X-Forwarded-Proto, or Forwarded (RFC 7239). Only proxies that the service trusts are believed.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/service/http/message.h"

namespace postchain::service {

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

}  // namespace postchain::service

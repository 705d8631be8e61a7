// Access checks on the header alone, before any byte of a body is read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/service/http/message.h"

namespace postchain::service {

struct GuardSettings {
    std::string token;               // empty = no token is required
    std::vector<std::string> hosts;  // names allowed in Host beside addresses and localhost
};

class Guard {
  public:
    explicit Guard(const GuardSettings& settings);

    // A refusal, or nothing: framing that two readers could interpret differently (400, 501), an
    // unknown Host (421: a name that another site points here), an Origin of another site (403).
    std::optional<Reply> refuse_shape(const Request& request) const;
    // Whether the request has the token, as Authorization: Bearer or by the session's cookie. True
    // if none is required.
    bool knows(const Request& request) const;
    bool asks_for_token() const { return !settings_.token.empty(); }
    // A cookie for a page that has sent the token. Scripts cannot read it and other sites cannot
    // send it. Valid until the process ends.
    std::string session_cookie() const;
    static std::string no_session_cookie();

  private:
    GuardSettings settings_;
    std::string session_;  // 256 random bits in hexadecimal
};

// Compares in a time that depends only on the length of `given`.
bool same_secret(const std::string& given, const std::string& secret);

// The first line of the file. Errors (usage): unreadable, shorter than 16 characters, longer than
// 512, characters outside printable ASCII.
Result<std::string> read_token(const std::string& path);

// 127.0.0.0/8, ::1
bool is_loopback(const std::string& address);

}  // namespace postchain::service

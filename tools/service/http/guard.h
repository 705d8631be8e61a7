// Who is let in, by the header alone: before a byte of a body is read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/service/http/message.h"

namespace postchain::service {

struct GuardSettings {
    std::string token;               // empty: none is asked for
    std::vector<std::string> hosts;  // names that Host may hold beside addresses and localhost
};

class Guard {
  public:
    explicit Guard(const GuardSettings& settings);

    // What is refused, and why: a shape that two readers could take differently (400, 501), a Host
    // that is none of ours (421: a name that was pointed here by another site), an Origin of
    // another site (403).
    std::optional<Reply> refuse_shape(const Request& request) const;
    // Whether the request has the token, as Authorization: Bearer or by the session's cookie. True
    // where none is asked for.
    bool knows(const Request& request) const;
    bool asks_for_token() const { return !settings_.token.empty(); }
    // For a page that has shown the token: a cookie that scripts cannot read and other sites cannot
    // send. It holds as long as the process.
    std::string session_cookie() const;
    static std::string no_session_cookie();

  private:
    GuardSettings settings_;
    std::string session_;  // 256 random bits in hexadecimal
};

// In a time that depends on the length of `given` alone.
bool same_secret(const std::string& given, const std::string& secret);

// The first line of the file. Errors (usage): unreadable, shorter than 16 characters, longer than
// 512, characters outside printable ASCII.
Result<std::string> read_token(const std::string& path);

// 127.0.0.0/8, ::1
bool is_loopback(const std::string& address);

}  // namespace postchain::service

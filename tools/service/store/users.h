// The users of a service: everyone without a token, everyone who has the one token, or users from a
// file, each with tokens, folders and limits of their own. The service stores hashes of tokens only
// (BLAKE2b of libsodium). Thread-safe.
//
//   postchain_users: 1
//   users:
//     ann: {tokens: [blake2b-5f0c...], roots: [ann, shared], max_jobs: 20, max_disk: 500G}
//     ops: {tokens: [blake2b-81d4..., blake2b-77ae...], admin: true}
//
// A user with several tokens is changing them: all are valid. A session of a page is a secret of
// its own. It ends with its token, by DELETE /v1/session, without requests, and after some days.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/service/store/job.h"

namespace postchain::service {

struct User {
    std::string name;                 // empty: of a service without a file of users
    std::vector<std::string> tokens;  // hashes; none: no token is required
    bool admin = false;               // may change the jobs of others
    std::vector<std::string> roots;   // folders that its jobs may use; empty = all of the service
    int max_priority =
        kMaxPriority;       // of its jobs; 0 in a file that does not set it, but for admins
    int max_jobs = 0;       // unfinished; 0 = no limit
    int max_frames = 0;     // in unfinished jobs; 0 = no limit
    std::string max_disk;   // as given, "500G"
    int64_t max_bytes = 0;  // max_disk: written by the jobs in the store; 0 = no limit
};
using KnownUser = std::shared_ptr<const User>;  // null: not known

class Users {
  public:
    // Everyone, without a token.
    Users();
    // Everyone who has a token whose hash is a line of the file. Errors (usage): unreadable, no
    // line, or another line than a hash.
    static Result<std::shared_ptr<Users>> of_token_file(const std::string& path);
    static std::shared_ptr<Users> of_token(const std::string& token);
    // `check_folder`: whether a user may have a folder. Errors (usage): unreadable, or a fault of
    // its text, with line and column.
    using CheckFolder = std::function<Status(const std::string& folder)>;
    static Result<std::shared_ptr<Users>> of_file(const std::string& path,
                                                  const CheckFolder& check_folder);

    // Reads the file again. After an error the former users stay.
    Status reload();

    bool asks_for_token() const;
    size_t count() const;
    KnownUser with_token(const std::string& given) const;
    KnownUser named(const std::string& name) const;

    using Clock = std::chrono::steady_clock;
    // A new session of the token's user: the value of its cookie. Empty: the token is not known.
    std::string begin_session(const std::string& token, Clock::time_point now = Clock::now()) const;
    KnownUser in_session(const std::string& given, Clock::time_point now = Clock::now()) const;
    // Whether in_session() would find a user; no request, so that it does not prolong the session.
    bool has_session(const std::string& given, Clock::time_point now = Clock::now()) const;
    void end_session(const std::string& given) const;

    static constexpr auto kIdleSession = std::chrono::hours(12);         // without a request
    static constexpr auto kLongestSession = std::chrono::hours(7 * 24);  // then the token again
    static constexpr size_t kSessions =
        100;  // of a user; the one without requests for longest ends

  private:
    struct Session {
        std::string user, token;  // its hash
        Clock::time_point begun, last;
    };
    static bool has_ended(const Session& session, Clock::time_point now) {
        return now - session.last > kIdleSession || now - session.begun > kLongestSession;
    }
    using List = std::vector<KnownUser>;
    List list() const;
    Result<List> read() const;
    KnownUser with_hash(const std::string& hash) const;

    std::string path_, users_path_;  // of the file with tokens, or with users; empty = none
    CheckFolder check_folder_;
    mutable std::mutex mutex_;
    List users_;
    mutable std::map<std::string, Session> sessions_;  // by the hash of their secrets
};

// "blake2b-" and 256 bits in hexadecimal, as the files have it. Errors (usage): shorter than 16
// characters, longer than 512, characters outside printable ASCII.
Result<std::string> hash_of_token(const std::string& token);

}  // namespace postchain::service

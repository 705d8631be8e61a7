// The users of a service: everyone without a token, everyone who has the one token, or users from a
// file, each with a token, folders and limits of their own. Thread-safe.
//
//   postchain_users: 1
//   users:
//     ann: {token: 5f0c..., roots: [ann, shared], max_jobs: 20, max_frames: 10000, max_disk: 500G}
//     ops: {token: 81d4..., admin: true}
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/service/store/job.h"

namespace postchain::service {

struct User {
    std::string name;                // empty: of a service without a file of users
    std::string token;               // empty: no token is required
    std::string session;             // value of its cookie
    bool admin = false;              // may change the jobs of others
    std::vector<std::string> roots;  // folders that its jobs may use; empty = all of the service
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
    // Everyone who has the token: the first line of the file. Errors (usage): unreadable, shorter
    // than 16 characters, longer than 512, characters outside printable ASCII.
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
    KnownUser in_session(const std::string& given) const;
    KnownUser named(const std::string& name) const;

  private:
    using List = std::vector<KnownUser>;
    List list() const;
    Result<List> read() const;

    std::string path_, users_path_;  // of the file with a token, or with users; empty = none
    CheckFolder check_folder_;
    mutable std::mutex mutex_;
    List users_;
};

// Compares in a time that depends only on the length of `given`.
bool same_secret(const std::string& given, const std::string& secret);

}  // namespace postchain::service

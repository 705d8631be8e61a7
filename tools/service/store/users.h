// The users of a service: everyone, or those of a file, each with tokens for scripts, folders and
// limits. The file has hashes of tokens only (BLAKE2b of libsodium). Thread-safe.
//
//   postchain_users: 1
//   users:
//     ann: {roots: [ann, shared], max_jobs: 20, max_disk: 500G}
//     farm: {tokens: [blake2b-81d4..., blake2b-77ae...], max_priority: 0}
//
// A user with several tokens is changing them: all are valid.
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
    std::string name;                 // empty: of a service without a file of users
    std::vector<std::string> tokens;  // hashes
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

// Who sent a request.
struct Sender {
    KnownUser user;
    std::string token = {};  // the hash of the token; empty: known by the proxy, or everyone
};

class Users {
  public:
    // Everyone, as an administrator without a name.
    Users();
    // `check_folder`: whether a user may have a folder. Errors (usage): unreadable, or a fault of
    // its text, with line and column.
    using CheckFolder = std::function<Status(const std::string& folder)>;
    static Result<std::shared_ptr<Users>> of_file(const std::string& path,
                                                  const CheckFolder& check_folder);

    // Reads the file again. After an error the former users stay.
    Status reload();

    bool are_everyone() const { return path_.empty(); }
    size_t count() const;
    KnownUser named(const std::string& name) const;
    Sender with_token(const std::string& token) const;
    // Whether the sender of an earlier request is still a user, with the same token.
    bool still_have(const Sender& sender) const;

  private:
    std::string path_;
    CheckFolder check_folder_;
    mutable std::mutex mutex_;
    std::vector<KnownUser> users_;
};

// "blake2b-" and 256 bits in hexadecimal, as the files have it. Errors (usage): shorter than 16
// characters, longer than 512, characters outside printable ASCII.
Result<std::string> hash_of_token(const std::string& token);

}  // namespace postchain::service

#include "tools/service/store/users.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>

#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/sequence/source/memory.h"

namespace postchain::service {
namespace {

constexpr size_t kShortestToken = 16, kLongestToken = 512;

using Digest = std::array<unsigned char, 32>;
constexpr std::string_view kHashName = "blake2b-";
constexpr size_t kMaxTokens = 8;  // of a user

std::string hex_of(const Digest& bytes) {
    std::array<char, 2 * sizeof(Digest) + 1> text = {};
    sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
    return text.data();
}

// Before each use of libsodium; only the first call does anything.
void begin_sodium() {
    if (sodium_init() < 0) std::abort();  // the kernel gives no random numbers
}

// 256 random bits in hexadecimal.
std::string new_secret() {
    begin_sodium();
    Digest bytes = {};
    randombytes_buf(bytes.data(), bytes.size());
    return hex_of(bytes);
}

// Secrets are random and long, so that neither a salt nor a slow hash is needed, and hashes may be
// compared in any time.
std::string hash_of(const std::string& secret) {
    begin_sodium();
    Digest bytes = {};
    crypto_generichash(bytes.data(), bytes.size(),
                       reinterpret_cast<const unsigned char*>(secret.data()), secret.size(),
                       nullptr, 0);
    return std::string(kHashName) + hex_of(bytes);
}

Status check_hash(const std::string& text) {
    const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
    if (text.starts_with(kHashName) && text.size() == kHashName.size() + 2 * sizeof(Digest) &&
        std::all_of(text.begin() + kHashName.size(), text.end(), is_hex))
        return Status();
    return Status(StatusCode::usage,
                  "expected the hash of a token, blake2b-...; `postchain serve --hash-token FILE` "
                  "prints that of the token in FILE");
}

Status check_token(const std::string& token) {
    const auto is_plain = [](unsigned char c) { return c > 0x20 && c < 0x7f; };
    if (token.size() < kShortestToken || token.size() > kLongestToken)
        return Status(StatusCode::usage,
                      concat("a token must have ", kShortestToken, " to ", kLongestToken,
                             " characters; `openssl rand -hex 32` makes one"));
    if (!std::ranges::all_of(token, is_plain))
        return Status(StatusCode::usage,
                      "a token may have printable ASCII characters without spaces only");
    return Status();
}

Result<std::vector<std::string>> read_tokens(const std::string& path) {
    const std::string place = "--token-file " + path;
    std::ifstream in(path);
    if (!in) return Status(StatusCode::usage, place + ": cannot be read");
    std::vector<std::string> hashes;
    int number = 0;
    for (std::string line; std::getline(in, line) && hashes.size() <= kMaxTokens;) {
        ++number;
        line.resize(line.find_last_not_of(" \t\r") + 1);
        if (line.empty() || line[0] == '#') continue;
        if (Status status = check_hash(line); !status.ok())
            return Status(StatusCode::usage, concat(place, ":", number, ": ", status.message()));
        hashes.push_back(line);
    }
    if (hashes.empty() || hashes.size() > kMaxTokens)
        return Status(StatusCode::usage, concat(place, ": expected 1 to ", kMaxTokens,
                                                " hashes of tokens, one a line"));
    return hashes;
}

// The settings of a user, except its lists of folders and tokens.
const ParameterTable& user_table() {
    static const ParameterTable table =
        ParameterTableBuilder<User>()
            .boolean("admin", &User::admin, {})
            .integer("max_priority", &User::max_priority,
                     {.min = -kMaxPriority, .max = kMaxPriority})
            .integer("max_jobs", &User::max_jobs, {.min = 0, .max = 1'000'000})
            .integer("max_frames", &User::max_frames, {.min = 0, .max = 1'000'000'000})
            .text("max_disk", &User::max_disk, {})
            .table();
    return table;
}

// All errors. The log has one line for each message.
Status on_one_line(const Diagnostics& diagnostics) {
    std::string text;
    for (const Diagnostic& one : diagnostics)
        if (one.severity == Severity::error) text += (text.empty() ? "" : "; ") + one.text();
    return Status(StatusCode::usage, text);
}

class UsersReader {
  public:
    UsersReader(const std::string& path, const Users::CheckFolder& check_folder)
        : check_folder_(check_folder), reporter_(path, StatusCode::usage, faults_) {}

    Result<std::vector<KnownUser>> read(const std::string& text, const std::string& path) {
        TextTree tree = read_text_tree(text, path, StatusCode::usage);
        if (has_errors(tree.diagnostics)) return on_one_line(tree.diagnostics);
        const TextNode* version = tree.root.find("postchain_users");
        const TextNode* users = tree.root.find("users");
        if (!version || !users || !users->is_map())
            reporter_.error(tree.root, "",
                            "expected postchain_users: 1, and users: a map of their names");
        else
            reporter_.check_version(*version, "postchain_users", 1);
        for (const TextEntry& entry : tree.root.entries)
            if (entry.key.text != "postchain_users" && entry.key.text != "users")
                reporter_.error(entry.key, entry.key.text,
                                unknown_word("key", entry.key.text, {"postchain_users", "users"}));
        if (users)
            for (const TextEntry& entry : users->entries) add(entry);
        if (users_.empty() && faults_.empty()) reporter_.error(tree.root, "users", "no user");
        if (has_errors(faults_)) return on_one_line(faults_);
        return users_;
    }

  private:
    void add(const TextEntry& entry) {
        const std::string place = "users." + entry.key.text;
        auto user = std::make_shared<User>();
        user->name = entry.key.text;
        if (user->name.empty() || user->name.size() > 64)
            return reporter_.error(entry.key, place, "a name has 1 to 64 characters");
        if (!entry.value.is_map()) return reporter_.error(entry.value, place, "expected a map");
        std::vector<std::string> known = {"roots", "tokens"};
        for (const Parameter& row : user_table().rows()) known.push_back(row.key);
        for (const auto& [key, value] : entry.value.entries) {
            const std::string at = place + "." + key.text;
            const Parameter* row = user_table().find(key.text);
            if (key.text == "roots") {
                read_roots(value, at, *user);
            } else if (key.text == "tokens") {
                read_tokens(value, at, *user);
            } else if (!row) {
                reporter_.error(key, at, unknown_word("key", key.text, known));
            } else if (Status status = set_row(user_table(), user.get(), *row, value);
                       !status.ok()) {
                reporter_.error(value, at, status.message());
            }
        }
        if (!entry.value.find("max_priority") && !user->admin) user->max_priority = 0;
        if (!entry.value.find("tokens"))
            reporter_.error(entry.value, place + ".tokens", "is required");
        for (const std::string& hash : user->tokens)
            for (const KnownUser& other : users_)
                if (std::ranges::count(other->tokens, hash) > 0)
                    reporter_.error(entry.value, place + ".tokens",
                                    "one is also that of " + other->name);
        if (!user->max_disk.empty()) {
            const auto bytes = sequence::parse_bytes(user->max_disk);
            if (bytes.ok())
                user->max_bytes = int64_t(*bytes);
            else
                reporter_.error(entry.value, place + ".max_disk", bytes.status().message());
        }
        users_.push_back(std::move(user));
    }

    void read_tokens(const TextNode& node, const std::string& place, User& user) {
        if (!node.is_list() || node.items.empty() || node.items.size() > kMaxTokens)
            return reporter_.error(
                node, place, concat("expected a list of 1 to ", kMaxTokens, " hashes of tokens"));
        for (const TextNode& item : node.items) {
            const Status status = check_hash(item.is_scalar() ? item.text : "");
            if (!status.ok()) reporter_.error(item, place, status.message());
            user.tokens.push_back(item.text);
        }
    }

    void read_roots(const TextNode& node, const std::string& place, User& user) {
        if (!node.is_list() || node.items.empty())
            return reporter_.error(node, place, "expected a list of folders");
        for (const TextNode& item : node.items) {
            const Status status = item.is_scalar() ? check_folder_(item.text)
                                                   : Status(StatusCode::usage, "expected a folder");
            if (!status.ok()) reporter_.error(item, place, status.message());
            user.roots.push_back(item.text);
        }
    }

    const Users::CheckFolder& check_folder_;
    Diagnostics faults_;
    Reporter reporter_;
    std::vector<KnownUser> users_;
};

}  // namespace

Users::Users() {
    User everyone;
    everyone.admin = true;
    users_ = {std::make_shared<const User>(everyone)};
}

std::shared_ptr<Users> Users::of_token(const std::string& token) {
    auto users = std::make_shared<Users>();
    User one = *users->users_.front();
    one.tokens = {hash_of(token)};
    users->users_ = {std::make_shared<const User>(std::move(one))};
    return users;
}

Result<std::shared_ptr<Users>> Users::of_token_file(const std::string& path) {
    auto users = std::make_shared<Users>();
    users->path_ = path;
    RETURN_IF_ERROR(users->reload());
    return users;
}

Result<std::shared_ptr<Users>> Users::of_file(const std::string& path,
                                              const CheckFolder& check_folder) {
    auto users = std::make_shared<Users>();
    users->users_path_ = path;
    users->check_folder_ = check_folder;
    RETURN_IF_ERROR(users->reload());
    return users;
}

Result<Users::List> Users::read() const {
    if (users_path_.empty()) {
        User one;
        one.admin = true;
        ASSIGN_OR_RETURN(one.tokens, read_tokens(path_));
        return List{std::make_shared<const User>(std::move(one))};
    }
    ASSIGN_OR_RETURN(const auto text, read_text_file(users_path_, StatusCode::usage));
    return UsersReader(users_path_, check_folder_).read(text, users_path_);
}

Status Users::reload() {
    if (path_.empty() && users_path_.empty()) return Status();
    ASSIGN_OR_RETURN(auto found, read());
    const std::lock_guard lock(mutex_);
    users_ = std::move(found);
    // Sessions last no longer than their token.
    std::erase_if(sessions_, [&](const auto& one) {
        const KnownUser user = with_hash(one.second.token);
        return !user || user->name != one.second.user;
    });
    return Status();
}

Users::List Users::list() const {
    const std::lock_guard lock(mutex_);
    return users_;
}

bool Users::asks_for_token() const {
    const List users = list();
    return users.empty() || !users.front()->tokens.empty();
}

size_t Users::count() const {
    return list().size();
}

// Requires the lock.
KnownUser Users::with_hash(const std::string& hash) const {
    for (const KnownUser& user : users_)
        if (std::ranges::count(user->tokens, hash) > 0) return user;
    return nullptr;
}

KnownUser Users::with_token(const std::string& given) const {
    const std::string hash = hash_of(given);
    const std::lock_guard lock(mutex_);
    return with_hash(hash);
}

std::string Users::begin_session(const std::string& token, Clock::time_point now) const {
    const std::string hash = hash_of(token);
    std::string secret = new_secret();
    const std::lock_guard lock(mutex_);
    const KnownUser user = with_hash(hash);
    if (!user) return "";
    size_t count = 0;
    auto oldest = sessions_.end();
    for (auto at = sessions_.begin(); at != sessions_.end(); ++at) {
        if (at->second.user != user->name) continue;
        ++count;
        if (oldest == sessions_.end() || at->second.last < oldest->second.last) oldest = at;
    }
    if (count >= kSessions) sessions_.erase(oldest);
    sessions_[hash_of(secret)] = {user->name, hash, now, now};
    return secret;
}

KnownUser Users::in_session(const std::string& given, Clock::time_point now) const {
    if (given.empty()) return nullptr;
    const std::string hash = hash_of(given);
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(hash);
    if (found == sessions_.end()) return nullptr;
    Session& session = found->second;
    if (has_ended(session, now)) {
        sessions_.erase(found);
        return nullptr;
    }
    session.last = now;
    return with_hash(session.token);
}

bool Users::has_session(const std::string& given, Clock::time_point now) const {
    const std::string hash = hash_of(given);
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(hash);
    return found != sessions_.end() && !has_ended(found->second, now);
}

void Users::end_session(const std::string& given) const {
    const std::string hash = hash_of(given);
    const std::lock_guard lock(mutex_);
    sessions_.erase(hash);
}

KnownUser Users::named(const std::string& name) const {
    for (const KnownUser& user : list())
        if (user->name == name) return user;
    return nullptr;
}

Result<std::string> hash_of_token(const std::string& token) {
    if (Status status = check_token(token); !status.ok()) return status;
    return hash_of(token);
}

}  // namespace postchain::service

#include "tools/service/store/users.h"

#include <sodium.h>

#include <algorithm>
#include <array>

#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/sequence/source/memory.h"

namespace postchain::service {
namespace {

constexpr size_t kShortestToken = 16, kLongestToken = 512;

using Digest = std::array<unsigned char, 32>;
constexpr std::string_view kHashName = "blake2b-";

// Tokens are random and long, so that neither a salt nor a slow hash is needed, and hashes may be
// compared in any time.
std::string hash_of(const std::string& token) {
    Digest bytes = {};
    crypto_generichash(bytes.data(), bytes.size(),
                       reinterpret_cast<const unsigned char*>(token.data()), token.size(), nullptr,
                       0);
    std::array<char, 2 * sizeof(Digest) + 1> text = {};
    sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
    return std::string(kHashName) + text.data();
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
                read_list(value, at, "folders", check_folder_, user->roots);
            } else if (key.text == "tokens") {
                read_list(value, at, "hashes of tokens", check_hash, user->tokens);
            } else if (!row) {
                reporter_.error(key, at, unknown_word("key", key.text, known));
            } else if (Status status = set_row(user_table(), user.get(), *row, value);
                       !status.ok()) {
                reporter_.error(value, at, status.message());
            }
        }
        if (!entry.value.find("max_priority") && !user->admin) user->max_priority = 0;
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

    void read_list(const TextNode& node, const std::string& place, const char* what,
                   const Users::CheckFolder& check, std::vector<std::string>& list) {
        if (!node.is_list() || node.items.empty())
            return reporter_.error(node, place, concat("expected a list of ", what));
        for (const TextNode& item : node.items) {
            const Status status = item.is_scalar() ? check(item.text)
                                                   : Status(StatusCode::usage, "expected a string");
            if (!status.ok()) reporter_.error(item, place, status.message());
            list.push_back(item.text);
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

Result<std::shared_ptr<Users>> Users::of_file(const std::string& path,
                                              const CheckFolder& check_folder) {
    auto users = std::make_shared<Users>();
    users->path_ = path;
    users->check_folder_ = check_folder;
    RETURN_IF_ERROR(users->reload());
    return users;
}

Status Users::reload() {
    if (path_.empty()) return Status();
    ASSIGN_OR_RETURN(const auto text, read_text_file(path_, StatusCode::usage));
    ASSIGN_OR_RETURN(auto found, UsersReader(path_, check_folder_).read(text, path_));
    const std::lock_guard lock(mutex_);
    users_ = std::move(found);
    return Status();
}

size_t Users::count() const {
    const std::lock_guard lock(mutex_);
    return users_.size();
}

KnownUser Users::named(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(
        users_, name, [](const auto& one) -> auto& { return one->name; });
    return found == users_.end() ? nullptr : *found;
}

Sender Users::with_token(const std::string& token) const {
    const std::string hash = hash_of(token);
    const std::lock_guard lock(mutex_);
    for (const KnownUser& user : users_)
        if (std::ranges::count(user->tokens, hash) > 0) return {user, hash};
    return {};
}

bool Users::still_have(const Sender& sender) const {
    const KnownUser user = named(sender.user->name);
    return user && (sender.token.empty() || std::ranges::count(user->tokens, sender.token) > 0);
}

Result<std::string> hash_of_token(const std::string& token) {
    RETURN_IF_ERROR(check_token(token));
    return hash_of(token);
}

}  // namespace postchain::service

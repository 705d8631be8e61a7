#include "tools/service/store/users.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/sequence/source/memory.h"

namespace postchain::service {
namespace {

constexpr size_t kShortestToken = 16, kLongestToken = 512;

// 256 random bits in hexadecimal; empty without randomness from the kernel.
std::string new_session() {
    std::array<unsigned char, 32> bytes = {};
    if (getrandom(bytes.data(), bytes.size(), 0) != ssize_t(bytes.size())) return "";
    constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    for (const unsigned char byte : bytes) {
        text += kDigits[byte >> 4];
        text += kDigits[byte & 15];
    }
    return text;
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

Result<std::string> read_token(const std::string& path) {
    const std::string place = "--token-file " + path;
    std::ifstream in(path);
    std::string token(kLongestToken + 2, '\0');
    if (!in) return Status(StatusCode::usage, place + ": cannot be read");
    in.read(token.data(), std::streamsize(token.size()));
    token.resize(size_t(in.gcount()));
    token.resize(std::min(token.find_first_of("\r\n"), token.size()));
    if (Status status = check_token(token); !status.ok())
        return Status(StatusCode::usage, place + ": first line: " + status.message());
    return token;
}

// The settings of a user, except its list of folders.
const ParameterTable& user_table() {
    static const ParameterTable table =
        ParameterTableBuilder<User>()
            .text("token", &User::token, {.required = true})
            .boolean("admin", &User::admin, {})
            .integer("max_priority", &User::max_priority,
                     {.min = -kMaxPriority, .max = kMaxPriority})
            .integer("max_jobs", &User::max_jobs, {.min = 0, .max = 1'000'000})
            .integer("max_frames", &User::max_frames, {.min = 0, .max = 1'000'000'000})
            .text("max_disk", &User::max_disk, {})
            .table();
    return table;
}

class UsersReader {
  public:
    UsersReader(const std::string& path, const Users::CheckFolder& check_folder)
        : check_folder_(check_folder), reporter_(path, StatusCode::usage, faults_) {}

    Result<std::vector<KnownUser>> read(const std::string& text, const std::string& path) {
        TextTree tree = read_text_tree(text, path, StatusCode::usage);
        if (has_errors(tree.diagnostics)) return status_of(tree.diagnostics);
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
        if (has_errors(faults_)) return status_of(faults_);
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
        std::vector<std::string> known = {"roots"};
        for (const Parameter& row : user_table().rows()) known.push_back(row.key);
        for (const auto& [key, value] : entry.value.entries) {
            const std::string at = place + "." + key.text;
            const Parameter* row = user_table().find(key.text);
            if (key.text == "roots") {
                read_roots(value, at, *user);
            } else if (!row) {
                reporter_.error(key, at, unknown_word("key", key.text, known));
            } else if (Status status = set_row(user_table(), user.get(), *row, value);
                       !status.ok()) {
                reporter_.error(value, at, status.message());
            }
        }
        if (!entry.value.find("max_priority") && !user->admin) user->max_priority = 0;
        if (Status status = check_token(user->token); !status.ok())
            reporter_.error(entry.value, place + ".token", status.message());
        for (const KnownUser& other : users_)
            if (other->token == user->token)
                reporter_.error(entry.value, place + ".token", "is also that of " + other->name);
        if (!user->max_disk.empty()) {
            const auto bytes = sequence::parse_bytes(user->max_disk);
            if (bytes.ok())
                user->max_bytes = int64_t(*bytes);
            else
                reporter_.error(entry.value, place + ".max_disk", bytes.status().message());
        }
        user->session = new_session();
        users_.push_back(std::move(user));
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
    one.token = token;
    one.session = new_session();
    users->users_ = {std::make_shared<const User>(std::move(one))};
    return users;
}

Result<std::shared_ptr<Users>> Users::of_token_file(const std::string& path) {
    ASSIGN_OR_RETURN(auto token, read_token(path));
    auto users = of_token(token);
    users->path_ = path;
    return users;
}

Result<std::shared_ptr<Users>> Users::of_file(const std::string& path,
                                              const CheckFolder& check_folder) {
    auto users = std::make_shared<Users>();
    users->users_path_ = path;
    users->check_folder_ = check_folder;
    users->users_.clear();
    RETURN_IF_ERROR(users->reload());
    return users;
}

Result<Users::List> Users::read() const {
    if (users_path_.empty()) {
        ASSIGN_OR_RETURN(const auto token, read_token(path_));
        return of_token(token)->list();
    }
    ASSIGN_OR_RETURN(const auto text, read_text_file(users_path_, StatusCode::usage));
    return UsersReader(users_path_, check_folder_).read(text, users_path_);
}

Status Users::reload() {
    if (path_.empty() && users_path_.empty()) return Status();
    ASSIGN_OR_RETURN(auto found, read());
    const std::lock_guard lock(mutex_);
    // Sessions last as long as the token.
    for (KnownUser& user : found)
        for (const KnownUser& former : users_)
            if (former->name == user->name && former->token == user->token) {
                User kept = *user;
                kept.session = former->session;
                user = std::make_shared<const User>(std::move(kept));
                break;
            }
    users_ = std::move(found);
    return Status();
}

Users::List Users::list() const {
    const std::lock_guard lock(mutex_);
    return users_;
}

bool Users::asks_for_token() const {
    const List users = list();
    return users.empty() || !users.front()->token.empty();
}

size_t Users::count() const {
    return list().size();
}

KnownUser Users::with_token(const std::string& given) const {
    KnownUser found;
    for (const KnownUser& user : list())
        if (same_secret(given, user->token)) found = user;
    return found;
}

KnownUser Users::in_session(const std::string& given) const {
    KnownUser found;
    for (const KnownUser& user : list())
        if (same_secret(given, user->session)) found = user;
    return found;
}

KnownUser Users::named(const std::string& name) const {
    for (const KnownUser& user : list())
        if (user->name == name) return user;
    return nullptr;
}

bool same_secret(const std::string& given, const std::string& secret) {
    if (secret.empty()) return false;
    volatile unsigned char difference = given.size() == secret.size() ? 0 : 1;
    for (size_t i = 0; i < given.size(); ++i)
        difference = static_cast<unsigned char>(
            difference | (static_cast<unsigned char>(given[i]) ^
                          static_cast<unsigned char>(secret[i % secret.size()])));
    return difference == 0;
}

}  // namespace postchain::service

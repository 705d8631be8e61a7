#include "tools/service/work/roots.h"

#include <limits.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <deque>
#include <filesystem>
#include <string_view>

#include "tools/sequence/files/output_files.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;  // limit of the Linux kernel

// Puts the parts of a path before the remaining ones.
void put_before(std::deque<std::string>& parts, const std::string& path) {
    std::vector<std::string> found;
    for (const fs::path& part : fs::path(path).relative_path())
        if (!part.empty()) found.push_back(part);
    parts.insert(parts.begin(), found.begin(), found.end());
}

// Follows every link, including a dangling one, whose target may be created later. Empty: too many
// links.
std::string without_links(const std::string& absolute) {
    std::deque<std::string> parts;
    put_before(parts, absolute);
    std::string done;  // "" is the file system's root
    int links = 0;
    while (!parts.empty()) {
        const std::string part = parts.front();
        parts.pop_front();
        if (part == ".") continue;
        if (part == "..") {
            done.erase(std::min(done.rfind('/'), done.size()));
            continue;
        }
        const std::string next = done + "/" + part;
        struct stat info;
        if (::lstat(next.c_str(), &info) != 0 || !S_ISLNK(info.st_mode)) {
            done = next;
            continue;
        }
        if (++links > kMaxLinks) return "";
        char target[PATH_MAX];
        const ssize_t length = ::readlink(next.c_str(), target, sizeof(target));
        if (length <= 0 || size_t(length) >= sizeof(target)) return "";
        if (target[0] == '/') done.clear();
        put_before(parts, std::string(target, size_t(length)));
    }
    return done.empty() ? "/" : done;
}

// Why a path is invalid; empty = it is valid.
std::string fault_of(const std::string& path) {
    if (path.empty()) return "is empty";
    if (path.find('\0') != std::string::npos) return "contains a zero byte";
    if (path.size() >= PATH_MAX) return "is too long for a path";
    for (const fs::path& part : fs::path(path))
        if (part.native().size() > NAME_MAX) return "contains a name that is too long";
    return "";
}

// A path for a message: cut at a zero byte and at 200 bytes.
std::string given(const std::string& path) {
    const std::string text = path.substr(0, path.find('\0'));
    return text.size() <= 200 ? text : text.substr(0, 200) + "...";
}

Status check_is_folder(const std::string& path, const std::string& given) {
    std::error_code error;
    if (fs::is_directory(path, error)) return Status();
    return Status(StatusCode::usage,
                  given + (fs::exists(path, error) ? ": is a file; name a folder"
                                                   : ": folder does not exist; create it first"));
}

}  // namespace

Result<Roots> Roots::of(const std::vector<std::string>& folders) {
    Roots roots;
    for (const std::string& folder : folders) {
        RETURN_IF_ERROR(check_is_folder(folder, folder).at("--root"));
        std::error_code error;
        roots.folders_.push_back(fs::canonical(folder, error).string());
    }
    if (roots.folders_.empty())
        return Status(StatusCode::usage,
                      "--root: missing; give the folders that the service may read and write");
    return roots;
}

Result<std::string> Roots::resolve(const std::string& path) const {
    if (const std::string fault = fault_of(path); !fault.empty())
        return Status(StatusCode::usage, "'" + given(path) + "' " + fault);
    const bool absolute = path[0] == '/';
    const std::string whole = absolute ? path : folders_.front() + "/" + path;
    const std::string resolved = without_links(whole);
    if (resolved.size() >= PATH_MAX)
        return Status(StatusCode::usage, "'" + given(path) + "' is too long for a path");
    for (const std::string& folder : entries())
        if (!resolved.empty() && io::is_inside(resolved, folder)) return resolved;
    return Status(StatusCode::input, "'" + shown(given(path)) +
                                         "' is outside the folders of this " +
                                         (within_.empty() ? "service" : "user"));
}

Result<Roots> Roots::within(const std::vector<std::string>& folders) const {
    Roots part = *this;
    std::vector<std::string> found;
    for (const std::string& folder : folders) {
        auto resolved = resolve(folder);
        if (!resolved.ok()) return Status(StatusCode::usage, resolved.status().message());
        RETURN_IF_ERROR(check_is_folder(*resolved, folder));
        found.push_back(std::move(*resolved));
    }
    part.within_ = std::move(found);
    return part;
}

std::string Roots::shown(const std::string& path) const {
    const std::string& first = folders_.front();
    if (path == first) return ".";
    if (!io::is_inside(path, first) || first == "/") return path;
    const std::string below = path.substr(first.size() + 1);
    // "a=b.exr" would name a plane (InputSpec::parse).
    return below[std::min(below.find_first_of("=/."), below.size())] == '=' ? "./" + below : below;
}

std::string Roots::shown_in(std::string text) const {
    const std::string& first = folders_.front();
    if (first == "/") return text;
    // Whether a file name continues at i. A dot may end a sentence instead.
    const auto in_name = [&](size_t i) {
        if (i < text.size() && text[i] == '.') ++i;
        return i < text.size() &&
               (std::isalnum(uint8_t(text[i])) || uint8_t(text[i]) >= 128 ||
                std::string_view("_-+~@%#/").find(text[i]) != std::string_view::npos);
    };
    for (size_t at = 0; (at = text.find(first, at)) != std::string::npos;) {
        size_t end = at + first.size();
        const bool goes_on = end < text.size() && text[end] != '/' && in_name(end);
        if (goes_on || (at > 0 && in_name(at - 1))) {
            at = end;
            continue;
        }
        end += end < text.size() && text[end] == '/';
        const bool itself = end == text.size() || std::string_view(" :;,'\")\n").find(text[end]) !=
                                                      std::string_view::npos;
        text.replace(at, end - at, itself ? "." : "");
        at += itself;
    }
    return text;
}

std::string joined_path(const std::string& folder, const std::string& name) {
    return folder == "/" ? folder + name : folder + "/" + name;
}

Result<io::PathPattern> resolve_pattern(const io::PathPattern& pattern, const Roots& roots) {
    std::string path = pattern.text();
    if (!pattern.has_token()) {
        ASSIGN_OR_RETURN(auto resolved, roots.resolve(path));
        return io::PathPattern::parse(resolved);
    }
    // Checks the file name too.
    RETURN_IF_ERROR(roots.resolve(path).status());
    ASSIGN_OR_RETURN(auto folder, roots.resolve(pattern.folder()));
    return io::PathPattern::parse(joined_path(folder, fs::path(path).filename().string()));
}

}  // namespace postchain::service

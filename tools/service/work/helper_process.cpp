#include "tools/service/work/helper_process.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <thread>

extern char** environ;

namespace postchain::service {
namespace {

bool open_pipe(HelperEnd& read, HelperEnd& write) {
    std::array<int, 2> ends;
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read.fd = ends[0];
    write.fd = ends[1];
    return true;
}

// Landlock grew by versions; headers of Debian 12 know the first two.
constexpr uint64_t kReads =
    LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr uint64_t kFirstVersion = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;  // 1: its rights
constexpr uint64_t kRefer = uint64_t(1) << 13;     // 2: rename and link between folders
constexpr uint64_t kTruncate = uint64_t(1) << 14;  // 3: truncate(), O_TRUNC
constexpr uint64_t kIoctl = uint64_t(1) << 15;     // 5: ioctl() of devices
constexpr uint64_t kSignals = uint64_t(1) << 1;    // 6: to processes that are not confined with it
constexpr uint64_t kOfFiles = LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE |
                              LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate | kIoctl;

// landlock_ruleset_attr of version 6. An earlier kernel accepts it while it is zero beyond what the
// kernel knows.
struct Ruleset {
    uint64_t files = kFirstVersion, network = 0, scopes = 0;
};

Ruleset ruleset_of(int version) {
    Ruleset ruleset;
    if (version >= 2) ruleset.files |= kRefer;
    if (version >= 3) ruleset.files |= kTruncate;
    if (version >= 5) ruleset.files |= kIoctl;
    if (version >= 6) ruleset.scopes |= kSignals;
    return ruleset;
}

std::vector<std::string> folders_of_system() {
    std::vector<std::string> folders = {"/usr", "/lib", "/lib64", "/etc", "/proc", "/sys"};
    std::error_code error;
    const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    if (!error)
        for (const auto& one :
             {folder, folder.parent_path() / "lib", folder.parent_path() / "share"})
            folders.push_back(one.string());
    return folders;
}

void allow(int rules, const std::vector<std::string>& paths, uint64_t access) {
    for (const std::string& path : paths) {
        const int file = ::open(path.c_str(), O_PATH | O_CLOEXEC);
        struct stat found = {};
        if (file < 0 || ::fstat(file, &found) != 0) continue;
        landlock_path_beneath_attr beneath = {};
        beneath.allowed_access = S_ISDIR(found.st_mode) ? access : access & kOfFiles;
        beneath.parent_fd = file;
        (void)::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
        ::close(file);
    }
}

}  // namespace

void HelperEnd::close() {
    if (fd >= 0) ::close(fd);
    fd = -1;
}

Status HelperProcess::start(const std::string& program, const std::string& word) {
    end();
    HelperEnd read, write;
    int fault = open_pipe(read, to_) && open_pipe(from_, write) ? 0 : errno;
    if (fault == 0) {
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, read.fd, STDIN_FILENO);
        posix_spawn_file_actions_adddup2(&actions, write.fd, STDOUT_FILENO);
        posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
        std::array<char*, 3> words = {const_cast<char*>(program.c_str()),
                                      const_cast<char*>(word.c_str()), nullptr};
        fault = posix_spawn(&pid_, program.c_str(), &actions, nullptr, words.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
    }
    if (fault == 0) return Status();
    pid_ = -1;
    return Status(StatusCode::internal,
                  concat("a process for images cannot be started: ", std::strerror(fault)));
}

bool HelperProcess::runs() {
    if (pid_ >= 0 && ::waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
    return pid_ >= 0;
}

bool HelperProcess::send(std::string_view text) {
    return send_all(to_.fd, text);
}

int HelperProcess::wait() {
    int state = 0;
    while (::waitpid(pid_, &state, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return state;
}

void HelperProcess::end() {
    to_.close();
    from_.close();
    if (pid_ < 0) return;
    ::kill(pid_, SIGKILL);
    // One of the lowest priority may need seconds for its end on a busy machine. Nobody waits for
    // it: the system removes it after this process.
    constexpr auto kStep = std::chrono::milliseconds(1);
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    while (::waitpid(pid_, nullptr, WNOHANG) == 0 && std::chrono::steady_clock::now() < until)
        std::this_thread::sleep_for(kStep);
    pid_ = -1;
}

bool send_all(int fd, std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const ssize_t got = ::write(fd, text.data() + at, text.size() - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += size_t(got);
    }
    return true;
}

void set_limit(decltype(RLIMIT_AS) what, rlim_t most) {
    const rlimit both = {most, most};
    (void)setrlimit(what, &both);
}

int landlock_version() {
    return std::max(0, int(::syscall(SYS_landlock_create_ruleset, nullptr, 0,
                                     LANDLOCK_CREATE_RULESET_VERSION)));
}

Status confine_helper(const std::vector<std::string>& folders,
                      const std::vector<std::string>& devices,
                      const std::vector<std::string>& own) {
    const int version = landlock_version();
    if (version == 0) return Status();
    const Ruleset ruleset = ruleset_of(version);
    const int rules = int(::syscall(SYS_landlock_create_ruleset, &ruleset, sizeof(ruleset), 0));
    allow(rules, folders_of_system(), kReads);
    allow(rules, folders, kReads);
    allow(rules, own,
          (kReads | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG |
           LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE | kTruncate) &
              ruleset.files);
    allow(rules, devices,
          (kReads | LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate | kIoctl) & ruleset.files);
    const bool confined = ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
                          ::syscall(SYS_landlock_restrict_self, rules, 0) == 0;
    const int fault = errno;
    ::close(rules);
    return confined ? Status()
                    : Status(StatusCode::internal,
                             concat("Landlock cannot be used: ", std::strerror(fault)));
}

std::vector<std::string> devices_of_system() {
    std::vector<std::string> devices;
    std::error_code error;
    for (std::filesystem::directory_iterator at("/dev", error), end; !error && at != end;
         at.increment(error)) {
        const std::string name = at->path().filename();
        std::error_code unknown;
        if (name == "dri" || name.starts_with("nvidia") ||
            at->symlink_status(unknown).type() == std::filesystem::file_type::character)
            devices.push_back(at->path());
    }
    return devices;
}

}  // namespace postchain::service

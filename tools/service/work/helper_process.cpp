#include "tools/service/work/helper_process.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

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

void allow(int rules, const std::vector<std::string>& folders, uint64_t access) {
    for (const std::string& folder : folders) {
        landlock_path_beneath_attr beneath = {};
        beneath.allowed_access = access;
        beneath.parent_fd = ::open(folder.c_str(), O_PATH | O_CLOEXEC);
        if (beneath.parent_fd < 0) continue;
        (void)::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
        ::close(beneath.parent_fd);
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
    (void)wait();
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

void confine_helper(const std::vector<std::string>& folders,
                    const std::vector<std::string>& devices) {
    landlock_ruleset_attr attributes = {};
    constexpr uint64_t kReads =
        LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
    attributes.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;  // version 1
    const int rules =
        int(::syscall(SYS_landlock_create_ruleset, &attributes, sizeof(attributes), 0));
    if (rules < 0) return;  // a kernel without it
    allow(rules, folders_of_system(), kReads);
    allow(rules, folders, kReads);
    allow(rules, devices, kReads | LANDLOCK_ACCESS_FS_WRITE_FILE);
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0)
        (void)::syscall(SYS_landlock_restrict_self, rules, 0);
    ::close(rules);
}

}  // namespace postchain::service

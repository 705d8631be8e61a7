#include "tools/apps/common/confine.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;

// Landlock grew by versions; headers of Debian 12 know the first two.
constexpr uint64_t kReads =
    LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr uint64_t kFirstVersion = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;  // 1: its rights
constexpr uint64_t kRefer = uint64_t(1) << 13;     // 2: rename and link between folders
constexpr uint64_t kTruncate = uint64_t(1) << 14;  // 3: truncate(), O_TRUNC
constexpr uint64_t kIoctl = uint64_t(1) << 15;     // 5: ioctl() of devices
constexpr uint64_t kSignals = uint64_t(1) << 1;    // 6: to processes that are not confined with it
constexpr uint64_t kWrites = kReads | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG |
                             LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE |
                             kTruncate;
constexpr uint64_t kUses = kReads | LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate | kIoctl;
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

// Folders in which the loader looks for modules, as RUNPATH and LD_LIBRARY_PATH name them.
std::vector<std::string> folders_of_modules() {
    std::vector<std::string> folders;
    void* self = ::dlopen(nullptr, RTLD_LAZY);
    Dl_serinfo size = {};
    if (!self || ::dlinfo(self, RTLD_DI_SERINFOSIZE, &size) != 0) return folders;
    std::vector<std::max_align_t> room(size.dls_size / sizeof(std::max_align_t) + 1);
    auto* found = reinterpret_cast<Dl_serinfo*>(room.data());
    *found = size;
    if (::dlinfo(self, RTLD_DI_SERINFO, found) != 0) return folders;
    for (unsigned i = 0; i < found->dls_cnt; ++i)
        if (const char* name = found->dls_serpath[i].dls_name; *name == '/')
            folders.emplace_back(name);
    return folders;
}

std::vector<std::string> folders_of_system() {
    std::vector<std::string> folders = {"/usr", "/lib", "/lib64", "/etc", "/proc", "/sys"};
    std::error_code error;
    const auto folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    if (!error)
        for (const auto& one :
             {folder, folder.parent_path() / "lib", folder.parent_path() / "share"})
            folders.push_back(one.string());
    for (std::string& one : folders_of_modules()) folders.push_back(std::move(one));
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

Status cannot_be_used(const char* what, int fault) {
    return Status(StatusCode::internal, concat(what, " cannot be used: ", std::strerror(fault)));
}

bool has_seccomp() {
    return ::prctl(PR_GET_SECCOMP) >= 0;
}

// io_uring makes sockets past the filter.
Status refuse_network() {
    if (!has_seccomp()) return Status();
    const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    if (!filter) return cannot_be_used("seccomp", ENOMEM);
    int fault = seccomp_rule_add(filter, SCMP_ACT_ERRNO(EACCES), SCMP_SYS(socket), 1,
                                 SCMP_A0(SCMP_CMP_NE, AF_UNIX));
    for (const int call :
         {SCMP_SYS(io_uring_setup), SCMP_SYS(io_uring_enter), SCMP_SYS(io_uring_register)})
        if (fault == 0) fault = seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), call, 0);
    if (fault == 0) fault = seccomp_load(filter);
    seccomp_release(filter);
    return fault == 0 ? Status() : cannot_be_used("seccomp", -fault);
}

// A folder that no other program reads: a process that was taken over may write anything there.
std::string own_programs() {
    for (const char* name : {"MESA_SHADER_CACHE_DIR", "XDG_CACHE_HOME", "HOME"}) {
        const char* folder = std::getenv(name);
        if (!folder || *folder == 0) continue;
        std::string own = folder;
        if (*name != 'M') own += *name == 'H' ? "/.cache/postchain" : "/postchain";
        ::setenv("MESA_SHADER_CACHE_DIR", own.c_str(), 1);
        ::setenv("__GL_SHADER_DISK_CACHE_PATH", own.c_str(), 1);
        (void)make_folders(own);
        return own;
    }
    return "";
}

}  // namespace

int landlock_version() {
    return std::max(0, int(::syscall(SYS_landlock_create_ruleset, nullptr, 0,
                                     LANDLOCK_CREATE_RULESET_VERSION)));
}

std::string confinement() {
    std::string missing;
    if (landlock_version() == 0)
        missing = "this kernel has no Landlock: libraries may open files outside the folders";
    if (!has_seccomp())
        missing += concat(missing.empty() ? "" : "; ",
                          "this kernel has no seccomp: the network is not closed");
    return missing;
}

Status confine(const Confinement& to) {
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return cannot_be_used("no_new_privs", errno);
    if (const int version = landlock_version(); version > 0) {
        const Ruleset ruleset = ruleset_of(version);
        const int rules = int(::syscall(SYS_landlock_create_ruleset, &ruleset, sizeof(ruleset), 0));
        allow(rules, folders_of_system(), kReads);
        allow(rules, to.reads, kReads);
        allow(rules, to.writes, kWrites & ruleset.files);
        allow(rules, to.devices, kUses & ruleset.files);
        const bool confined = ::syscall(SYS_landlock_restrict_self, rules, 0) == 0;
        const int fault = errno;
        ::close(rules);
        if (!confined) return cannot_be_used("Landlock", fault);
    }
    return refuse_network();
}

Status confine_to(const std::vector<std::string>& folders, const std::vector<std::string>& files) {
    Confinement to{files, {}, devices_of_system()};
    for (const std::string& folder : folders) {
        std::error_code error;
        to.writes.push_back(fs::canonical(folder, error).string());
        if (error || !fs::is_directory(folder, error))
            return Status(StatusCode::usage, "--confine-to: " + folder + ": is not a folder");
    }
    std::vector<std::string> readable = folders_of_system();
    for (const std::string& file : files) {
        std::error_code error;
        readable.push_back(fs::weakly_canonical(file, error).string());
    }
    const std::string programs = own_programs();
    confine_files(to.writes, readable);
    if (!programs.empty()) to.writes.push_back(programs);
    return confine(to);
}

std::vector<std::string> devices_of_system() {
    std::vector<std::string> devices;
    std::error_code error;
    for (fs::directory_iterator at("/dev", error), end; !error && at != end; at.increment(error)) {
        const std::string name = at->path().filename();
        std::error_code unknown;
        if (name == "dri" || name.starts_with("nvidia") ||
            at->symlink_status(unknown).type() == fs::file_type::character)
            devices.push_back(at->path());
    }
    return devices;
}

}  // namespace postchain

#include "tools/service/work/image_helper.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
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
#include <optional>

#include "chain/base/readable_file.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/image_file.h"
#include "tools/service/work/previews.h"

extern char** environ;

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using io::Json;

constexpr auto kLongestImage = std::chrono::seconds(60);
constexpr rlim_t kCpuSeconds = 60;
// Libraries and threads, beside the frame.
constexpr uint64_t kOwnMemory = uint64_t(2) << 30;
constexpr size_t kMaxReply = size_t(1) << 30;
constexpr size_t kNeedBytes = 1 + sizeof(uint64_t);  // "n" and the bytes of a frame
constexpr const char* kNoVersion = "";               // of metadata, which images do not have

// ---------------------------------------------------------------------------------- the service
class HelperEnd {
  public:
    ~HelperEnd() { close(); }
    void close() {
        if (fd >= 0) ::close(fd);
        fd = -1;
    }
    int fd = -1;
};

struct HelperPipe {
    HelperEnd read, write;
    bool open() {
        std::array<int, 2> ends;
        if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
        read.fd = ends[0];
        write.fd = ends[1];
        return true;
    }
};

// A child that is killed, unless it has ended, and always waited for.
class HelperProcess {
  public:
    ~HelperProcess() {
        if (pid < 0) return;
        ::kill(pid, SIGKILL);
        (void)wait();
    }
    int wait() {
        int state = 0;
        while (::waitpid(pid, &state, 0) < 0 && errno == EINTR) {
        }
        pid = -1;
        return state;
    }
    pid_t pid = -1;
};

bool start_helper(const std::string& program, HelperPipe& to, HelperPipe& from,
                  HelperProcess& child) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, to.read.fd, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, from.write.fd, STDOUT_FILENO);
    posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
    std::array<char*, 3> words = {const_cast<char*>(program.c_str()),
                                  const_cast<char*>(kImageHelper), nullptr};
    const int fault =
        posix_spawn(&child.pid, program.c_str(), &actions, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (fault != 0) child.pid = -1;
    to.read.close();
    from.write.close();
    return fault == 0;
}

bool send_all(int fd, const std::string& text) {
    for (size_t at = 0; at < text.size();) {
        const ssize_t got = ::write(fd, text.data() + at, text.size() - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += size_t(got);
    }
    return true;
}

// What the child writes, up to `most` bytes in all. Errors: it takes too long, or the client has
// left.
Status read_from_helper(int fd, const ImageWanted& wanted, size_t most, std::string& reply) {
    const auto end = Clock::now() + kLongestImage;
    std::array<char, 65536> part;
    while (reply.size() < most) {
        if (wanted.left && *wanted.left) return Status(StatusCode::canceled, "the client has left");
        if (Clock::now() > end)
            return Status(StatusCode::input,
                          concat("was not read within ", kLongestImage.count(), " s"));
        pollfd ready = {fd, POLLIN, 0};
        const int found = ::poll(&ready, 1, 200);
        if (found == 0 || (found < 0 && errno == EINTR)) continue;
        const ssize_t got = ::read(fd, part.data(), std::min(part.size(), most - reply.size()));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return Status();
        reply.append(part.data(), size_t(got));
    }
    return most < kMaxReply ? Status() : Status(StatusCode::input, "is too large");
}

// ---------------------------------------------------------------------------------- the process
void set_limit(decltype(RLIMIT_AS) what, rlim_t most) {
    const rlimit both = {most, most};
    (void)setrlimit(what, &both);
}

// Reading below these folders is allowed, and nothing else that Landlock controls.
void confine_helper(const std::vector<std::string>& folders) {
    landlock_ruleset_attr rules = {};
    constexpr uint64_t kReads =
        LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
    rules.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;  // version 1
    const int set = int(::syscall(SYS_landlock_create_ruleset, &rules, sizeof(rules), 0));
    if (set < 0) return;  // a kernel without it
    for (const std::string& folder : folders) {
        landlock_path_beneath_attr beneath = {};
        beneath.allowed_access = kReads;
        beneath.parent_fd = ::open(folder.c_str(), O_PATH | O_CLOEXEC);
        if (beneath.parent_fd < 0) continue;
        (void)::syscall(SYS_landlock_add_rule, set, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
        ::close(beneath.parent_fd);
    }
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0)
        (void)::syscall(SYS_landlock_restrict_self, set, 0);
    ::close(set);
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

Result<std::string> image_of_task(const Json& task, const PassRegistry& registry) {
    ASSIGN_OR_RETURN(auto roots, Roots::of(task.at("roots").get<std::vector<std::string>>()));
    const auto within = task.at("within").get<std::vector<std::string>>();
    ASSIGN_OR_RETURN(roots, roots.within(within));
    confine_reads(roots.entries());
    // Loaded from wherever the program finds it.
    const std::string path = task.at("path");
    if (io::image_format_of(path)) (void)io::image_module(StatusCode::input);
    auto folders = folders_of_system();
    for (const std::string& folder : roots.entries()) folders.push_back(folder);
    confine_helper(folders);
    sequence::SourceSettings source;
    if (const std::string body = task.at("body"); !body.empty()) {
        const std::string version = kNoVersion;
        auto read = JobReader(roots, registry, version, 1).job(body);
        if (const auto* refused = std::get_if<Problem>(&read))
            return Status(StatusCode::input, refused->detail);
        source = std::get<JobRequest>(read).run.source;
    }
    source.max_memory = task.at("memory");
    const ImageWanted wanted{.type = task.at("type"), .side = task.at("side")};
    return image_of(path, task.at("frame"), source, wanted, [](uint64_t bytes) {
        // The service answers when there is room.
        std::array<char, kNeedBytes> need = {'n'};
        std::memcpy(need.data() + 1, &bytes, sizeof(bytes));
        char answer = 0;
        if (!send_all(STDOUT_FILENO, {need.data(), need.size()}) ||
            ::read(STDIN_FILENO, &answer, 1) != 1)
            _exit(1);
    });
}

}  // namespace

Result<std::string> image_by_helper(const std::string& program, const ShownFrame& shown,
                                    const Roots& roots, const ImageWanted& wanted,
                                    sequence::MemoryGate& gate) {
    const Json task = {{"roots", roots.folders()}, {"within", roots.entries()},
                       {"body", shown.body},       {"path", shown.path},
                       {"frame", shown.frame},     {"memory", shown.source.max_memory},
                       {"type", wanted.type},      {"side", wanted.side}};
    HelperPipe to, from;
    HelperProcess child;
    if (!to.open() || !from.open() || !start_helper(program, to, from, child))
        return Status(StatusCode::internal,
                      concat("the process for images cannot be started: ", std::strerror(errno)));
    (void)send_all(to.write.fd, io::json_text(task) + "\n");
    std::string reply;
    RETURN_IF_ERROR(read_from_helper(from.read.fd, wanted, kNeedBytes, reply).at(shown.path));
    std::optional<MemoryPlace> place;
    if (reply.size() == kNeedBytes && reply[0] == 'n') {
        uint64_t bytes = 0;
        std::memcpy(&bytes, reply.data() + 1, sizeof(bytes));
        place.emplace(gate, std::min(bytes, shown.source.max_memory));
        reply.clear();
        (void)send_all(to.write.fd, "g");
        RETURN_IF_ERROR(read_from_helper(from.read.fd, wanted, kMaxReply, reply).at(shown.path));
    } else {
        RETURN_IF_ERROR(read_from_helper(from.read.fd, wanted, kMaxReply, reply).at(shown.path));
    }
    const int state = child.wait();
    if (WIFSIGNALED(state) || !WIFEXITED(state) || WEXITSTATUS(state) != 0 || reply.empty())
        return Status(StatusCode::input, concat(shown.path, ": its reader ",
                                                WIFSIGNALED(state) && WTERMSIG(state) == SIGXCPU
                                                    ? std::string("took too long")
                                                    : std::string("crashed"),
                                                "; the file is damaged or too large"));
    if (reply[0] == 'k') return reply.substr(1);
    const Json fault = Json::parse(reply.substr(1), nullptr, false);
    if (!fault.is_object()) return Status(StatusCode::internal, "the process for images failed");
    return Status(StatusCode(fault.value("code", int(StatusCode::internal))),
                  fault.value("message", ""));
}

int run_image_helper(const PassRegistry& registry) {
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_CPU, kCpuSeconds);
    set_limit(RLIMIT_FSIZE, 0);
    // A line; what follows it is the answer of the service.
    std::string text;
    for (char c = 0; ::read(STDIN_FILENO, &c, 1) == 1 && c != '\n';) text += c;
    std::string reply;
    try {
        const Json task = Json::parse(text);
        set_limit(RLIMIT_AS, rlim_t(kOwnMemory + 3 * task.at("memory").get<uint64_t>()));
        auto image = image_of_task(task, registry);
        reply = image.ok() ? "k" + *image
                           : "e" + io::json_text({{"code", int(image.status().code())},
                                                  {"message", image.status().message()}});
    } catch (...) {
        const Status status = status_of_exception("the image");
        reply = "e" + io::json_text({{"code", int(status.code())}, {"message", status.message()}});
    }
    const bool written = send_all(STDOUT_FILENO, reply);
    // Nothing that a damaged file has left behind is run any more.
    _exit(written ? 0 : 1);
}

}  // namespace postchain::service

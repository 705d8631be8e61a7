#include "tools/service/work/image_helper.h"

#include <malloc.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <optional>

#include "chain/base/readable_file.h"
#include "tools/apps/common/confine.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/image_file.h"
#include "tools/service/work/helper_process.h"
#include "tools/service/work/previews.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using io::Json;

constexpr auto kLongestImage = std::chrono::seconds(60);
constexpr rlim_t kCpuSeconds = 60;
constexpr int kKeptBytes = 1 << 29;
constexpr size_t kMaxReply = size_t(kLargestImageSide) * kLargestImageSide * 8;
constexpr size_t kNeedBytes = 1 + sizeof(uint64_t);  // "n" and the bytes of a frame
constexpr const char* kNoVersion = "";               // of metadata, which images do not have

// ---------------------------------------------------------------------------------- the service
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
Result<std::string> image_of_task(const Json& task, const PassRegistry& registry) {
    ASSIGN_OR_RETURN(auto roots, Roots::of(task.at("roots").get<std::vector<std::string>>()));
    const auto within = task.at("within").get<std::vector<std::string>>();
    ASSIGN_OR_RETURN(roots, roots.within(within));
    confine_files(roots.entries());
    // Loaded from wherever the program finds it.
    const std::string path = task.at("path");
    if (io::image_format_of(path)) (void)io::image_module(StatusCode::input);
    RETURN_IF_ERROR(confine({.reads = roots.entries()}));
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
    HelperProcess child;
    RETURN_IF_ERROR(child.start(program, kImageHelper));
    (void)child.send(io::json_text(task) + "\n");
    std::string reply;
    RETURN_IF_ERROR(read_from_helper(child.from(), wanted, kNeedBytes, reply).at(shown.path));
    std::optional<MemoryPlace> place;
    if (reply.size() == kNeedBytes && reply[0] == 'n') {
        uint64_t bytes = 0;
        std::memcpy(&bytes, reply.data() + 1, sizeof(bytes));
        place.emplace(gate, std::min(bytes, shown.source.max_memory));
        reply.clear();
        (void)child.send("g");
        RETURN_IF_ERROR(read_from_helper(child.from(), wanted, kMaxReply, reply).at(shown.path));
    } else {
        RETURN_IF_ERROR(read_from_helper(child.from(), wanted, kMaxReply, reply).at(shown.path));
    }
    const int state = child.wait();
    if (WIFSIGNALED(state) || !WIFEXITED(state) || WEXITSTATUS(state) != 0 || reply.empty())
        return Status(StatusCode::input, concat(shown.path, ": its reader ",
                                                WIFSIGNALED(state) && WTERMSIG(state) == SIGXCPU
                                                    ? std::string("took too long")
                                                    : std::string("crashed"),
                                                "; the file is damaged or too large"));
    if (reply[0] == 'k') {
        reply.erase(0, 1);
        return reply;
    }
    const Json fault = Json::parse(reply.substr(1), nullptr, false);
    if (!fault.is_object()) return Status(StatusCode::internal, "the process for images failed");
    return Status(StatusCode(fault.value("code", int(StatusCode::internal))),
                  fault.value("message", ""));
}

int run_image_helper(const PassRegistry& registry) {
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_CPU, kCpuSeconds);
    set_limit(RLIMIT_FSIZE, 0);
    // The buffers of each strip are those of the one before.
    mallopt(M_MMAP_THRESHOLD, kKeptBytes);
    mallopt(M_TRIM_THRESHOLD, kKeptBytes);
    // A line; what follows it is the answer of the service.
    std::string text;
    for (char c = 0; ::read(STDIN_FILENO, &c, 1) == 1 && c != '\n';) text += c;
    const auto image = [&]() -> Result<std::string> {
        try {
            const Json task = Json::parse(text);
            set_limit(RLIMIT_AS, rlim_t(kOwnMemory + 3 * task.at("memory").get<uint64_t>()));
            return image_of_task(task, registry);
        } catch (...) {
            return status_of_exception("the image");
        }
    }();
    const bool written =
        image.ok()
            ? send_all(STDOUT_FILENO, "k") && send_all(STDOUT_FILENO, *image)
            : send_all(STDOUT_FILENO, "e" + io::json_text({{"code", int(image.status().code())},
                                                           {"message", image.status().message()}}));
    // Nothing that a damaged file has left behind is run any more.
    _exit(written ? 0 : 1);
}

}  // namespace postchain::service

#include "tools/service/work/image_process.h"

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

#include "tools/sequence/files/json.h"
#include "tools/service/work/helper_process.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using io::Json;

constexpr auto kLongestImage = std::chrono::seconds(60);
constexpr size_t kMaxReply = size_t(kLargestImageSide) * kLargestImageSide * 8;
constexpr size_t kNeedBytes = 1 + sizeof(uint64_t);  // "n" and the bytes of a frame

// What the process writes, up to `most` bytes in all. Errors: it takes too long, or the client has
// left.
Status read_from(int fd, const ImageWanted& wanted, size_t most, std::string& reply) {
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

}  // namespace

Result<std::string> image_of(const std::string& program, const ShownFrame& shown,
                             const Roots& roots, const ImageWanted& wanted, MemoryGate& gate) {
    const Json task = {{"folders", roots.entries()}, {"words", shown.words},
                       {"path", shown.path},         {"frame", shown.frame},
                       {"memory", gate.limit()},     {"type", wanted.type},
                       {"side", wanted.side}};
    HelperProcess child;
    RETURN_IF_ERROR(child.start(program, kImageWord, kOwnMemory + 3 * gate.limit()));
    (void)child.send(io::json_text(task) + "\n");
    std::string reply;
    RETURN_IF_ERROR(read_from(child.from(), wanted, kNeedBytes, reply).at(shown.path));
    std::optional<MemoryGate::Place> place;
    if (reply.size() == kNeedBytes && reply[0] == 'n') {
        uint64_t bytes = 0;
        std::memcpy(&bytes, reply.data() + 1, sizeof(bytes));
        place.emplace(gate, std::min(bytes, gate.limit()));
        reply.clear();
        (void)child.send("g");
    }
    RETURN_IF_ERROR(read_from(child.from(), wanted, kMaxReply, reply).at(shown.path));
    const int state = child.wait();
    if (!WIFEXITED(state) || WEXITSTATUS(state) != 0 || reply.empty())
        return Status(StatusCode::input,
                      shown.path + ": its reader crashed; the file is damaged or too large");
    if (reply[0] == 'k') {
        reply.erase(0, 1);
        return reply;
    }
    const Json fault = Json::parse(reply.substr(1), nullptr, false);
    if (!fault.is_object()) return Status(StatusCode::internal, "the process for images failed");
    return Status(StatusCode(fault.value("code", int(StatusCode::internal))),
                  fault.value("message", ""));
}

}  // namespace postchain::service

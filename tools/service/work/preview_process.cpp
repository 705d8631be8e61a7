#include "tools/service/work/preview_process.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>

#include "tools/sequence/files/json.h"
#include "tools/service/work/programs.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using io::Json;

// After a preview is over. A process that takes longer is killed.
constexpr auto kEndPatience = std::chrono::seconds(10);
constexpr uint64_t kMostBytes = uint64_t(1) << 30;  // of a reply

Status status_of_reply(const std::string& bytes) {
    const Json fault = Json::parse(bytes, nullptr, false);
    if (!fault.is_object()) return Status(StatusCode::internal, "the process for previews failed");
    return Status(StatusCode(fault.value("code", int(StatusCode::internal))),
                  fault.value("message", ""));
}

}  // namespace

PreviewProcess::PreviewProcess(const ServiceSettings& settings, uint64_t memory,
                               const std::atomic<bool>& ends)
    : program_(settings.preview_program),
      settings_(io::json_text({{"device", settings.device},
                               {"threads", settings.threads},
                               {"folders", settings.roots.folders()},
                               {"memory", memory}})),
      memory_(memory),
      ends_(ends) {}

Status PreviewProcess::start() {
    RETURN_IF_ERROR(process_.start(program_, kPreviewWord, kOwnMemory + 4 * memory_));
    (void)process_.send(settings_ + "\n");
    return Status();
}

Result<std::string> PreviewProcess::test() {
    if (!process_.runs()) RETURN_IF_ERROR(start());
    Reply reply = exchange(io::json_text({{"test", true}}), [] { return false; });
    RETURN_IF_ERROR(reply.status);
    if (reply.type == kFailed) return status_of_reply(reply.bytes);
    return std::move(reply.bytes);
}

Answer<std::string> PreviewProcess::preview(const std::string& body, const JobRequest& request,
                                            const Roots& roots, const std::string& type,
                                            const std::function<bool()>& over) {
    if (!process_.runs())
        if (const auto tested = test(); !tested.ok()) return problem_of(tested.status(), roots);
    const NamedText& chain = request.subjects.front();
    std::vector<std::string> words;
    for (const auto& [key, word] : request.options) words.push_back(word);
    Json task = {{"folders", roots.entries()},
                 {"start", roots.folders().front()},
                 {"words", words},
                 {"frame", request.frame},
                 {"scale", request.scale},
                 {"depth", request.shows_depth},
                 {"type", type}};
    if (chain.written) {
        task["chain_name"] = chain.word;
        task["chain_text"] = chain.text;
    } else {
        task["chain"] = chain.word;
    }
    Reply reply = exchange(io::json_text(task), over);
    if (!reply.status.ok()) {
        const auto file = io::InputSpec::parse(request.input);
        const bool died = reply.status.code() == StatusCode::gl && file.ok();
        return problem_of(
            died ? Status(StatusCode::input, file->color().format(request.frame) +
                                                 ": its reader crashed, or the driver; the file is "
                                                 "damaged or too large")
                 : reply.status,
            roots);
    }
    if (reply.type == kDone) return std::move(reply.bytes);
    const Json fault = Json::parse(reply.bytes, nullptr, false);
    if (fault.is_object() && fault.contains("faults"))
        return problem_of_faults(fault.at("faults"), body, request, roots);
    return problem_of(status_of_reply(reply.bytes), roots);
}

// Sends a task and returns its reply. Errors: (gl) the process died; (canceled).
PreviewProcess::Reply PreviewProcess::exchange(const std::string& task,
                                               const std::function<bool()>& over) {
    // After a failure the process may still write a reply, which must not answer the next task.
    struct EndUnlessReplied {
        HelperProcess& process;
        bool replied = false;
        ~EndUnlessReplied() {
            if (!replied) process.end();
        }
    } end{process_};
    (void)process_.send(task + "\n");
    std::string got;
    std::array<char, 65536> part;
    std::optional<Clock::time_point> told;
    for (;;) {
        uint64_t length = 0;
        if (got.size() >= kMessageHead) std::memcpy(&length, got.data() + 1, sizeof(length));
        if (length > kMostBytes) break;
        if (got.size() >= kMessageHead && got.size() >= kMessageHead + length) {
            if (got[0] != kDone && got[0] != kFailed) break;
            end.replied = true;
            return {Status(), got[0], got.substr(kMessageHead, length)};
        }
        if (!told && over()) {
            told = Clock::now();
            (void)process_.send(std::string(kStop) + "\n");
        }
        if (ends_ || (told && Clock::now() - *told > kEndPatience))
            return {Status(StatusCode::canceled, "the preview was canceled"), kFailed, {}};
        pollfd ready = {process_.from(), POLLIN, 0};
        const int found = ::poll(&ready, 1, 50);
        if (found == 0 || (found < 0 && errno == EINTR)) continue;
        const ssize_t read = ::read(process_.from(), part.data(), part.size());
        if (read < 0 && errno == EINTR) continue;
        if (read <= 0) break;
        got.append(part.data(), size_t(read));
    }
    return {Status(StatusCode::gl, "the process for previews crashed"), kFailed, {}};
}

}  // namespace postchain::service

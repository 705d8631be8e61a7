#include "tools/service/work/previews.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <future>

#include "tools/sequence/files/json.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/programs.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using io::Json;

constexpr size_t kMaxWaiting = 64;
// A request ends earlier, and its preview with it.
constexpr auto kThreadPatience = std::chrono::minutes(5);
constexpr auto kTestPatience = std::chrono::seconds(1);
// After a preview is over. A process that takes longer is killed.
constexpr auto kEndPatience = std::chrono::seconds(10);
constexpr uint64_t kMostBytes = uint64_t(1) << 30;  // of a reply

Problem too_many_previews() {
    return {Problem::Kind::busy, "too many previews are waiting; try again", {}, 1};
}

}  // namespace

// ----------------------------------------------------------------------------------- the process
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
    ProcessSettings process{{program_, kPreviewWord}};
    process.memory = kOwnMemory + 4 * memory_;
    RETURN_IF_ERROR(process_.start(process));
    (void)process_.send(settings_ + "\n");
    return Status();
}

Result<std::string> PreviewProcess::test() {
    const std::lock_guard lock(mutex_);
    return tested();
}

Result<std::string> PreviewProcess::tested() {
    if (!process_.runs()) RETURN_IF_ERROR(start());
    Reply reply = exchange(io::json_text({{"test", true}}), [] { return false; });
    RETURN_IF_ERROR(reply.status);
    if (reply.type == kFailed) return status_of_json(reply.bytes);
    return std::move(reply.bytes);
}

Answer<std::string> PreviewProcess::preview(const std::string& body, const JobRequest& request,
                                            const Roots& roots, const std::string& type,
                                            const std::function<bool()>& over) {
    const std::lock_guard lock(mutex_);
    if (!process_.runs())
        if (const auto renderer = tested(); !renderer.ok())
            return problem_of(renderer.status(), roots);
    const NamedText& chain = request.subjects.front();
    std::vector<std::string> words;
    for (const auto& [key, word] : request.options) words.push_back(word);
    Json task = {{"folders", roots.entries()}, {"start", roots.folders().front()}, {"words", words},
                 {"frame", request.frame},     {"scale", request.scale},           {"type", type}};
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
    const auto fault = io::read_json(reply.bytes, "fault", io::kReportLimits);
    if (fault.ok() && fault->contains("faults"))
        return problem_of_faults(fault->at("faults"), body, request, roots);
    return problem_of(status_of_json(reply.bytes), roots);
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

// ------------------------------------------------------------------------------------ the thread
Previews::Previews(const ServiceSettings& settings, uint64_t memory)
    : process_(settings, memory, ends_), threads_(1, kMaxWaiting, kThreadPatience) {}

Status Previews::begin() {
    RETURN_IF_ERROR(threads_.begin());
    std::promise<void> made;
    if (threads_.run([&] {
            (void)process_.test();
            made.set_value();
        }))
        made.get_future().get();
    return Status();
}

void Previews::run(const std::string& body, JobRequest request, const Roots& roots,
                   const PictureWanted& wanted, GivePicture done) {
    auto ticket = std::make_shared<Ticket>();
    ticket->stop = wanted.left ? wanted.left : std::make_shared<std::atomic<bool>>(false);
    if (!wanted.session.empty()) {
        const std::lock_guard lock(mutex_);
        std::erase_if(newest_, [](const auto& one) { return one.second.expired(); });
        auto& newest = newest_[wanted.session];
        if (const auto former = newest.lock()) {
            former->replaced = true;
            *former->stop = true;
        }
        newest = ticket;
    }
    const auto work = [this, body, request = std::move(request), roots, type = wanted.type, ticket,
                       done] {
        const auto over = [&] { return ends_ || *ticket->stop; };
        auto made = [&]() -> Answer<std::string> {
            try {
                if (over()) return Problem{Problem::Kind::unavailable, "the preview was canceled"};
                return process_.preview(body, request, roots, type, over);
            } catch (...) {
                return problem_of(status_of_exception("the preview"), roots);
            }
        }();
        if (ticket->replaced)
            done(Problem{Problem::Kind::conflict,
                         "a later preview of this session has replaced this one"});
        else if (!made.ok())
            done(made.status());
        else
            done(Picture{type, std::move(*made)});
    };
    if (!threads_.run(work, {wanted.share, [done] { done(too_many_previews()); }}))
        throw too_many_previews();
}

std::optional<Result<std::string>> Previews::test() {
    const auto promise = std::make_shared<std::promise<Result<std::string>>>();
    auto tested = promise->get_future();
    const bool taken = threads_.run([this, promise] { promise->set_value(process_.test()); });
    if (!taken || tested.wait_for(kTestPatience) != std::future_status::ready) return std::nullopt;
    return tested.get();
}

size_t Previews::end() {
    ends_ = true;
    return threads_.end();
}

}  // namespace postchain::service

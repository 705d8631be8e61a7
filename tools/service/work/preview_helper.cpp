#include "tools/service/work/preview_helper.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <thread>

#include "chain/base/readable_file.h"
#include "tools/apps/common/confine.h"
#include "tools/scenes/scene.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/device.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using io::Json;

// After a preview is over. A process that takes longer is killed.
constexpr auto kPreviewPatience = std::chrono::seconds(10);
constexpr int kLowestPriority = 19;                 // as of nice
constexpr uint64_t kMostBytes = uint64_t(1) << 30;  // of a reply

// Lines of the service: the settings, then tasks, and between them:
constexpr const char* kGo = "go";      // the device is reserved
constexpr const char* kStop = "stop";  // the preview is over
// The process writes: one of these, the length of what follows in 8 bytes, and that.
constexpr char kReserve = 'r', kDone = 'd', kFailed = 'f';
constexpr size_t kHeadBytes = 1 + sizeof(uint64_t);

// A hidden folder or file beside the store.
std::string beside(const std::string& store, const char* extension) {
    const std::filesystem::path path(store);
    return (path.parent_path() / ("." + path.filename().string() + extension)).string();
}

// Before the driver is loaded: Mesa's cache of compiled programs. Only the processes for previews
// use this one: a damaged file that takes one over cannot give programs to the service.
void keep_programs_in(const std::string& folder) {
    (void)make_folders(folder);
    ::setenv("MESA_SHADER_CACHE_DIR", folder.c_str(), 1);
    ::setenv("MESA_SHADER_CACHE_MAX_SIZE", "256M", 1);
}

// ---------------------------------------------------------------------------------- the process
std::string message_of(char type, const std::string& bytes) {
    const uint64_t length = bytes.size();
    std::string message(kHeadBytes, type);
    std::memcpy(message.data() + 1, &length, sizeof(length));
    return message + bytes;
}

std::string failure_of(const Status& status) {
    return message_of(kFailed,
                      io::json_text({{"code", int(status.code())}, {"message", status.message()}}));
}

// Reads the service's lines on a thread of its own. The process ends with its input.
class Inbox {
  public:
    void begin() {
        std::thread([this] { read(); }).detach();
    }

    // The next line that is neither kGo nor kStop.
    std::string task() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return !tasks_.empty(); });
        std::string task = std::move(tasks_.front());
        tasks_.pop_front();
        return task;
    }
    bool stopped() const {
        const std::lock_guard lock(mutex_);
        return stopped_;
    }
    void wait_for_go() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return goes_ || stopped_; });
    }

  private:
    void read() {
        std::string line;
        std::array<char, 65536> part;
        for (ssize_t got = 0; (got = ::read(STDIN_FILENO, part.data(), part.size())) != 0;) {
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) break;
            for (const char c : std::string_view(part.data(), size_t(got))) {
                if (c == '\n')
                    take(std::exchange(line, ""));
                else
                    line += c;
            }
        }
        _exit(0);
    }

    void take(std::string line) {
        const std::lock_guard lock(mutex_);
        if (line == kGo) {
            goes_ = true;
        } else if (line == kStop) {
            stopped_ = true;
        } else {
            tasks_.push_back(std::move(line));
            goes_ = stopped_ = false;
        }
        changed_.notify_all();
    }

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::string> tasks_;
    bool goes_ = false, stopped_ = false;
};

class Helper {
  public:
    Helper(const PassRegistry& registry, Inbox& inbox) : registry_(registry), inbox_(inbox) {}

    Status begin() try {
        const Json settings = Json::parse(inbox_.task());
        roots_ = settings.at("roots").get<std::vector<std::string>>();
        memory_ = settings.at("memory");
        threads_ = settings.at("threads");
        programs_ = settings.at("programs");
        keep_programs_in(programs_);
        ASSIGN_OR_RETURN(auto device, sequence::choose_device(settings.at("device"), threads_));
        maker_ = std::make_unique<PreviewMaker>(device, registry_);
        return Status();
    } catch (...) {
        return status_of_exception("the process for previews");
    }

    // The reply to a task.
    std::string answer(const Json& task) {
        if (task.contains("test")) {
            Status status = maker_->test();
            if (status.ok()) status = confine();
            return status.ok() ? message_of(kDone, "") : failure_of(status);
        }
        auto made = preview(task);
        return made.ok() ? message_of(kDone, *made) : failure_of(made.status());
    }

  private:
    // After the driver has opened what it needs. A GPU's driver reserves more addresses than any
    // limit would leave.
    Status confine() {
        if (confined_) return Status();
        if (maker_->software()) set_limit(RLIMIT_AS, rlim_t(kOwnMemory + 4 * memory_));
        RETURN_IF_ERROR(postchain::confine({roots_, {programs_}, devices_of_system()}));
        confined_ = true;
        return Status();
    }

    Result<std::string> preview(const Json& task) {
        RETURN_IF_ERROR(confine());
        ASSIGN_OR_RETURN(auto roots, Roots::of(roots_));
        ASSIGN_OR_RETURN(roots, roots.within(task.at("within").get<std::vector<std::string>>()));
        confine_files(roots.entries());
        const std::string no_version;  // of metadata, which previews do not have
        JobReader reader(roots, registry_, no_version, threads_);
        reader.limit_memory(0, memory_);
        auto read = reader.preview(task.at("body"));
        if (const auto* refused = std::get_if<Problem>(&read))
            return Status(StatusCode::input, refused->detail);
        const PreviewCalls calls = {[this] { return inbox_.stopped(); },
                                    [this] {
                                        if (!send_all(STDOUT_FILENO, message_of(kReserve, "")))
                                            _exit(1);
                                        inbox_.wait_for_go();
                                    }};
        return maker_->preview(std::get<JobRequest>(read), roots, task.at("type"), calls);
    }

    const PassRegistry& registry_;
    Inbox& inbox_;
    std::vector<std::string> roots_;
    uint64_t memory_ = 0;
    int threads_ = 0;
    std::string programs_;  // the folder of compiled programs
    bool confined_ = false;
    std::unique_ptr<PreviewMaker> maker_;
};

Status preview_generated_frame(const Json& settings, const PassRegistry& registry) {
    const std::string folder = settings.at("frames"), programs = settings.at("programs");
    const std::string mark = concat(programs, "/", settings.at("version").get<std::string>());
    std::error_code error;
    if (std::filesystem::exists(mark, error)) return Status();
    keep_programs_in(programs);
    const int threads = settings.at("threads");
    ASSIGN_OR_RETURN(const auto device, sequence::choose_device(settings.at("device"), threads));
    {
        ASSIGN_OR_RETURN(const auto renderer, scenes::SceneRenderer::create(device));
        // Neither the pixels nor the blocks are a power of two, as of most frames.
        scenes::SceneRequest scene;
        scene.name = "wheels";
        scene.folder = folder;
        scene.width = 101;
        scene.height = 67;
        scene.frames = {1, 2};
        scene.on_existing = io::OnExisting::overwrite;
        RETURN_IF_ERROR(scenes::write_scene(*renderer, scene));
    }
    ASSIGN_OR_RETURN(const auto roots, Roots::of({folder}));
    const std::string no_version;
    auto read = JobReader(roots, registry, no_version, threads)
                    .preview(R"({"chain": "balanced", "input": "sharp.####.exr", "camera": )"
                             R"("camera.json", "frame": 1})");
    if (const auto* refused = std::get_if<Problem>(&read))
        return Status(StatusCode::internal, refused->detail);
    PreviewMaker maker(device, registry);
    auto request = std::get<JobRequest>(std::move(read));
    RETURN_IF_ERROR(
        maker.preview(request, roots, "image/png", {[] { return false; }, [] {}}).status());
    std::filesystem::remove_all(folder, error);
    (void)make_folders(mark);
    return Status();
}

}  // namespace

// ---------------------------------------------------------------------------------- the service
PreviewHelper::PreviewHelper(const ServiceSettings& settings, uint64_t memory,
                             const std::atomic<bool>& ends)
    : program_(settings.program),
      settings_(io::json_text({{"device", settings.device},
                               {"threads", settings.threads},
                               {"roots", settings.roots.folders()},
                               {"programs", beside(settings.store, ".programs")},
                               {"frames", beside(settings.store, ".frames")},
                               {"version", settings.version},
                               {"memory", memory}})),
      ends_(ends) {}

Status PreviewHelper::test() {
    if (!process_.runs()) {
        RETURN_IF_ERROR(process_.start(program_, kPreviewHelper));
        (void)process_.send(settings_ + "\n");
    }
    const PreviewCalls calls = {[] { return false; }, [] {}};
    return exchange(io::json_text({{"test", true}}), calls, "").status();
}

void PreviewHelper::keep_programs() {
    if (std::exchange(keeps_programs_, true)) {
        (void)programs_.runs();
    } else if (programs_.start(program_, kProgramHelper).ok()) {
        (void)programs_.send(settings_ + "\n");
    }
}

Result<std::string> PreviewHelper::preview(const std::string& body, const JobRequest& request,
                                           const Roots& roots, const std::string& type,
                                           const PreviewCalls& calls) {
    if (!process_.runs()) RETURN_IF_ERROR(test());
    return exchange(io::json_text({{"within", roots.entries()}, {"body", body}, {"type", type}}),
                    calls, request.run.input.color().format(request.frame));
}

// Sends a task and returns its reply. `file`: whose reader died if the process does.
Result<std::string> PreviewHelper::exchange(const std::string& task, const PreviewCalls& calls,
                                            const std::string& file) {
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
        if (got.size() >= kHeadBytes) std::memcpy(&length, got.data() + 1, sizeof(length));
        if (got.size() >= kHeadBytes && length <= kMostBytes && got.size() >= kHeadBytes + length) {
            const char what = got[0];
            std::string bytes = got.substr(kHeadBytes, length);
            got.erase(0, kHeadBytes + length);
            end.replied = what == kDone || what == kFailed;
            if (what == kDone) return bytes;
            if (what == kReserve) {
                calls.reserved();
                (void)process_.send(std::string(kGo) + "\n");
                continue;
            }
            if (what != kFailed) break;
            const Json fault = Json::parse(bytes, nullptr, false);
            return Status(StatusCode(fault.at("code").get<int>()), fault.at("message"));
        }
        if (length > kMostBytes) break;
        if (!told && calls.over()) {
            told = Clock::now();
            (void)process_.send(std::string(kStop) + "\n");
        }
        if (ends_ || (told && Clock::now() - *told > kPreviewPatience))
            return Status(StatusCode::canceled, "the preview was canceled");
        pollfd ready = {process_.from(), POLLIN, 0};
        const int found = ::poll(&ready, 1, 50);
        if (found == 0 || (found < 0 && errno == EINTR)) continue;
        const ssize_t read = ::read(process_.from(), part.data(), part.size());
        if (read < 0 && errno == EINTR) continue;
        if (read <= 0) break;
        got.append(part.data(), size_t(read));
    }
    if (file.empty()) return Status(StatusCode::gl, "the process for previews crashed");
    return Status(StatusCode::input,
                  file + ": its reader crashed, or the driver; the file is damaged or too large");
}

int run_preview_helper(const PassRegistry& registry) {
    set_limit(RLIMIT_CORE, 0);
    Inbox inbox;
    inbox.begin();
    Helper helper(registry, inbox);
    for (Status begun = helper.begin();;) {
        const std::string task = inbox.task();
        std::string reply;
        try {
            reply = begun.ok() ? helper.answer(Json::parse(task)) : failure_of(begun);
        } catch (...) {
            reply = failure_of(status_of_exception("the preview"));
        }
        if (!send_all(STDOUT_FILENO, reply)) _exit(1);
    }
}

int run_program_helper(const PassRegistry& registry) {
    (void)setpriority(PRIO_PROCESS, 0, kLowestPriority);
    // Whoever reads the log of the service until its end does not wait for the end of this process,
    // which takes seconds on a busy machine.
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    (void)::dup2(nowhere, STDERR_FILENO);
    Inbox inbox;
    inbox.begin();
    try {
        return preview_generated_frame(Json::parse(inbox.task()), registry).ok() ? 0 : 1;
    } catch (...) {
        return 1;
    }
}

}  // namespace postchain::service

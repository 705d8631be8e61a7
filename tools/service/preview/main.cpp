// postchain-preview: the processes in which the service reads files of clients for an image or a
// preview. What a damaged file does to one costs a request. work/image_process.h and
// work/preview_process.h start them and document what they say.
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string_view>
#include <thread>

#include "chain/base/readable_file.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/apps/common/confine.h"
#include "tools/apps/common/options.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/run/device.h"
#include "tools/service/preview/frame_images.h"
#include "tools/service/work/image_process.h"
#include "tools/service/work/preview_process.h"

namespace postchain::service {
namespace {

using io::Json;

constexpr int kKeptBytes = 1 << 29;

bool send_all(std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const ssize_t got = ::write(STDOUT_FILENO, text.data() + at, text.size() - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += size_t(got);
    }
    return true;
}

std::string message_of(char type, const std::string& bytes) {
    const uint64_t length = bytes.size();
    std::string message(kMessageHead, type);
    std::memcpy(message.data() + 1, &length, sizeof(length));
    return message + bytes;
}

// A line of stdin, and no more than it.
std::string first_line() {
    std::string line;
    for (char c = 0; ::read(STDIN_FILENO, &c, 1) == 1 && c != '\n';) line += c;
    return line;
}

// Reads these folders, and keeps compiled programs where the service says.
Status confine_to_reading(const std::vector<std::string>& folders) {
    Confinement to{folders, {}, devices_of_system()};
    if (const char* programs = std::getenv("MESA_SHADER_CACHE_DIR"))
        to.writes.emplace_back(programs);
    confine_files(folders);
    return confine(to);
}

Json json_of(const Status& status) {
    return {{"code", int(status.code())}, {"message", status.message()}};
}

// Errors of a chain, for Programs' places in a body.
Json json_of(const Diagnostics& faults) {
    Json list = Json::array();
    for (const Diagnostic& one : faults)
        if (one.severity == Severity::error)
            list.push_back({{"file", one.file},
                            {"line", one.line},
                            {"column", one.column},
                            {"path", one.path},
                            {"message", one.message}});
    return {{"faults", list}};
}

// ----------------------------------------------------------------------------------------- words
// The settings of words like those of `plan` and `run`; others are ignored.
struct Words {
    explicit Words(const std::vector<std::string>& words) {
        CLI::App app;
        app.allow_extras();
        add_list(app, "--set", "KEY=VALUE", options.sets, "");
        for (const char* group : {sequence::kInputGroup, sequence::kPlanGroup})
            add_settings(app, job_parameters(), group, &options.job);
        // A file that no job names has no settings.
        for (CLI::Option* option : app.get_options()) option->required(false);
        std::vector<std::string> reversed(words.rbegin(), words.rend());
        app.parse(reversed);
    }
    Result<sequence::RunSettings> settings() const {
        Diagnostics notes;
        return sequence::parse_job(options.job, builtin_passes(), notes);
    }
    Options options;
};

// ----------------------------------------------------------------------------------------- images
Result<std::string> image_of_task(const Json& task) {
    const std::string path = task.at("path");
    // Loaded from wherever the program finds it.
    if (io::image_format_of(path)) (void)io::image_module(StatusCode::input);
    RETURN_IF_ERROR(confine_to_reading(task.at("folders").get<std::vector<std::string>>()));
    const Words words(task.at("words").get<std::vector<std::string>>());
    sequence::SourceSettings source;
    if (!words.options.job.input.empty()) {
        ASSIGN_OR_RETURN(const auto settings, words.settings());
        source = settings.source;
    }
    source.max_memory = task.at("memory");
    return image_of(path, task.at("frame"), source, {task.at("type"), task.at("side")},
                    [](uint64_t bytes) {
                        // The service answers when there is room.
                        std::string need(sizeof(bytes), '\0');
                        std::memcpy(need.data(), &bytes, sizeof(bytes));
                        char answer = 0;
                        if (!send_all("n" + need) || ::read(STDIN_FILENO, &answer, 1) != 1)
                            _exit(1);
                    });
}

int run_image_process() {
    // The buffers of each strip are those of the one before.
    mallopt(M_MMAP_THRESHOLD, kKeptBytes);
    mallopt(M_TRIM_THRESHOLD, kKeptBytes);
    // What follows the line is the answer of the service.
    const std::string text = first_line();
    const auto image = [&]() -> Result<std::string> {
        try {
            return image_of_task(Json::parse(text));
        } catch (...) {
            return status_of_exception("the image");
        }
    }();
    const bool written = image.ok() ? send_all("k") && send_all(*image)
                                    : send_all("e" + io::json_text(json_of(image.status())));
    // Nothing that a damaged file has left behind is run any more.
    _exit(written ? 0 : 1);
}

// --------------------------------------------------------------------------------------- previews
// Reads the service's lines on a thread of its own. The process ends with its input.
class Inbox {
  public:
    void begin() {
        std::thread([this] { read(); }).detach();
    }

    // The next line that is not kStop.
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

  private:
    void read() noexcept {
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
        if (line == kStop) {
            stopped_ = true;
        } else {
            tasks_.push_back(std::move(line));
            stopped_ = false;
        }
        changed_.notify_all();
    }

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::string> tasks_;
    bool stopped_ = false;
};

class PreviewProcessMain {
  public:
    explicit PreviewProcessMain(Inbox& inbox) : inbox_(inbox) {}

    // Before there is another thread, which would not be confined.
    Status begin(const std::string& line) try {
        const Json settings = Json::parse(line);
        memory_ = settings.at("memory");
        RETURN_IF_ERROR(confine_to_reading(settings.at("folders").get<std::vector<std::string>>()));
        ASSIGN_OR_RETURN(auto device, sequence::choose_device(settings.at("device"),
                                                              settings.at("threads").get<int>()));
        maker_ = std::make_unique<PreviewMaker>(device, builtin_passes());
        return Status();
    } catch (...) {
        return status_of_exception("the process for previews");
    }

    // The reply to a task.
    std::string answer(const Json& task) {
        if (task.contains("test")) {
            const Status status = maker_->test();
            return status.ok() ? message_of(kDone, maker_->renderer())
                               : message_of(kFailed, io::json_text(json_of(status)));
        }
        const auto made = preview(task);
        if (made.ok()) return message_of(kDone, *made);
        return message_of(kFailed, io::json_text(has_errors(faults_) ? json_of(faults_)
                                                                     : json_of(made.status())));
    }

  private:
    Result<std::string> preview(const Json& task) {
        faults_.clear();
        // A user's folders are fewer than those that the process may open.
        confine_files(task.at("folders").get<std::vector<std::string>>());
        const std::string folder = task.at("start");
        std::filesystem::current_path(folder);
        const Words words(task.at("words").get<std::vector<std::string>>());
        ChainText text;
        if (task.contains("chain")) {
            ASSIGN_OR_RETURN(text, find_chain(task.at("chain")));
        } else {
            text.file_name = concat(folder, "/", task.at("chain_name").get<std::string>());
            text.text = task.at("chain_text");
        }
        ChainFile chain = parse_chain(text, builtin_passes(), words.options.sets);
        faults_ = chain.diagnostics;
        RETURN_IF_ERROR(chain.status());
        io::ApertureFiles images;
        RETURN_IF_ERROR(images.read(chain.chain.camera).at("camera.aperture_image"));
        ASSIGN_OR_RETURN(auto settings, words.settings());
        if (memory_ > 0 &&
            (settings.source.max_memory == 0 || settings.source.max_memory > memory_))
            settings.source.max_memory = memory_;
        PreviewRequest request{std::move(chain.chain), std::move(settings), task.at("frame"),
                               task.at("scale"),       task.at("depth"),    task.at("type")};
        return maker_->preview(request, [this] { return inbox_.stopped(); });
    }

    Inbox& inbox_;
    uint64_t memory_ = 0;
    Diagnostics faults_;  // of the last task's chain
    std::unique_ptr<PreviewMaker> maker_;
};

int run_preview_process() {
    Inbox inbox;
    PreviewProcessMain process(inbox);
    const Status begun = process.begin(first_line());
    inbox.begin();
    for (;;) {
        const std::string task = inbox.task();
        std::string reply;
        try {
            reply = begun.ok() ? process.answer(Json::parse(task))
                               : message_of(kFailed, io::json_text(json_of(begun)));
        } catch (...) {
            reply = message_of(kFailed, io::json_text(json_of(status_of_exception("the preview"))));
        }
        if (!send_all(reply)) _exit(1);
    }
}

}  // namespace
}  // namespace postchain::service

int main(int argc, char** argv) {
    using namespace postchain::service;
    const std::string_view word = argc == 2 ? argv[1] : "";
    if (word == kImageWord) return run_image_process();
    if (word == kPreviewWord) return run_preview_process();
    std::fputs("postchain-preview: postchain-serve starts this program\n", stderr);
    return 2;
}

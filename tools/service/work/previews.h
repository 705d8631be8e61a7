// Previews: one reduced frame through a chain, one after the other in a process of their own
// (tools/service/preview), so that none waits for the running job. A frame that crashes its
// decoder, or a driver that crashes, costs the preview. The process keeps its GL context from one
// preview to the next, and is started again after it has died.
//
//   service: lines of JSON: {"folders", "memory", "device", "threads"}, then tasks, {"test": true}
//            or {"folders", "start", "words", "chain" or "chain_name" and "chain_text", "frame",
//            "scale", "type"}; and kStop when the last one is no longer wanted
//   process: kDone or kFailed, 8 bytes with the length of what follows, and that: the renderer of a
//            test, the preview, {"code", "message"} or {"faults"} as of `--check`
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/process.h"
#include "tools/service/work/service.h"

namespace postchain::service {

inline constexpr const char* kPreviewWord = "preview";
inline constexpr const char* kStop = "stop";
inline constexpr char kDone = 'd', kFailed = 'f';
inline constexpr size_t kMessageHead = 1 + sizeof(uint64_t);

// One task at a time. Thread-safe.
class PreviewProcess {
  public:
    // `memory`: bytes of a frame. `ends`: set when the service ends; then the process is killed,
    // whatever it does.
    PreviewProcess(const ServiceSettings& settings, uint64_t memory, const std::atomic<bool>& ends);

    // `over`: whether it is no longer wanted. Problems: faults of the body; those of reading,
    // planning and the device; the process died.
    Answer<std::string> preview(const std::string& body, const JobRequest& request,
                                const Roots& roots, const std::string& type,
                                const std::function<bool()>& over);
    // The renderer, after a test of the device. Errors (gl), (internal).
    Result<std::string> test();

  private:
    struct Reply {
        Status status;  // of the exchange
        char type = kFailed;
        std::string bytes;
    };
    Reply exchange(const std::string& task, const std::function<bool()>& over);
    Status start();
    Result<std::string> tested();

    const std::string program_;
    const std::string settings_;  // the first line for the process
    const uint64_t memory_;
    const std::atomic<bool>& ends_;
    std::mutex mutex_;
    HelperProcess process_;
};

class Previews {
  public:
    // `memory`: bytes of a frame.
    Previews(const ServiceSettings& settings, uint64_t memory);
    ~Previews() { end(); }

    // Starts the process and tests its device. If that fails, previews fail. Errors (internal): no
    // thread.
    Status begin();
    // Throws a Problem if too many wait. `request` has been read from `body`. A later preview of
    // the same session ends this one, as do `wanted.left` and end().
    void run(const std::string& body, JobRequest request, const Roots& roots,
             const PictureWanted& wanted, GivePicture done);
    size_t hanging() const { return threads_.hanging(); }
    bool alive() const { return threads_.alive(); }
    // The renderer, after a test dispatch; nothing if the thread is busy for longer than a second.
    std::optional<Result<std::string>> test();
    size_t end();  // HelperThreads::end()

  private:
    struct Ticket {
        std::shared_ptr<std::atomic<bool>> stop;
        std::atomic<bool> replaced = false;
    };

    std::atomic<bool> ends_ = false;
    PreviewProcess process_;
    std::mutex mutex_;
    std::map<std::string, std::weak_ptr<Ticket>> newest_;  // by session
    HelperThreads threads_;
};

}  // namespace postchain::service

// Previews: one reduced frame through a chain, one after the other in a process of their own
// (preview_process.h), so that none waits for the running job.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/service.h"

namespace postchain::service {

class PreviewProcess;

class Previews {
  public:
    // `memory`: bytes of a frame.
    Previews(const ServiceSettings& settings, uint64_t memory);
    ~Previews();

    // Starts the process and tests its device. If that fails, previews fail. Errors (internal): no
    // thread.
    Status begin();
    // Throws a Problem if too many wait. `done` is called once. `request` has been read from
    // `body`. A later preview of the same session ends this one, as do `wanted.left` and end().
    void run(const std::string& body, JobRequest request, const Roots& roots,
             const PreviewWanted& wanted, std::function<void(Answer<Picture>)> done);
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
    std::unique_ptr<PreviewProcess> process_;  // used by the thread alone
    std::mutex mutex_;
    std::map<std::string, std::weak_ptr<Ticket>> newest_;  // by session
    HelperThreads threads_;
};

}  // namespace postchain::service

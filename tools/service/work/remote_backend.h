// The backend of another queue: hands each `run` job over as an array of tasks, and follows it by
// the queue's states and by the outputs on disk. A frame counts as done only when its output is
// whole. Frames that a job's tasks did not make are handed over again, up to the attempts of the
// store. A job that the queue refuses as often fails with the queue's text.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tools/service/store/job_store.h"
#include "tools/service/work/backend.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/job_work.h"
#include "tools/service/work/remote_queue.h"

namespace postchain::service {

class RemoteBackend final : public Backend {
  public:
    RemoteBackend(JobStore& store, const Readers& readers, const RemoteSettings& settings);
    ~RemoteBackend() override;

    Status begin() override;
    void wake() override;
    void stop_job(const std::string&) override { wake(); }
    void drain() override;
    size_t end() override;
    double remaining_s(const std::string&) const override { return 0; }
    BackendState state() const override;

  private:
    using Clock = std::chrono::steady_clock;

    void loop();
    bool ends() const;
    void poll_queue();
    Status take(const Job& job);
    Status hand_over(const Job& job, JobRequest& request);
    Status follow(const Job& job, const std::string& remote);
    Status enter_outputs(const Job& job, const JobRequest& request, bool at_end,
                         const std::string& why);
    Status enter_end(const Job& job, const WorkEnd& end);
    void forget(const std::string& id);

    JobStore& store_;
    const Readers& readers_;
    const RemoteSettings settings_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool awake_ = false, ends_ = false;
    std::optional<Clock::time_point> began_;  // the poll under way
    std::string trouble_;
    // Used by the thread alone: jobs that are followed, and how often the queue refused one.
    std::map<std::string, JobRequest> requests_;
    std::map<std::string, int> refusals_;
    std::thread thread_;
    // 1: the thread hangs in the queue or a disk.
    std::shared_ptr<std::atomic<size_t>> lost_ = std::make_shared<std::atomic<size_t>>(0);
};

}  // namespace postchain::service

// The backend of another queue: hands each `run` job over as an array of tasks, and follows it by
// the queue's states and by the outputs on disk. A frame counts as done only when its output is
// whole. Frames that a job's tasks did not make are handed over again, up to the attempts of the
// store. A job that the queue refuses as often fails with the queue's text.
//
//   store: queued --next(), as long as the queue has room--> running, name stored, submit(), id
//   stored
//
// Room is limited for all jobs and for each user, so that priorities, the turns of users and the
// limit of waiting jobs work as on one machine. In the queue, a job has its priority, and a share
// of the tasks that may run.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
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
#include "tools/service/work/measurement.h"
#include "tools/service/work/remote_queue.h"

namespace postchain::service {

// Writes a file that tasks read. Errors (output).
Status write_task_file(const std::string& path, const std::string& text);

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

    // A job in the queue. The store keeps "NAME", after submit() "NAME ID", and after submit() of
    // a study's report "NAME ID REPORT".
    struct Handed {
        Job job;
        RemoteName remote, report;
    };
    struct Found {
        RemoteTasks tasks, report;
    };
    static Handed handed_of(const Job& job, const std::string& remote);

    void loop();
    bool ends() const;
    void poll_queue();
    void hear_from_queue();
    // Jobs that have room in the queue, in their order.
    Status take_waiting();
    Status guarded(const Job& job, const std::function<Status()>& work);
    Status take(const Job& job);
    Status hand_over(const Job& job, const ReadJob& read, std::string name);
    Status follow(const Handed& handed, const Found& found, const RemoteRank& rank);
    Status follow_frames(const Job& job, const JobRequest& request, const RemoteTasks& tasks);
    // For ab, bench and study; `id`: of the array.
    Status follow_measurement(const Handed& handed, const ReadJob& read, const std::string& id,
                              const Found& found);
    void say_progress(const Job& job, const JobRequest& request);
    Result<TaskCommand> frame_tasks(const Job& job, const JobRequest& request) const;
    Result<RemoteJob> remote_job(const Job& job, const ReadJob& read,
                                 const std::string& name) const;
    Result<std::string> submit(const Job& job, const RemoteJob& remote);
    Status again_or_failed(const Job& job, const Status& why);
    Result<const ReadJob*> request_of(const Job& job);
    bool lag_is_over(const Job& job);
    Status enter_outputs(const Job& job, const JobRequest& request, bool at_end,
                         const std::string& why);
    Status enter_end(const Job& job, const WorkEnd& end);
    std::string failure_of(const std::string& id, const RemoteTasks& tasks) const;
    // Removes folders of jobs that need none.
    void clean_up() const;
    void forget(const std::string& id);
    std::string folder_of(const std::string& id) const { return settings_.folder + "/" + id; }

    JobStore& store_;
    const Readers& readers_;
    const RemoteSettings settings_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool awake_ = false, ends_ = false;
    std::optional<Clock::time_point> began_;  // the poll under way
    std::string trouble_;
    int failed_polls_ = 0;                    // in a row, by exceptions
    Clock::time_point heard_ = Clock::now();  // from the queue, and all work on its answer done
    // Used by the thread alone, by the job's id.
    std::map<std::string, ReadJob> requests_;
    std::map<std::string, int> failures_;      // refusals by the queue, reports that were not made
    std::map<std::string, RemoteRank> ranks_;  // as the queue has them
    std::map<std::string, Clock::time_point> ended_;  // when the last task was seen to have ended
    std::map<std::string, TaskProgress> said_;        // the last event of its progress
    bool idle_ = false;
    std::thread thread_;
    // 1: the thread hangs in the queue or a disk.
    std::shared_ptr<std::atomic<size_t>> lost_ = std::make_shared<std::atomic<size_t>>(0);
};

// Creates the folder for chains and messages if it does not exist. Errors (usage): it is a link, of
// another user, open to others, in one of these folders, or has one of them in it; (output).
Status take_farm_folder(const std::string& folder, const std::vector<std::string>& roots);

}  // namespace postchain::service

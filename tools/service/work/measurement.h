// Jobs that measure: ab, bench and study. The lab has them (tools/service/lab); a service that is
// built without it refuses these kinds.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/sequence/settings/job_settings.h"
#include "tools/service/store/job.h"
#include "tools/service/work/body_keys.h"
#include "tools/service/work/job_work.h"
#include "tools/service/work/remote_queue.h"
#include "tools/service/work/request_chain.h"

namespace postchain::service {

// An array of Slurm has at most 1000 tasks unless MaxArraySize is raised.
inline constexpr size_t kMostTasks = 1000;

// The command of a job's tasks in another queue.
struct TaskCommand {
    std::vector<std::string> command;
    std::vector<std::vector<std::string>> words;  // appended, of each task
};

// How far a job's tasks are.
struct TaskProgress {
    std::string what;
    size_t done = 0, total = 0;
    bool operator==(const TaskProgress&) const = default;
};

// An ab, bench or study as its body asks for it.
class Measurement {
  public:
    virtual ~Measurement() = default;

    virtual const std::string& report_folder() const = 0;
    // Counted once for each measurement of a scene.
    virtual int frames() const = 0;
    // Lowers --max-memory, bytes.
    virtual void limit_memory(uint64_t most) = 0;
    // Whether its folder must be new. Errors: (usage) an input is in it; (output) it has a report
    // or other files.
    virtual Result<bool> needs_new_folder() const = 0;

    // `job` is running. GL is current on this thread.
    virtual WorkEnd work(const Job& job, const WorkContext& context) = 0;

    // In another queue. Why it cannot run there; empty: it can.
    virtual std::string fault_of_queue() const { return ""; }
    // Before the first task: checks paths and the folder of the report, as on one machine. Errors:
    // as there.
    virtual Status begin(const Roots& roots) = 0;
    // Writes the chains to `folder`. Tasks start in the first root. Errors (output).
    virtual Result<TaskCommand> tasks(const Job& job, const RemoteSettings& settings,
                                      const Roots& roots, const std::string& folder) = 0;
    // No value if it is not known yet. `folder`: of the tasks' messages.
    virtual std::optional<TaskProgress> progress(const std::string& folder) const = 0;
    // The end of a job whose last task has ended with this code. No value if its report is not
    // there.
    virtual std::optional<WorkEnd> end(const Job& job, int exit_code, const Roots& roots) const = 0;
};

bool can_measure();

// The keys that these kinds add to those of every job, and of a run's chain, inputs and plan (but
// for a study, which has its own).
void add_measurement_keys(JobKind kind, BodyKeys& keys);

// The body and its readers. The chain and the settings of an ab or bench are read already.
struct MeasurementText {
    RequestBody& body;
    const Roots& roots;
    const PassRegistry& registry;
    const std::string& version;
    int threads;
    ChainReader& chains;
    const ChainText& chain;
    const sequence::JobSettings& job;
};
// Faults go to the body. Completes `request`, whose kind is one of these.
std::shared_ptr<Measurement> read_measurement(const MeasurementText& text, JobRequest& request);

// Lowers a limit in bytes; 0 = none.
inline void limit_memory(uint64_t& memory, uint64_t most) {
    if (most > 0 && (memory == 0 || memory > most)) memory = most;
}

}  // namespace postchain::service

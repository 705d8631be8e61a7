// The service without HTTP: jobs over sequences, one after the other on one GL context, kept in a
// store that outlives the process.
//
//   submit(JSON) --> JobStore (SQLite) --> the worker thread (GL) --> run/run_sequence,
//                       |                                             experiment/ab, bench
//                       +--> jobs(), job(), events(): what http/ shows
//
// Jobs are made from the tables of run/job_settings.h and experiment/settings.h, so that the
// command and the service take the same words. Safe in several threads, but for open() and the
// destructor.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "chain/pass.h"
#include "chain/status.h"
#include "tools/service/store/job.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

struct ServiceSettings {
    std::string store;            // the SQLite file; made when it is not there
    Roots roots;                  // folders in which every path of a job must lie
    std::string device = "auto";  // as --device of the command
    int threads = 0;              // CPU threads; 0 = one per core
    size_t max_queue = 1000;      // jobs that wait; more are refused
    int attempts = 3;             // of a frame, before it is set aside
    std::string version;          // of the command, for metadata
};

struct Picture {
    std::string type;  // "image/png", "image/x-exr"
    std::string bytes;
};

// What monitoring asks. Counters count since the process began.
struct Health {
    bool gl = false;     // a test dispatch gave the right result
    bool disk = false;   // the store's folder and every output root can be written
    bool queue = false;  // the queue takes jobs
    bool draining = false;
    std::string renderer;
    std::string why;  // of what is false
};

class Service {
  public:
    // Takes the store for this process, and begins where the last one ended. Errors (output): the
    // store cannot be written, or another service has it; (gl).
    static Result<std::unique_ptr<Service>> open(const ServiceSettings& settings,
                                                 const PassRegistry& registry);
    ~Service();  // stop(), then closes the store

    // Ends the frame under way, and leaves every unfinished job in the queue for the next process.
    void drain();

    // `body`: a JSON object, docs/service.md. With a key that an earlier job has: that job, where
    // the body is the same too. `created` gets whether there is a new one.
    Answer<Job> submit(const std::string& body, const std::string& idempotency_key, bool* created);
    // Newest first. `before`: an id, to read on; empty = from the newest.
    Answer<std::vector<Job>> jobs(const std::string& state, const std::string& before,
                                  size_t limit) const;
    Answer<Job> job(const std::string& id) const;
    // In the order of the job, without their sidecars: those of a long job are large.
    Answer<std::vector<JobFrame>> frames(const std::string& id) const;
    Answer<JobFrame> frame(const std::string& id, int number) const;  // with its sidecar
    Answer<Job> cancel(const std::string& id);
    Answer<Job> retry(const std::string& id);  // of a failed or canceled job: what is not done yet

    // Events of one job (all jobs: empty id) after `after`, oldest first, at most `limit`.
    Answer<std::vector<Event>> events(const std::string& id, int64_t after, size_t limit) const;
    // Calls from any thread, soon after an event is in the store; quick, and throws nothing.
    void on_event(std::function<void(const Event&)> listener);

    // One frame of an input through a chain, at `scale` of its size, as docs/service.md says:
    // filtered between two frames of the job under way. `type`: of the picture, "image/png"
    // (display transform) or "image/x-exr" (scene-linear, float). `done` is called once, on any
    // thread.
    void preview(const std::string& body, std::function<void(Answer<Picture>)> done,
                 const std::string& type = "image/png");
    // A thumbnail of a frame of a job, before or after, at most 320 pixels wide and high.
    void thumbnail(const std::string& id, int frame, bool after,
                   std::function<void(Answer<Picture>)> done);
    // A file of a job's report: "index.html", "report.json".
    Answer<Picture> report_file(const std::string& id, const std::string& name) const;

    Answer<std::string> plan(const std::string& body);  // JSON, as `postchain plan --json`
    // Diagnostics of a chain text, for the editor; empty = it is valid.
    Diagnostics check_chain(const std::string& text) const;
    std::string passes() const;        // JSON, as `postchain passes --json`
    std::string chain_schema() const;  // as `postchain schema`
    std::string job_schema() const;    // JSON Schema of a body of submit()
    Health health();
    std::string metrics() const;  // Prometheus text format

  private:
    struct State;
    explicit Service(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace postchain::service

// The service without HTTP: jobs over sequences, one at a time on one GL context, kept in a store
// that outlives the process.
//
//   submit(JSON) --> JobStore (SQLite) --> the worker thread (GL) --> run/run_sequence,
//                       |                                             experiment/ab, bench
//                       +--> jobs(), job(), events(): served by http/
//
// Job settings come from the tables of run/job_settings.h and experiment/settings.h, as in the
// command. Thread-safe, except open() and the destructor.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "chain/pass.h"
#include "chain/status.h"
#include "tools/sequence/files/json.h"
#include "tools/service/store/job.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

struct ServiceSettings {
    std::string store;                                  // SQLite file, created if it does not exist
    Roots roots;                                        // the folders of all paths of jobs
    std::string device = "auto";                        // as --device of the command
    int threads = 0;                                    // CPU threads; 0 = one per core
    size_t max_queue = 1000;                            // waiting jobs; further ones are refused
    int attempts = 3;                                   // per frame, before it is quarantined
    std::string version;                                // the command's version, for metadata
    std::function<void(const std::string&)> log = {};   // errors that no request asked for
    std::function<void(const std::string&)> warn = {};  // `auto` found no GPU
};

struct Picture {
    std::string type;  // "image/png", "image/x-exr"
    std::string bytes;
};

// State for monitoring.
struct Health {
    bool gl = false;     // a test dispatch returned the right result
    bool disk = false;   // the store is in its place, its folder and every root are writable
    bool queue = false;  // the queue accepts jobs
    bool draining = false;
    std::string renderer;
    std::string why;  // reasons of the false values
};

class Service {
  public:
    // Locks the store and resumes its jobs. Errors (output): the store cannot be written, or
    // another service uses it; (gl).
    static Result<std::unique_ptr<Service>> open(const ServiceSettings& settings,
                                                 const PassRegistry& registry);
    ~Service();  // stop(), then closes the store

    // Gives up the current frame and leaves every unfinished job in the queue.
    void drain();

    // `body`: a JSON object, see docs/service.md. If an earlier job has the key and the same body,
    // returns that job. `created` tells whether the job is new.
    Answer<Job> submit(const std::string& body, const std::string& idempotency_key, bool* created);
    // Newest first. `before`: an id, to continue a list; empty = from the newest.
    Answer<std::vector<Job>> jobs(const std::string& state, const std::string& before,
                                  size_t limit) const;
    Answer<Job> job(const std::string& id) const;
    // In the order of the job, without their sidecars, which would be large together.
    Answer<std::vector<JobFrame>> frames(const std::string& id) const;
    Answer<JobFrame> frame(const std::string& id, int number) const;  // with its sidecar
    Answer<Job> cancel(const std::string& id);
    Answer<Job> retry(
        const std::string& id);  // runs the unfinished frames of a failed or canceled job

    // At most `limit` events after `after`, oldest first, of one job, or of all if `id` is empty.
    Answer<std::vector<Event>> events(const std::string& id, int64_t after, size_t limit) const;
    // Called on any thread soon after an event is stored. Must be quick and must not throw.
    void on_event(std::function<void(const Event&)> listener);

    // Filters one frame of an input, at `scale` of its size, between two frames of the running job
    // (docs/service.md). `type`: "image/png" (display transform) or "image/x-exr" (scene-linear,
    // float). `done` is called once, on any thread.
    void preview(const std::string& body, std::function<void(Answer<Picture>)> done,
                 const std::string& type = "image/png");
    // A thumbnail of a job's frame before or after filtering, at most 320 pixels wide and high.
    void thumbnail(const std::string& id, int frame, bool after,
                   std::function<void(Answer<Picture>)> done);
    // A file of a job's report, such as "index.html" or "report.json".
    Answer<Picture> report_file(const std::string& id, const std::string& name) const;

    Answer<std::string> plan(const std::string& body);  // JSON, as `postchain plan --json`
    // Diagnostics of a chain file's text, for the editor; none = it is valid. `body`: {"text":
    // ...}.
    Answer<Diagnostics> check_chain(const std::string& body) const;
    std::string passes() const;        // JSON, as `postchain passes --json`
    std::string chain_schema() const;  // as `postchain schema`
    io::Json job_schema() const;       // JSON Schema of a body of submit()
    Health health();
    std::string metrics() const;  // Prometheus text format

  private:
    struct State;
    explicit Service(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace postchain::service

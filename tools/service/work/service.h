// The service without HTTP: jobs over sequences, kept in a store that outlives the process, and run
// by other processes. It reads no frame and has no device.
//
//   submit(JSON) --> JobStore (SQLite) --> JobRunner --> TaskQueue: `postchain run` and others,
//                       |                     ^            on this machine or in Slurm
//                       |                     +-- lines of JSON: frames that begin, end and fail
//                       +--> jobs(), job(), events(): served by http/
//
// Keys of a job are those that `postchain run --schema` and others list.
// Thread-safe, except open(), end() and the destructor.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/pass/pass.h"
#include "tools/sequence/files/json.h"
#include "tools/service/store/job.h"
#include "tools/service/store/users.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/roots.h"
#include "tools/service/work/task_queue.h"

namespace postchain::service {

// A line for the log: what happened to a job, or to the service.
struct LogLine {
    enum class Level { info, warning, error };
    Level level = Level::info;
    std::string message;
    io::Json fields = io::Json::object();  // event, job, user, kind, frame, seconds
};

struct ServiceSettings {
    std::string store;  // SQLite file, created if it does not exist
    Roots roots;        // the folders of all paths of jobs
    std::shared_ptr<const Users> users = std::make_shared<Users>();
    std::string device = "auto";  // as --device of the command
    int threads = 0;              // CPU threads of a process; 0 = one per core
    size_t max_queue = 1000;      // waiting jobs; further ones are refused
    std::string program;  // the command, which runs jobs of this machine and answers requests
    std::string preview_program;  // postchain-preview
    // Bytes for the frames of a job (a half), of previews and of images (a quarter each); 0 = the
    // default of --max-memory.
    uint64_t max_memory = 0;
    int attempts = 3;                         // per frame, before it is quarantined
    double frame_timeout_s = 1800;            // of a job's process that prints nothing; 0 = none
    double slice_s = 60;                      // until a job makes way for another user's
    std::chrono::milliseconds drain{20'000};  // for the work under way at the end
    Retention keep;
    std::shared_ptr<TaskQueue> queue;  // runs the jobs; null = processes of this machine
    QueueSettings remote;              // how jobs are handed to `queue`
    std::string version;               // the programs' version
    // Why processes of this machine are confined less than they could be; empty = they are.
    std::string less_confined;
    std::function<void(const LogLine&)> log = {};
};

struct Picture {
    std::string type;  // "image/png", "image/x-exr"
    std::string bytes;
};

inline constexpr const char* kExrType = "image/x-exr";

// Called once, on any thread.
using GivePicture = std::function<void(Answer<Picture>)>;

// A file's image or a preview in a reply.
struct PictureWanted {
    std::string type = "image/png";  // or page::kPictureType; of a preview also kExrType
    int side = 320;                  // largest width and height; of a file's image
    std::string session = {};        // a later preview of the session replaces this one; empty = no
    std::string share = {};          // whose turn it takes: HelperThreads
    std::shared_ptr<std::atomic<bool>> left = {};  // set: the client has left
};

// A file that is sent as it is.
struct ResultFile {
    std::string path;  // on disk
    std::string name;  // without folders
    std::string type;
    uint64_t bytes = 0;
};

struct JobQuery {
    std::string state, owner;  // empty = any
    std::string search = {};   // words that all occur in a job's names, paths, state or message
    std::string before;        // an id, to continue a list; empty = from the newest
    size_t limit = 50;
};

// State for monitoring.
struct Health {
    bool gl = false;        // a test dispatch returned the right result
    bool disk = false;      // the store is in its place, its folder and every root are writable
    bool queue = false;     // the queue accepts jobs
    bool progress = false;  // no step of the running job is over its limit, and threads are left
    bool draining = false;
    bool confined = false;  // processes that read files of clients, by all that a kernel can have
    std::string renderer;
    std::string why;  // reasons of the false values
};

class Service {
  public:
    // Locks the store and resumes its jobs. Errors (output): the store cannot be written, or
    // another service uses it; (usage): the command is missing, or of another version.
    static Result<std::unique_ptr<Service>> open(const ServiceSettings& settings,
                                                 const PassRegistry& registry);
    ~Service();  // end(), then closes the store, unless threads hang

    // Ends processes of jobs within a frame, and leaves every unfinished job in the queue.
    void drain();
    // drain(), then ends the threads. Returns the number of those that hang in a disk or a device:
    // a program should then end without waiting for them.
    size_t end();
    // False if only a restart helps: too many threads of a kind hang.
    bool alive() const;

    // `body`: a JSON object, see docs/service.md. If an earlier job of the user has the key and the
    // same body, returns that job. `created` tells whether the job is new.
    Answer<Job> submit(const User& user, const std::string& body,
                       const std::string& idempotency_key, bool* created);
    // Without their bodies, newest first.
    Answer<std::vector<Job>> jobs(const JobQuery& query) const;
    Answer<Job> job(const std::string& id) const;
    // In the order of the job, without their sidecars: at most `limit`, from the place `from` (0 =
    // the first).
    Answer<std::vector<JobFrame>> frames(const std::string& id, size_t from, size_t limit) const;
    Answer<JobFrame> frame(const std::string& id, int number) const;  // with its sidecar
    // The following change a job of the user, or any job if the user is an administrator.
    Answer<Job> cancel(const User& user, const std::string& id);
    // Runs the unfinished frames of a failed or canceled job.
    Answer<Job> retry(const User& user, const std::string& id);
    // `body`: {"priority": 5}, of an unfinished job.
    Answer<Job> change(const User& user, const std::string& id, const std::string& body);
    // Removes an ended job from the store; its outputs stay. Returns the job as it was.
    Answer<Job> forget(const User& user, const std::string& id);

    // At most `limit` events after `after`, oldest first, of one job, or of all if `id` is empty.
    Answer<std::vector<Event>> events(const std::string& id, int64_t after, size_t limit) const;
    int64_t newest_event() const;  // the last id; 0 = none yet
    // Called on any thread soon after an event is stored. Must be quick and must not throw.
    void on_event(std::function<void(const Event&)> listener);

    // Filters one frame of an input, at a scale of its size (docs/service.md).
    void preview(const User& user, const std::string& body, const PictureWanted& wanted,
                 GivePicture done);
    // An image of a job's frame before or after filtering.
    void frame_image(const User& user, const std::string& id, int frame, bool after,
                     const PictureWanted& wanted, GivePicture done);
    // An image that represents the job in a list.
    void job_image(const User& user, const std::string& id, const PictureWanted& wanted,
                   GivePicture done);
    // An image of a frame of an input.
    void input_image(const User& user, const std::string& input, int frame,
                     const PictureWanted& wanted, GivePicture done);
    // The contents of a folder of the roots, and chains with their texts: JSON, as
    // tools/service/work/browse.h.
    Answer<std::string> browse(const User& user, const std::string& folder) const;
    Answer<std::string> chains(const User& user, const std::string& file) const;
    // A file of a job's report, such as "index.html" or "report.json".
    Answer<ResultFile> report_file(const User& user, const std::string& id,
                                   const std::string& name) const;
    // The output of a job's finished frame.
    Answer<ResultFile> output(const User& user, const std::string& id, int frame) const;

    // JSON, as `postchain plan --json`.
    Answer<std::string> plan(const User& user, const std::string& body);
    // A chain file's text, for the editor. `body`: {"text": ...}.
    Answer<Diagnostics> check_chain(const std::string& body) const;
    std::string passes() const;        // JSON, as `postchain passes --json`
    std::string chain_schema() const;  // as `postchain schema`
    io::Json job_schema() const;       // JSON Schema of a body of submit()
    Health health() const;             // waits for nothing; at most some seconds old
    std::string metrics() const;       // Prometheus text format

  private:
    struct State;
    explicit Service(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace postchain::service

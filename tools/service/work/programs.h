// What the service asks of the command before a job runs: its keys, whether it would start, its
// frames on disk, its plan. Each answer is the JSON of a process that is confined to the folders of
// the user, so that no file of a user is read in the service.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/files/json.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/problem.h"

namespace postchain::service {

// A folder that is closed to others and gone with the object.
class PrivateFolder {
  public:
    // `begin`: of its path.
    explicit PrivateFolder(const std::string& begin);
    ~PrivateFolder();
    PrivateFolder(const PrivateFolder&) = delete;
    PrivateFolder& operator=(const PrivateFolder&) = delete;
    const std::string& path() const { return path_; }  // empty: it cannot be made

  private:
    std::string path_;
};
// How the path of the service's folder begins, for the texts and messages of jobs: outside of the
// roots, so that no user may name it. Folders of services that were killed are removed.
std::string place_of_own_folder();

// What `--check` finds.
struct CheckedJob {
    int frames = 0;                 // ab, bench, study: once for each measurement of a scene
    std::vector<JobFrame> of_run;   // waiting, missing or, if the output exists, quarantined
    std::string writes;             // every pattern and folder that it writes, a line for each
    bool needs_new_folder = false;  // of the report
    std::vector<std::string> warnings;
};

class Programs {
  public:
    // `program`: the command. `folder`: for texts of requests. `memory`: bytes that a process may
    // write; 0 = no limit.
    Programs(std::string program, std::string folder, uint64_t memory)
        : program_(std::move(program)), folder_(std::move(folder)), memory_(memory) {}

    // Errors: the command cannot be started, or is of another version.
    Result<Schemas> schemas(const std::string& version) const;
    // Problems: every fault that the start of the job would meet, at its place in the body.
    Answer<CheckedJob> check(const std::string& body, const JobRequest& request,
                             const Roots& roots) const;
    // JSON, as of `postchain plan --json`.
    Answer<std::string> plan(const std::string& body, const JobRequest& request,
                             const Roots& roots) const;

  private:
    struct Said {
        int exit_code = 0;
        std::string out, last_error;
    };
    Answer<Said> ask(const std::string& body, const JobRequest& request, const Roots& roots,
                     const std::vector<std::string>& words) const;

    const std::string program_, folder_;
    const uint64_t memory_;
};

// The faults of `--check` at their places in the body.
Problem problem_of_faults(const io::Json& faults, const std::string& body,
                          const JobRequest& request, const Roots& roots);

// The options that confine a process to the folders of the user; it also reads `own`.
std::vector<std::string> confining_words(const Roots& roots, const std::string& own);

// A member of what a program or a user wrote, or this value if it is missing or of another type.
template <class T>
T value_of(const io::Json& json, const char* key, T otherwise) {
    const auto found = json.find(key);
    if (found == json.end()) return otherwise;
    try {
        return found->get<T>();
    } catch (const io::Json::exception&) {
        return otherwise;
    }
}

// The last line of messages that is not empty, without control characters and "error: ".
std::string last_line(const std::string& messages);

// A random name: nobody else can know it.
std::string random_name(const std::string& prefix);

}  // namespace postchain::service

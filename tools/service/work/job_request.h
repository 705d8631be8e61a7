// Requests: a JSON body becomes the words of a program, with every path checked against the roots.
//
//   JSON --keys that `--schema` of the program lists--> JobRequest --command_of()--> words
//
// The same function reads a job when it is submitted and when it runs, and resolves its paths each
// time. The program itself checks the values, with `--check` (programs.h).
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/pass/pass.h"
#include "tools/sequence/files/json.h"
#include "tools/service/store/job.h"
#include "tools/service/store/users.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/request_body.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

enum class RequestKind { run, ab, bench, study, plan, preview };  // the jobs first, as in JobKind
inline constexpr std::array kRequestKinds = {RequestKind::run,   RequestKind::ab,
                                             RequestKind::bench, RequestKind::study,
                                             RequestKind::plan,  RequestKind::preview};
const char* name_of(RequestKind kind);

inline constexpr int kMaxFrameTimeoutS = 86'400;
inline constexpr double kMinPreviewScale = 0.05;  // in the body of a preview; the largest is 1

// The settings of each kind as the programs publish them: JSON Schemas. A kind whose program is not
// installed has none.
using Schemas = std::map<RequestKind, io::Json>;

// A chain or a study: a name, a file, or a text that is written for the program.
struct NamedText {
    std::string key;   // of the body
    std::string word;  // a shipped name or a path; of a text the name of its file
    std::string text = {};
    bool written = false;  // it is a text
    bool in_body = false;  // an object of the body, at the same lines and columns
};

struct JobRequest {
    RequestKind kind = RequestKind::run;
    int priority = 0;
    int frame_timeout_s = 0;          // 0 = that of the service
    std::vector<NamedText> subjects;  // the program's arguments: chains, or a study
    std::vector<std::pair<std::string, std::string>> options;  // key and word, "--half"
    std::string input;   // resolved, as --input; of a study empty
    std::string output;  // resolved: a pattern or a folder
    int frame = 0;       // preview
    double scale = 1;    // preview

    // The value of an option, or this one.
    std::string value(std::string_view key, std::string_view otherwise) const;
};

// The words after the program's name, without the options of these keys. Texts are in `folder`.
std::vector<std::string> words_of(const JobRequest& request, const std::string& folder,
                                  const std::vector<std::string_view>& without = {});
// Writes the texts. Errors (output).
Status write_texts(const JobRequest& request, const std::string& folder);

class JobReader {
  public:
    // `schemas` outlives the reader.
    JobReader(const Roots& roots, const Schemas& schemas) : roots_(roots), schemas_(&schemas) {}
    // The same reader with other folders.
    JobReader with(Roots roots) const { return {std::move(roots), *schemas_}; }

    // Problems: (invalid), (forbidden), with every fault in `diagnostics`. A job has its kind in
    // its body.
    Answer<JobRequest> job(const std::string& body) const;
    Answer<JobRequest> plan(const std::string& body) const;
    Answer<JobRequest> preview(const std::string& body) const;

    const Roots& roots() const { return roots_; }
    const Schemas& schemas() const { return *schemas_; }

  private:
    Roots roots_;
    const Schemas* schemas_;
};

struct ReadJob {
    JobReader reader;
    JobRequest request;
};

// The reader of requests for each user: with the user's own folders.
class Readers {
  public:
    // The arguments outlive this object.
    Readers(const JobReader& all, const Users& users) : all_(all), users_(users) {}

    // Errors (usage): a folder of the user no longer exists.
    Result<JobReader> of(const User& user) const;
    // Errors (usage): as above, or the user is no longer known.
    Result<JobReader> of(const std::string& owner) const;
    // Reads a job again. Errors: as above, or those of its body.
    Result<ReadJob> read(const Job& job) const;
    KnownUser owner_of(const Job& job) const { return users_.named(job.owner); }
    std::string shown_in(const std::string& text) const { return all_.roots().shown_in(text); }

  private:
    const JobReader& all_;
    const Users& users_;
};

// The priority in a body {"priority": 5}.
Answer<int> read_priority(const std::string& body, const Roots& roots);
// The faults of a chain file's text; none = it is valid. `body`: {"text": ...}.
Answer<Diagnostics> check_chain_text(const std::string& body, const Roots& roots,
                                     const PassRegistry& registry);

// JSON Schema (draft 2020-12) of a job.
io::Json job_schema(const Schemas& schemas);

}  // namespace postchain::service

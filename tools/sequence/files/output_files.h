// What a job reads and what it writes, both known before its first write, and the one rule of what
// may be replaced. Every verb that writes files asks here; docs/command.md, "What is written, and
// what is never replaced", is the same rule for users.
//
//   inputs, outputs, --on-existing --check()--> Status, before the first write
//                                  --permit(path)--> OnExisting, for the writer of that file
//
// 1. What the job reads is never replaced, whatever --on-existing says, and a pattern that is read
//    gets no further file.
// 2. No file is written twice.
// 3. A file that is there is replaced only as --on-existing allows.
// 4. A folder whose file names follow from the work alone is the job's own where it is empty or
//    bears its mark; else nothing is written in it. What the job reads does not lie in it.
//
// Two paths are one file when the system says so (hard links, symbolic links), or when they have
// one name in one folder, however it is written (./a.exr, b/../a.exr, a folder that is a link).
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::io {

// A file that a job reads besides its frames.
struct InputFile {
    std::string path;
    std::string what;  // "the camera file"
};

// `what` and `remedy` go into messages: "the sidecar of frame 3", "name another with --output".
struct OutputFile {
    std::string path;
    std::string what;
    std::string remedy;
};

// Files of one folder of which only the form of the names is known before the work is.
struct OutputFamily {
    std::string folder;
    std::function<bool(const std::string& name)> has;  // may a file of this name be written
    std::string what;
    std::string remedy;
};

// A folder of the job's own. Its mark is a file in it that names its owner.
struct OutputFolder {
    std::string path;
    std::string what;   // "a report"
    std::string mark;   // name of the file
    std::string owner;  // its content; a folder of another owner is never written to
    std::string remedy;
};

class OutputFiles {
  public:
    // `choices`: what messages may recommend of the verb's --on-existing: "skip or overwrite".
    explicit OutputFiles(OnExisting on_existing = OnExisting::fail,
                         std::string choices = "overwrite");

    void read(const InputFile& file);
    // Its files on disk, and every name that it would find.
    void read(const PathPattern& pattern, const std::string& what);
    void write(OutputFile file);
    void write(OutputFamily family);
    void write(OutputFolder folder);

    // Before the first write. Errors (usage): rules 1 and 2, and inputs in a folder of rule 4.
    Status check_names() const;
    // Errors (output): rules 3 and 4, and folders in the place of files.
    Status check_existing() const;
    Status check_existing(const std::vector<std::string>& paths) const;  // these outputs alone
    Status check() const;                                                // all of it

    // After check(): removes what killed processes have left of these files, .NAME.PID.tmp.
    void remove_left_temporaries() const;

    // Makes the folders of rule 4 with their marks. Errors (output).
    Status make_folders() const;

    // What the writer of this file is to do when it is there: fail or overwrite; fail where the
    // file is none of the outputs. Errors: rule 1 again, for what has changed since. Safe in
    // several threads.
    Result<OnExisting> permit(const std::string& path) const;

  private:
    struct Pattern {
        std::string folder;  // resolved
        PathPattern names;
        std::string what;
    };
    using Identity = std::pair<dev_t, ino_t>;

    std::string resolved(const std::string& path);
    std::string threat(const std::string& path, const std::string& resolved) const;
    std::string input_in(const std::string& folder) const;
    Status existing(const std::vector<const OutputFile*>& files) const;
    Status family_names(const OutputFamily& family) const;
    Status folder_state(const OutputFolder& folder) const;
    std::string choice() const;

    OnExisting on_existing_;
    std::string choices_;
    std::map<Identity, std::string> inputs_;       // what each is
    std::map<std::string, std::string> input_at_;  // by resolved path
    std::vector<Pattern> patterns_;
    std::vector<OutputFile> files_;
    std::map<std::string, size_t> file_at_;         // by resolved path
    std::vector<std::pair<size_t, size_t>> twice_;  // two of the files that are one
    std::vector<OutputFamily> families_;
    std::vector<OutputFolder> folders_;
    std::map<std::string, std::string> resolved_folders_;
};

}  // namespace postchain::io

// The files that a job reads and writes, known before its first write, and the rules for replacing
// files. Subcommands that write files use them; docs/command.md, "What is written, and what is
// never replaced", has the rules for users.
//
//   inputs, outputs, --on-existing --check()--> Status, before the first write
//                                  --permit(path)--> OnExisting, for the writer of that file
//
// 1. A job never replaces a file that it reads, for any --on-existing, and never adds a file that
//    matches a pattern it reads.
// 2. No file is written twice.
// 3. An existing file is replaced only if --on-existing allows it.
// 4. A folder whose file names are not known in advance is the job's own if it is empty or has the
//    job's mark; otherwise nothing is written in it. The job's inputs must not be in it.
//
// Two paths are the same file if the system says so (hard links, symbolic links), or if they
// resolve to one name in one folder (./a.exr, b/../a.exr, a folder that is a link or is mounted a
// second time).
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::io {

// True if `path` is `folder` or lies in it. Both are absolute, without links and dots.
bool is_inside(const std::string& path, const std::string& folder);

// Creates the folder and those above it, if they are not there. Errors (output): the system's.
Status make_folder(const std::string& folder);

// A file that a job reads in addition to its frames.
struct InputFile {
    std::string path;
    std::string what;  // "the camera file"
};

// `what` and `remedy` are used in messages: "the sidecar of frame 3", "name another with --output".
struct OutputFile {
    std::string path;
    std::string what;
    std::string remedy;
};

// Files of one folder whose exact names are not known in advance, only their form.
struct OutputFamily {
    std::string folder;
    std::function<bool(const std::string& name)> has;  // whether a file of this name may be written
    std::string what;
    std::string remedy;
};

// A folder that belongs to the job. Its mark is a file in it that names the owner.
struct OutputFolder {
    std::string path;
    std::string what;   // "a report"
    std::string mark;   // file name
    std::string owner;  // content of the mark; folders of other owners are not written to
    std::string remedy;
};

using FileIdentity = std::pair<dev_t, ino_t>;

// One name for each folder, whichever links and mounts a path to it leads through.
class FolderNames {
  public:
    // Absolute. Missing folders keep the given name, in the folder that exists.
    std::string name(const std::string& folder) const;
    // Remembers the folder and those above it by this name.
    std::string add(const std::string& folder);

  private:
    std::map<FileIdentity, std::string> known_;
};

class OutputFiles {
  public:
    // `choices`: values of its --on-existing that messages recommend: "skip or overwrite".
    explicit OutputFiles(OnExisting on_existing = OnExisting::fail,
                         std::string choices = "overwrite");

    void read(const InputFile& file);
    // Adds the pattern's files on disk, and every name that it matches.
    void read(const PathPattern& pattern, const std::string& what);
    void write(OutputFile file);
    void write(OutputFamily family);
    void write(OutputFolder folder);

    // Before the first write. Both stop with stopped_status() (chain/base/stop.h).
    // Errors (usage): rules 1 and 2, inputs in a folder of rule 4, and names that are too long.
    Status check_names() const;
    // Errors (output): rules 3 and 4, and folders in the place of files.
    Status check_existing() const;
    Status check_existing(const std::vector<std::string>& paths) const;  // only these outputs
    Status check() const;                                                // everything
    // For a job that makes no folders. Errors (output): a folder is missing or takes no files.
    Status check_folders() const;

    // After check(): removes temporaries (.NAME.PID.tmp) that killed processes have left.
    void remove_left_temporaries() const;

    // Creates the folders of rule 4 with their marks. Errors (output).
    Status make_folders() const;

    // OnExisting for the writer of this file: fail or overwrite; fail if it is not one of the
    // outputs. Errors: rule 1, checked again. Thread-safe.
    Result<OnExisting> permit(const std::string& path) const;
    // Writes a permitted file. Errors: those of permit() and AtomicFile.
    Status put(const std::string& path, std::string_view text) const;

  private:
    struct Pattern {
        std::string folder;  // resolved
        PathPattern names;
        std::string what;
    };
    std::string add_folder(const std::string& folder);
    std::string resolved(const std::string& path);
    std::string conflict(const std::string& path, const std::string& resolved) const;
    std::string input_in(const std::string& folder) const;
    Status existing(const std::vector<const OutputFile*>& files) const;
    Status family_names(const OutputFamily& family) const;
    Status folder_state(const OutputFolder& folder) const;
    std::string choice() const;

    OnExisting on_existing_;
    std::string choices_;
    std::map<FileIdentity, std::string> inputs_;   // descriptions
    std::map<std::string, std::string> input_at_;  // by resolved path
    std::vector<Pattern> patterns_;
    std::vector<OutputFile> files_;
    std::map<std::string, size_t> file_at_;         // by resolved path
    std::vector<std::pair<size_t, size_t>> twice_;  // pairs of files that are the same
    std::vector<OutputFamily> families_;
    std::vector<OutputFolder> folders_;
    FolderNames folder_names_;
    std::map<std::string, std::string> resolved_folders_;  // by the folder as it is given
};

}  // namespace postchain::io

// How files that users, clients and frames name are opened for reading, and folders for listing and
// writing. Each reader opens them here. A FIFO or a device would hold a thread for as long as its
// writer likes, so that only regular files are read; a command also reads texts from pipes.
//
// A process may be confined: what is in one of its folders is then opened beneath it, with all
// links followed beforehand and none followed by the open itself (openat2 with RESOLVE_BENEATH and
// RESOLVE_NO_SYMLINKS), so that no link that appears meanwhile leads elsewhere.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace postchain {

// For the whole process, from now on. `folders`: absolute, without links; none = not confined. What
// is named outside of them is opened as it is.
void confine_files(const std::vector<std::string>& folders);
// Likewise, and nothing else is opened but files in `readable` folders, or of these names.
void confine_files(const std::vector<std::string>& folders,
                   const std::vector<std::string>& readable);

enum class Pipes { refused, read_by_commands };

// A file that is open for reading.
class ReadableFile {
  public:
    explicit ReadableFile(const std::string& path, Pipes pipes = Pipes::refused);
    ~ReadableFile();
    ReadableFile(const ReadableFile&) = delete;
    ReadableFile& operator=(const ReadableFile&) = delete;

    bool ok() const { return fd_ >= 0; }
    int error() const { return error_; }  // as errno, if it is not open
    // Why it is not open: "is not a file", "cannot be opened: Permission denied".
    std::string fault() const;

    int fd() const { return fd_; }
    int release();  // the caller closes it
    uint64_t bytes() const { return bytes_; }
    // The open file as a path, for libraries that open paths. Valid while this object exists.
    std::string path() const;
    // Its contents; nothing if it cannot be read or has more than `most` bytes.
    std::optional<std::string> text(uint64_t most) const;

  private:
    int fd_ = -1;
    int error_ = 0;
    uint64_t bytes_ = 0;
};

// A folder whose files are listed, made, renamed and removed. In a confined process it stays the
// folder that was opened, whatever takes its place.
class OpenFolder {
  public:
    explicit OpenFolder(const std::string& path);
    OpenFolder(OpenFolder&& other) noexcept;
    OpenFolder& operator=(OpenFolder&&) = delete;
    ~OpenFolder();

    int error() const { return error_; }  // as errno, if it is not open; 0 = it may be used
    // For calls of the system, while this object exists; not for messages.
    const std::string& path() const { return path_; }
    std::string at(const std::string& name) const;

  private:
    std::string path_;
    int fd_ = -1;
    int error_ = 0;
};

// Why an error of the system keeps a file or a folder from being opened.
std::string reason_of_open(int error);

// Makes a folder and those above it; an existing one is no error. Returns errno; 0 = it exists.
int make_folders(const std::string& path);

// The contents of a small file of this program, such as a sidecar; empty if it cannot be read.
std::string text_of_file(const std::string& path);

}  // namespace postchain

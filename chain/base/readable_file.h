// How files that users, clients and frames name are opened for reading. Each reader opens them
// here. A FIFO or a device would hold a thread for as long as its writer likes, so that only
// regular files are read; a command also reads texts from pipes.
//
// A service confines its process: a file in one of its folders is then opened beneath it, with all
// links followed beforehand and none followed by the open itself (openat2 with RESOLVE_BENEATH and
// RESOLVE_NO_SYMLINKS), so that no link that appears meanwhile leads elsewhere.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace postchain {

// For the whole process, from now on. `folders`: absolute, without links; none = as a command.
void confine_reads(const std::vector<std::string>& folders);

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

// The contents of a small file of this program, such as a sidecar; empty if it cannot be read.
std::string text_of_file(const std::string& path);

}  // namespace postchain

// A process of the service's own program that reads files of clients: what a damaged file does to
// it costs one request. It has limits of memory and files, and is confined
// (tools/apps/common/confine.h) to the folders of the service and its cache of programs.
#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

// A file descriptor that is closed with the object.
class HelperEnd {
  public:
    HelperEnd() = default;
    ~HelperEnd() { close(); }
    HelperEnd(const HelperEnd&) = delete;
    HelperEnd& operator=(const HelperEnd&) = delete;
    void close();
    int fd = -1;
};

// A child with pipes to its stdin and from its stdout. It is killed with the object, unless it has
// ended, and always waited for.
class HelperProcess {
  public:
    HelperProcess() = default;
    ~HelperProcess() { end(); }
    HelperProcess(const HelperProcess&) = delete;
    HelperProcess& operator=(const HelperProcess&) = delete;

    // Runs `program word`. Errors (internal).
    Status start(const std::string& program, const std::string& word);
    bool runs();
    // False: the child has ended.
    bool send(std::string_view text);
    int from() const { return from_.fd; }
    int wait();  // until it ends, as waitpid()
    void end();  // kills it

  private:
    HelperEnd to_, from_;
    pid_t pid_ = -1;
};

// ---------------------------------------------------------------------------- within the process
bool send_all(int fd, std::string_view text);
void set_limit(decltype(RLIMIT_AS) what, rlim_t most);
// Bytes that libraries and threads need beside a frame.
inline constexpr uint64_t kOwnMemory = uint64_t(2) << 30;

}  // namespace postchain::service

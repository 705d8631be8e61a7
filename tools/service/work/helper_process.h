// A process that reads files of clients for the service: what a damaged file does to it costs one
// request. It confines itself to the folders of the user (tools/apps/common/confine.h).
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "chain/base/status.h"
#include "tools/service/work/process.h"

namespace postchain::service {

// Bytes that libraries and threads need beside a frame.
inline constexpr uint64_t kOwnMemory = uint64_t(2) << 30;

// A child with pipes to its stdin and from its stdout. It is killed with the object, unless it has
// ended, and always waited for.
class HelperProcess {
  public:
    HelperProcess() = default;
    ~HelperProcess() { end(); }
    HelperProcess(const HelperProcess&) = delete;
    HelperProcess& operator=(const HelperProcess&) = delete;

    // Runs `program word`, which may write `memory` bytes of its own. Errors (internal).
    Status start(const std::string& program, const std::string& word, uint64_t memory);
    bool runs();
    // False: the child has ended.
    bool send(std::string_view text);
    int from() const { return from_.get(); }
    int wait();  // until it ends, as waitpid()
    void end();  // kills it

  private:
    Descriptor to_, from_;
    pid_t pid_ = -1;
};

}  // namespace postchain::service

// Memory that frames take, said before it is taken.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// "8G", "500M", "1.5 GiB", "4096": bytes, in powers of 1024. Errors (usage): no such size, 0.
Result<uint64_t> parse_bytes(std::string_view text);
std::string bytes_text(uint64_t bytes);  // "6.2 GiB"

// Three quarters of what the machine has, or the control group that the process is in.
uint64_t default_memory_limit();

// To read `rows` rows of these planes: channels as stored, and planes as float. With Keep::all also
// what writing the frame back takes: the filtered color, and the channels of its data window.
uint64_t frame_bytes(const FrameHeader& header, RoleSet present, io::Keep keep, int rows);

// Error (input) where `limit` (0: none) is less: the file, what is needed, the limit, the remedy.
Status check_memory(const std::string& path, uint64_t bytes, uint64_t limit);

// Lets frames in as long as they fit together; one alone always does.
class MemoryGate {
  public:
    explicit MemoryGate(uint64_t limit) : limit_(limit) {}
    void enter(uint64_t bytes);  // waits
    void leave(uint64_t bytes);

  private:
    const uint64_t limit_;  // 0: none
    std::mutex mutex_;
    std::condition_variable left_;
    uint64_t taken_ = 0;
};

}  // namespace postchain::sequence

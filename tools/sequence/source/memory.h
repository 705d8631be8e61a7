// Computes the memory of frames before allocating it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/memory_limit.h"

namespace postchain::sequence {

// "8G", "500M", "1.5 GiB", "4096": bytes, in powers of 1024. Errors (usage): not a size, 0.
Result<uint64_t> parse_bytes(std::string_view text);

// Memory to read `rows` rows of these planes: channels as stored, planes as float. Keep::all adds
// the memory to write the frame back: the filtered color and the channels of its data window.
uint64_t frame_bytes(const FrameHeader& header, RoleSet present, io::Keep keep, int rows);

// Error (input) if `limit` is exceeded (0 = none): names the file, the need, the limit and a
// remedy.
Status check_memory(const std::string& path, uint64_t bytes, uint64_t limit);

// Admits frames while they fit together; a single frame always does.
class MemoryGate {
  public:
    explicit MemoryGate(uint64_t limit) : limit_(limit) {}
    void enter(uint64_t bytes);  // waits
    void leave(uint64_t bytes);

  private:
    const uint64_t limit_;  // 0 = none
    std::mutex mutex_;
    std::condition_variable left_;
    uint64_t taken_ = 0;
};

// Number of layers per run: as many as fit in 384 MiB, from 1 to 32.
int layers_at_once(uint64_t pixels);

}  // namespace postchain::sequence

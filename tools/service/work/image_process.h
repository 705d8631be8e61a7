// Images of files that clients name, decoded in a process of their own (tools/service/preview): a
// decoder that a file crashes, or that takes too much memory or time, costs that request alone.
//
//   service: a line of JSON    {"folders", "words", "path", "frame", "memory", "type", "side"}
//   process: "n" and 8 bytes   the memory that it needs; the service answers "g" when there is room
//   process: "k" and the image, or "e" and {"code", "message"}
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>

#include "tools/service/work/job_files.h"
#include "tools/service/work/service.h"

namespace postchain::service {

inline constexpr const char* kImageWord = "image";

// Bytes that images have together.
class MemoryGate {
  public:
    explicit MemoryGate(uint64_t limit) : limit_(limit) {}
    uint64_t limit() const { return limit_; }

    // Waits until there is room, or nobody else is inside.
    class Place {
      public:
        Place(MemoryGate& gate, uint64_t bytes) : gate_(gate), bytes_(bytes) {
            std::unique_lock lock(gate.mutex_);
            gate.left_.wait(lock,
                            [&] { return gate.taken_ == 0 || gate.taken_ + bytes <= gate.limit_; });
            gate.taken_ += bytes;
        }
        ~Place() {
            const std::lock_guard lock(gate_.mutex_);
            gate_.taken_ -= bytes_;
            gate_.left_.notify_all();
        }
        Place(const Place&) = delete;
        Place& operator=(const Place&) = delete;

      private:
        MemoryGate& gate_;
        const uint64_t bytes_;
    };

  private:
    const uint64_t limit_;
    std::mutex mutex_;
    std::condition_variable left_;
    uint64_t taken_ = 0;
};

// An image of a file by `program`, with memory of `gate`. Errors: those of reading; (input): the
// process died, or took too long; (canceled): the client has left; (internal): it cannot be
// started.
Result<std::string> image_of(const std::string& program, const ShownFrame& shown,
                             const Roots& roots, const ImageWanted& wanted, MemoryGate& gate);

}  // namespace postchain::service

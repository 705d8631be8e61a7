// Reads the frames of a sequence on a thread of its own, ahead of the one that is shown, and keeps
// the last ones as far as memory allows. Notices new, changed and removed files.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "chain/pass/chain.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::view {

using SharedFrame = std::shared_ptr<const sequence::SourceFrame>;

class FrameStore {
  public:
    // `budget`: bytes of planes to keep; the wanted frame is kept in any case. `wake` is called on
    // the reading thread after each change.
    FrameStore(sequence::RunSettings settings, uint64_t budget, std::function<void()> wake);
    ~FrameStore();
    FrameStore(const FrameStore&) = delete;
    FrameStore& operator=(const FrameStore&) = delete;

    // Reads this frame next, then those after it, or before it if `direction` is negative. The
    // planes are those that `chain` reads, and depth and motion vectors.
    void want(int frame, int direction, std::shared_ptr<const Chain> chain);
    // Null while it is not read.
    SharedFrame find(int frame) const;
    // Changes with the files of a frame that is kept, and of those around it; 0: it is not kept.
    uint64_t version(int frame) const;
    // Why the frame cannot be read; ok if it can, or is not read yet.
    Status failure(int frame) const;
    // Frames on disk, in order.
    std::vector<int> frames() const;
    uint64_t bytes() const;  // of the planes kept

  private:
    struct CachedFrame {
        SharedFrame frame;
        Status status;
        std::vector<io::FileStamp> stamps;
        uint64_t bytes = 0;
        uint64_t used = 0;
    };
    void work();
    void scan();
    bool read_next();
    void read(int frame, const std::shared_ptr<const Chain>& chain);
    void make_room(int frame);

    const sequence::RunSettings settings_;
    const uint64_t budget_;
    const std::function<void()> wake_;

    // Only the reading thread uses these.
    std::unique_ptr<sequence::SequenceReader> reader_;
    std::vector<int> handed_out_;         // frames of this reader
    std::shared_ptr<const Chain> reads_;  // the chain whose planes it reads

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool stop_ = false;
    std::optional<int> wanted_;
    int direction_ = 1;
    std::shared_ptr<const Chain> chain_;
    sequence::FramesOnDisk files_, neighbors_;  // neighbors need no layer behind
    std::map<int, CachedFrame> kept_;
    uint64_t clock_ = 0;
    std::thread thread_;
};

// Planes that any frame of the chain may need, mattes included. A chain that may need others needs
// frames to be read again.
bool reads_the_same(const Chain& a, const Chain& b);

// Lets the calling thread, and the threads that it starts, wait for others that want the processor.
void give_way();

}  // namespace postchain::view

// Walks a sequence; the only place that does.
//
//   reader thread                  this thread (GL)        writer thread
//   open, begin, read, prepare  -> process              -> write               per frame
//
// A FrameJob does the steps between the arrows. Neighboring frames overlap; at most kFramesInFlight
// exist at a time, so memory does not grow with the sequence's length. The overlap never changes
// pixels. Neighboring frames share planes (source/sequence_reader.h).
#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "chain/base/image.h"
#include "tools/sequence/filter/filter_view.h"
#include "tools/sequence/planes/frame_reader.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/run/frame_feed.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

// A frame on its way through the three threads.
struct FrameInFlight {
    size_t index = 0;    // in the order of the walk
    uint64_t bytes = 0;  // that the walk keeps free for it
    FrameReport report;
    std::optional<SourceFrame> source;  // none = the report is final
    FilteredView filtered;
    std::vector<FilteredView> other_views;  // results of source->other_views
};

using Upcoming = std::function<const FrameInFlight*()>;

// The per-frame work of a walk: run/run_sequence.h filters and writes, visit_sequence() hands
// frames to a caller. The stages of one frame run in order, each on its thread; stages of different
// frames overlap. An error in a stage fails that frame.
class FrameJob {
  public:
    virtual ~FrameJob() = default;

    virtual io::Keep keep() const = 0;

    // Reader thread. Planes to read besides color, for a frame and its neighbors; decided from its
    // header.
    virtual RoleSet planes(const FrameHeader& header) const = 0;
    // Reader thread, before pixels are read. False = the frame is already done.
    virtual Result<bool> begin(const FrameTask& task, const FrameToRead& opened,
                               FrameReport& report) = 0;
    // Reader thread, after the frame is read.
    virtual Status prepare(const SourceFrame& source, FrameReport& report) = 0;
    // The thread of walk_sequence(). `upcoming` returns the frame after it, or null as long as that
    // is being read.
    virtual Status process(FrameInFlight& frame, const Upcoming& upcoming) = 0;
    // Writer thread.
    virtual Status write(FrameInFlight& frame) = 0;
};

inline constexpr int kFramesInFlight = 4;  // reading, waiting, processing, writing

// The functions that a run calls, and the one that ends it; each may be empty.
struct RunCallbacks {
    FrameObserver finished = {};
    const std::atomic<bool>* stop = nullptr;  // the frame under way is not written
    FrameStart start = {};
    WaitObserver waits = {};  // while the walk can only wait for a frame
    StepObserver steps = {};
    SequenceReader::TryFile try_file = {};  // on the reader thread
};

// Runs the job on each frame of the feed. Failures of single frames are in the summary; under
// ErrorPolicy::stop every frame before the failed one is still finished. Errors (internal): no
// thread could be started. Throws nothing: exceptions of libraries become a Status.
Result<RunSummary> walk_sequence(FrameJob& job, const RunSettings& settings, FrameFeed& feed,
                                 const RunCallbacks& callbacks);

// Called on the caller's thread with each frame in order. An error fails that frame.
using FrameVisitor = std::function<Status(SourceFrame& frame, FrameReport& report)>;

// Hands each frame of a sequence to the visitor while the next ones are read: color and the
// available planes of `wanted`, of neighbors too. Output settings are ignored. A frame is called
// written if the visitor succeeds. Errors: those of run_sequence().
Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop);

}  // namespace postchain::sequence

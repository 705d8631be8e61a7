// The per-frame work of a walk (run/runner.h). run/run_sequence.h filters and writes;
// run/visit_sequence.h hands frames to a caller.
#pragma once

#include <functional>
#include <optional>

#include "chain/image.h"
#include "tools/sequence/filter/filter_view.h"
#include "tools/sequence/frame/frame_reader.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/settings/frame_task.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

// A frame on its way through the three threads.
struct FrameInFlight {
    FrameReport report;
    std::optional<SourceFrame> source;  // none = the report is final
    FilteredView filtered;
    std::vector<FilteredView> other_views;  // of source->other_views
};

using Upcoming = std::function<const FrameInFlight*()>;

// The stages of one frame run in order, each on its thread; stages of different frames overlap. An
// error in a stage fails that frame.
class FrameJob {
  public:
    virtual ~FrameJob() = default;

    virtual io::Keep keep() const = 0;

    // Reader thread. Planes to read besides color, for a frame and its neighbors; decided from its
    // header.
    virtual RoleSet planes(const FrameHeader& header) const = 0;
    // Reader thread, before pixels are read. False = the frame is already done.
    virtual Result<bool> begin(const FrameTask& task, const FrameInputs& inputs,
                               FrameReport& report) = 0;
    // Reader thread, after the frame is read.
    virtual Status prepare(const SourceFrame& source, FrameReport& report) = 0;
    // The thread of walk_sequence(). `upcoming` returns the frame after it, or null as long as that
    // is being read.
    virtual Status process(FrameInFlight& frame, const Upcoming& upcoming) = 0;
    // Writer thread.
    virtual Status write(FrameInFlight& frame) = 0;
};

}  // namespace postchain::sequence

// What is done with each frame of a sequence. The walk (run/runner.h) knows no more of it than
// this: run/run_sequence.h filters and writes, run/visit_sequence.h shows frames to a caller.
#pragma once

#include <optional>

#include "chain/image.h"
#include "tools/sequence/frame/frame_reader.h"
#include "tools/sequence/run/frame_report.h"
#include "tools/sequence/run/frame_source.h"
#include "tools/sequence/run/frame_task.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::sequence {

// A frame on its way through the three threads.
struct FrameInFlight {
    FrameReport report;
    std::optional<SourceFrame> source;  // none: the report is final
    ImageF result;
    ImageF layers;  // filtered, one below another; empty: the file's own stay
    std::vector<io::RankedCoverage> cryptomattes;  // filtered; empty: the file's own stay
};

// The four stages of one frame come one after the other, each on its thread; the stages of
// different frames overlap. An error of any of them is that frame's.
class FrameJob {
  public:
    virtual ~FrameJob() = default;

    // How much of each file is read.
    virtual io::Keep keep() const = 0;

    // Reader thread. The planes to read besides color, of a frame and of its neighbors, which
    // follow from its header alone.
    virtual RoleSet planes(const FrameHeader& header) const = 0;
    // Reader thread, before pixels are read. False: the frame is done already.
    virtual Result<bool> begin(const FrameTask& task, const FrameInputs& inputs,
                               FrameReport& report) = 0;
    // Reader thread, when the frame is read.
    virtual Status prepare(const SourceFrame& source, FrameReport& report) = 0;
    // The thread of walk_sequence().
    virtual Status process(FrameInFlight& frame) = 0;
    // Writer thread.
    virtual Status write(FrameInFlight& frame) = 0;
};

}  // namespace postchain::sequence

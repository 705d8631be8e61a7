// The runner: the one place that walks a sequence.
//
//   reader thread          this thread (GL)       writer thread
//   open, read, convert -> plan, filter       -> scan, write, sidecar        per frame
//                       -> a visitor (reports)
//
// Neighboring frames overlap; at most kFramesInFlight are alive, so memory does not grow with the
// length of the sequence, and the pixels never depend on the overlap.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "chain/gl/executor.h"
#include "tools/sequence/io/exr_writer.h"
#include "tools/sequence/io/sequence.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

inline constexpr int kFramesInFlight = 4;  // reading, waiting, filtering, writing

enum class MissingPolicy {
    error,  // nothing is run
    skip,   // the others are run
    hold,   // the nearest earlier frame (else the nearest later one) stands in
};
enum class ErrorPolicy { stop, keep_going };

struct RunSettings {
    io::InputSpec input;
    std::optional<io::FrameRange> frames;  // none: all on disk
    io::PathPattern output;
    SourceSettings source;
    PlanOptions plan;
    io::OnExisting on_existing = io::OnExisting::fail;
    io::HalfOverflow overflow = io::HalfOverflow::refuse;
    MissingPolicy missing = MissingPolicy::error;
    ErrorPolicy on_error = ErrorPolicy::stop;
    bool strict = false;      // non-finite values are an error
    bool sidecar = true;      // OUT.json beside each output
    bool preview = false;     // OUT.png beside each output, display transform, 8 bits
    std::string dump_folder;  // every stage as EXR; empty = none
    std::string version;      // of the command, for metadata
};

enum class Outcome { written, skipped, held, missing, failed };
const char* name_of(Outcome outcome);

struct FrameReport {
    int frame = 0;
    Outcome outcome = Outcome::failed;
    std::map<Role, std::string> inputs;
    std::string output;
    int held_from = 0;  // of Outcome::held: the frame whose picture stands in
    Status status;      // of Outcome::failed and missing
    std::vector<std::string> warnings;
    std::string profile;
    std::optional<Plan> plan;
    std::string work;  // work_text() of it
    FrameFacts facts;
    std::optional<std::array<int, 2>> first_nonfinite;  // x, y as in the file, display's axes
    uint64_t output_nonfinite = 0;
    io::WriteReport write;
    double read_ms = 0, convert_ms = 0, filter_ms = 0, write_ms = 0;
    std::vector<PassTime> pass_times;
    std::vector<WorkDone> work_done;
    std::string timing_source;
    std::string renderer;
    ExecutorCounters counters;
    int frames_in_flight = 0;  // largest seen so far in this run
};

struct RunProgress {
    size_t done = 0;  // frames finished, in any way
    size_t total = 0;
    double elapsed_s = 0;
    double remaining_s = 0;  // estimate; 0 when unknown
};

struct RunSummary {
    size_t total = 0, written = 0, skipped = 0, held = 0, missing = 0, failed = 0;
    Status first_failure;
    std::vector<int> gaps;  // not asked for: holes in what was found on disk
    double elapsed_s = 0;
    ExecutorCounters counters;
    int frames_in_flight = 0;
};

// Called on the caller's thread, in the order in which frames finish.
using FrameObserver = std::function<void(const FrameReport&, const RunProgress&)>;

// Filters the sequence. `executor` must belong to the GL context current on this thread. `stop`
// (may be null) ends the run after the frame under way. A Status that is not ok means that nothing
// could be started (no frames, missing frames under MissingPolicy::error, output equal to input, an
// output that exists under OnExisting::fail with ErrorPolicy::stop); failures of single frames are
// in the summary. Under ErrorPolicy::stop every frame before the failed one is still written.
// Nothing is thrown: what a library throws becomes a Status.
Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop);

// Called on the caller's thread with each frame in order, while the next ones are being read. A
// failure is that frame's.
using FrameVisitor = std::function<Status(SourceFrame& frame, FrameReport& report)>;

// The same walk for whoever has other plans with a frame than writing it: reads color and those
// of `wanted` that there are. Whatever settings say about chain and output is not looked at. A
// frame that the visitor took well counts as written.
Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop);

// "1, 2, 5", at most twenty of them.
std::string frames_text(const std::vector<int>& frames);

// What the output's "postchain" attribute says: program version, chain and work hash. Two outputs
// of equal work have equal text.
std::string work_text(const Chain& chain, const RunSettings& settings, const FrameHeader& header,
                      const std::map<Role, std::string>& files, int frame);

}  // namespace postchain::sequence

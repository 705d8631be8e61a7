// Reports of one frame and of a whole run, and exit codes.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/frame/frame.h"
#include "chain/gl/executor.h"
#include "chain/plan/plan.h"
#include "tools/sequence/exr/write_options.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/filter/cryptomatte_filter.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/resolved_values.h"

namespace postchain::sequence {

enum class Outcome { written, skipped, held, missing, failed };
const char* name_of(Outcome outcome);

struct FrameReport {
    int frame = 0;
    Outcome outcome = Outcome::failed;
    std::map<Role, std::string> inputs;
    std::string output;
    int held_from = 0;  // for Outcome::held: the frame used instead
    Status status;      // for Outcome::failed and missing
    std::vector<std::string> warnings;
    std::string profile;
    std::vector<std::string> views;  // that are filtered, if there are several
    std::optional<FramePlan> plan;
    std::optional<ResolvedValues> resolved;
    std::string provenance;                       // record/fingerprint.h
    std::string preview_provenance;               // preview's origin, if requested
    std::vector<io::FileStamp> stamps;            // all files read, neighbors' too
    std::vector<CryptomatteReport> cryptomattes;  // filtered ones
    FrameFindings findings;                       // outlive the frame
    io::Window window;                            // data window of the output
    uint64_t output_nonfinite = 0;
    io::WriteReport write;
    uint64_t written_bytes = 0;  // image, preview, sidecar and stages
    double filter_ms = 0, write_ms = 0;
    std::vector<PassTime> pass_times;
    std::vector<WorkDone> work_done;
    std::string timing_source;
    std::string renderer;
    ExecutorCounters counters;
    int frames_in_flight = 0;  // largest so far in this run
};

struct RunProgress {
    size_t done = 0;  // frames finished with any outcome
    size_t total = 0;
    double elapsed_s = 0;
    double remaining_s = 0;  // estimate; 0 if unknown
};

struct RunSummary {
    size_t total = 0, written = 0, skipped = 0, held = 0, missing = 0, failed = 0;
    Status first_failure;
    bool unhealthy = false;  // --strict refused a frame, the first that failed or another
    std::vector<int> gaps;   // numbers missing on disk that were not requested
    double elapsed_s = 0;
    ExecutorCounters counters;
    int frames_in_flight = 0;
    size_t frames_decoded = 0;  // with neighbors that were not requested
};

// Called on the caller's thread, in the order in which frames finish.
using FrameObserver = std::function<void(const FrameReport&, const RunProgress&)>;
// Called on the caller's thread several times a second with the frames being waited for.
using WaitObserver = std::function<void(const std::string&, const RunProgress&)>;

}  // namespace postchain::sequence

namespace postchain {

// Exit codes of the command and of service jobs (listed in docs/command.md).
inline constexpr int kExitOk = 0;
inline constexpr int kExitSomeFailed = 1;  // some frames failed
inline constexpr int kExitUsage = 2;
inline constexpr int kExitChain = 3;
inline constexpr int kExitInput = 4;
inline constexpr int kExitOutput = 5;
inline constexpr int kExitGl = 6;
inline constexpr int kExitHealth = 7;
inline constexpr int kExitThreshold = 8;  // an error metric exceeds --fail-above
inline constexpr int kExitSignal = 128;   // plus the signal's number

int exit_code(const Status& status);
// The exit code if `good` other frames succeeded.
int exit_code(const Status& first_failure, size_t good);
int exit_code(const sequence::RunSummary& summary);

}  // namespace postchain

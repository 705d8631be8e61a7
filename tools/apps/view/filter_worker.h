// Filters frames on a thread and GL context of its own.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "tools/apps/view/frame_store.h"
#include "tools/sequence/source/resolved_values.h"

namespace postchain::view {

// The mask of --fill-mask as a texture: shares of a pixel from its frame, from a neighbor, and from
// an estimate.
inline constexpr const char* kFillMask = "fill";

struct FilterRequest {
    uint64_t id = 0;
    SharedFrame source;
    std::shared_ptr<const Chain> chain;
    double scale = 1;       // of both sides; 1: as `postchain run` filters it
    std::string texture;    // also read back: a texture of the plan, or kFillMask; empty: none
    bool may_stop = false;  // a later request stops it
    std::chrono::steady_clock::time_point since = {};  // of the change that it answers
};

struct Filtered {
    std::shared_ptr<const ImageF> color;
    std::shared_ptr<const ImageF> texture;  // null if the plan has no such texture
    std::shared_ptr<const Plan> plan;
    sequence::ResolvedValues resolved;
    std::vector<PassTime> times;  // of steps
    std::vector<WorkDone> work_done;
    ExecutorCounters counters;
    double milliseconds = 0;
};
struct FilterResult : Filtered {
    FilterRequest request;
    Status status;
    std::vector<std::string> messages;  // of GL's compiler, since the last result
};

class FilterWorker {
  public:
    // Errors (gl): no OpenGL 4.5. `wake` is called on the worker's thread after each result.
    static Result<std::unique_ptr<FilterWorker>> start(const egl::ContextOptions& context,
                                                       const PlanOptions& plan,
                                                       std::function<void()> wake);
    ~FilterWorker();
    FilterWorker(const FilterWorker&) = delete;
    FilterWorker& operator=(const FilterWorker&) = delete;

    // Replaces a request that has not begun, and stops the one that runs if that may_stop: quick
    // ones are finished, so that a drag shows pictures while the hand moves.
    void submit(FilterRequest request);
    // Nothing waits, nothing runs.
    bool idle() const;
    // The results so far, oldest first; without those of stopped requests.
    std::vector<FilterResult> take();
    const std::string& renderer() const { return renderer_; }

  private:
    FilterWorker(const PlanOptions& plan, std::function<void()> wake);
    void work(const egl::ContextOptions& options, Status* started);
    FilterResult filter(FilterRequest request);
    Status filter_into(FilterResult& result);
    Status read_fill_mask(const Chain& chain, const sequence::SourceFrame& source,
                          const FrameDescription& planned, FilterResult& result);
    SharedFrame reduced(const FilterRequest& request);

    PlanOptions plan_;  // its device is known when work() begins
    const std::function<void()> wake_;
    std::string renderer_;

    // Only the worker's thread uses these.
    std::unique_ptr<Executor> executor_;
    SharedFrame reduced_from_, reduced_;
    double reduced_by_ = 1;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool started_ = false;
    bool end_ = false;
    bool running_ = false, may_stop_ = false;
    std::atomic<bool> stop_ = false;
    std::optional<FilterRequest> next_;
    std::vector<FilterResult> results_;
    std::vector<std::string> messages_;
    std::thread thread_;
};

}  // namespace postchain::view

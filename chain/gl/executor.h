// The executor walks a plan with GL: textures from the pool, programs from the cache, each step in
// one dispatch or in bands. It knows no pass, and works on the current context, no matter who
// created it.
//
// run() reads nothing back, and GL's error flag only if GL refuses an allocation. filter() clears
// the flag when it begins and checks each of its calls.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "chain/base/status.h"
#include "chain/frame/frame.h"
#include "chain/gl/band_queue.h"
#include "chain/gl/clock.h"
#include "chain/gl/compiled_plan.h"
#include "chain/gl/device.h"
#include "chain/gl/program.h"
#include "chain/gl/run_objects.h"
#include "chain/gl/texture_pool.h"
#include "chain/gl/transfers.h"
#include "chain/plan/plan.h"

namespace postchain {

struct ExecutorCounters {
    uint64_t texture_allocations = 0;  // since the executor was made
    uint64_t textures_alive = 0;
    uint64_t texture_bytes_peak = 0;
    uint64_t programs = 0;  // compiled so far
    uint64_t dispatches = 0;
};

struct PassTime {
    int pass = 0;      // index into Plan::passes
    std::string name;  // "motion_blur", or a step: "motion_blur.gather"
    double milliseconds = 0;
};

// Called with every texture after the last step that writes it, read back. A failure ends the run.
using StageObserver =
    std::function<Status(const Step& step, const PlanTexture& texture, const ImageF& pixels)>;

struct ExecutorOptions {
    uint64_t frames_kept = 8;  // a texture unused for this many frames is freed
    bool labels = false;       // names of steps and textures for GL debuggers (KHR_debug)
};

// The next run of filter().
struct NextRun {
    const Plan* plan = nullptr;
    const SharedPlanes* planes = nullptr;  // filter() gets the same ones
};

class Executor {
  public:
    // `device`: describes the context that is current now and at every call.
    explicit Executor(const gl::Device& device, const ExecutorOptions& options = {});
    Executor(const Executor&) = delete;
    Executor& operator=(const Executor&) = delete;

    // The class of its device: plans should be made for it (PlanOptions::device).
    DeviceClass device_class() const { return class_; }

    // Uploads the planes the plan reads, runs it and reads the outputs back. A plan without steps
    // touches no GL: its outputs are the inputs.
    Result<FramePlanes> filter(const Plan& plan, PlaneView inputs,
                               const StageObserver& observer = {});

    // Runs on textures that are already on the device (imported role -> GL name); the result's
    // textures belong to the pool until the next call. Nothing is read back.
    Result<std::map<Role, unsigned>> run(const Plan& plan, const std::map<Role, unsigned>& inputs,
                                         const StageObserver& observer = {});

    // filter() calls `next` while it waits for a GPU, until that knows the run after it, and
    // uploads planes of that run meanwhile. Empty: no run is known (ExpectScope).
    void expect(std::function<NextRun()> next);
    // Lets go of planes of an expected run that does not come.
    void forget_expected();

    // The number of blocks in each list of the plan after the last filter(); run() reads nothing
    // back.
    std::vector<WorkDone> work_done() const { return work_done_; }

    // Time of each pass, or of each step, in the last run; empty unless timing was on, and while
    // the device has not finished (after filter() it has).
    void set_timing(bool on, bool steps = false) {
        timing_ = on;
        time_steps_ = steps;
    }
    std::vector<PassTime> pass_times();
    const char* timing_source() const { return clock_.source(); }

    ExecutorCounters counters() const;
    // As if no program had run: the sizes of bands follow from their times (chain/plan/bands.h).
    void forget_rates() { timer_.forget(); }

  private:
    friend class ContinueScope;
    Status execute(const Plan& plan, const std::map<Role, unsigned>& inputs,
                   const StageObserver& observer, gl::BandQueue* queue);
    RunDecision decide() const;
    Status show(const Plan& plan, int step, const StageObserver& observer);
    // A plane whose texture is filled before the run that reads it.
    struct Ahead {
        std::shared_ptr<const ImageF> pixels;
        gl::Texture* texture;
        gl::Upload upload;
    };
    Result<gl::Texture*> fill_texture(const PlanTexture& texture, const ImageF& pixels);
    bool upload_ahead();
    void begin_uploads(const NextRun& next);

    const bool software_;
    const DeviceClass class_;
    const gl::Reads reads_;
    ExecutorOptions options_;
    gl::TexturePool pool_;
    gl::ProgramCache programs_;
    gl::Clock clock_;
    gl::BandTimer timer_;
    gl::RunObjects objects_;
    gl::Transfers transfers_;
    std::vector<Ahead> ahead_;
    bool ahead_begun_ = false;  // of the run after this one
    std::function<NextRun()> expect_;
    std::optional<gl::CompiledPlan> running_;  // the last plan, and its textures
    std::vector<ContinueCallback> asks_;       // of the scopes
    bool timing_ = false, time_steps_ = false;
    uint64_t runs_ = 0;
    uint64_t dispatches_ = 0;
    std::vector<WorkDone> work_done_;
};

// While it exists, filter() of the executor asks this too before each band of a dispatch, waits
// (RunDecision::wait), or ends with StatusCode::canceled (RunDecision::stop). Scopes end in reverse
// order.
class ContinueScope {
  public:
    ContinueScope(Executor& executor, ContinueCallback ask) : executor_(executor) {
        executor_.asks_.push_back(std::move(ask));
    }
    ~ContinueScope() { executor_.asks_.pop_back(); }
    ContinueScope(const ContinueScope&) = delete;
    ContinueScope& operator=(const ContinueScope&) = delete;

  private:
    Executor& executor_;
};

// While it exists, filter() of the executor ends soon after `stop` (null: never) is set.
class StopScope : public ContinueScope {
  public:
    StopScope(Executor& executor, const std::atomic<bool>* stop)
        : ContinueScope(executor,
                        [stop] { return stop && *stop ? RunDecision::stop : RunDecision::go_on; }) {
    }
};

// While it exists, filter() of the executor uploads planes of the run after it.
class ExpectScope {
  public:
    ExpectScope(Executor& executor, std::function<NextRun()> next) : executor_(executor) {
        executor_.expect(std::move(next));
    }
    ~ExpectScope() { executor_.expect({}); }
    ExpectScope(const ExpectScope&) = delete;
    ExpectScope& operator=(const ExpectScope&) = delete;

  private:
    Executor& executor_;
};

}  // namespace postchain

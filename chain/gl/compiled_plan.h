// A plan made ready for a device: programs, storage of its textures, barriers, and the bytes of its
// uniform blocks, so that running it allocates nothing.
//
// It has two parts. The shape (programs, textures, bindings, groups, barriers) is fixed when it is
// made. The values (bytes of uniform blocks, names of imported textures) may be replaced before
// every run.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "chain/base/status.h"
#include "chain/gl/band_queue.h"
#include "chain/gl/band_timer.h"
#include "chain/gl/clock.h"
#include "chain/gl/image_reads.h"
#include "chain/gl/program.h"
#include "chain/gl/run_objects.h"
#include "chain/gl/texture_pool.h"
#include "chain/plan/bands.h"
#include "chain/plan/plan_values.h"
#include "chain/plan/storage.h"

namespace postchain::gl {

// How many of the first units and binding points a plan's steps use.
struct UsedUnits {
    int textures = 0;
    int images = 0;
    int lists = 0;  // storage buffers; > 0: the indirect buffer too
};

// Options of a run.
struct RunOptions {
    Clock* clock = nullptr;   // marks intervals; begun by the caller
    bool time_steps = false;  // each step, not each pass
    bool labels = false;      // a debug group for each step
    uint32_t barriers = 0;    // GL_*_BARRIER_BIT besides its own, after the last step
    // Cuts steps into bands and may hold up or end the run before one; null: no wait, no flush.
    BandQueue* queue = nullptr;
    // Without a queue: knows the rates from which bands follow, and measures those of long steps;
    // null: kUnknownRate.
    BandTimer* timer = nullptr;
    // Called after each step, with its index; a failure ends the run.
    const std::function<Status(int)>* after_step = nullptr;
};

class CompiledPlan : public PlanValues {
  public:
    // Takes the plan's textures from the pool, which keeps them: plans that do not run at the same
    // time share them. Compiles the programs that are not yet compiled. With `max_size`, textures
    // are as large as frames up to that size need (chain/plan/plan.h, fit()); otherwise as in
    // `plan`. With Reads::images, imported textures have the plan's formats. Errors: those of pool
    // and compiler, and StatusCode::internal if a step's block is not its program's. The pool must
    // outlive it.
    static Result<CompiledPlan> make(Plan plan, TexturePool& pool, ProgramCache& programs,
                                     RunObjects& objects, bool labels,
                                     const std::optional<MaxFrameSize>& max_size = {},
                                     Reads reads = Reads::textures);
    CompiledPlan(CompiledPlan&&) = default;
    CompiledPlan& operator=(CompiledPlan&&) = delete;
    ~CompiledPlan();

    UsedUnits used() const { return used_; }
    uint32_t barriers() const { return barriers_; }
    // True if one of its textures was not used for more frames than this, by any plan.
    bool holds_unused(uint64_t frames) const;
    // GL's name of a texture or work list; 0 if no step uses it, or it was not imported yet.
    unsigned name_of(TextureId texture) const { return names_[size_t(texture)]; }

    // Sets the texture of an imported one, and its GL format and image if it is written to. Several
    // may be one texture, as a host's output over its color.
    void import(TextureId texture, unsigned name, unsigned image_format = 0, ImageOf image = {});

    // Dispatches one work group of a step, so that a driver which compiles at a program's first
    // dispatch has done so. The step's results are undefined; what no step has written is 0.
    void warm_up(RunObjects& objects, int step);
    unsigned program_of(int step) const { return commands_[size_t(step)].program; }
    // Dispatches every step; afterwards their results can be used by any GL command. If
    // `after_step` or the queue fails, nothing further runs.
    Status run(RunObjects& objects, const RunOptions& options = {});

  private:
    struct Command {
        unsigned program = 0;
        unsigned barriers = 0;  // before it
        bool in_bands = false;  // the program can run in them
    };
    CompiledPlan(Plan plan, TexturePool& pool, size_t alignment, Reads reads)
        : PlanValues(std::move(plan), alignment), pool_(&pool), reads_(reads) {}
    Status take_textures(bool labels, const std::optional<MaxFrameSize>& max_size);
    Status take_programs(ProgramCache& programs);
    void find_barriers();
    // `offset`: of the uniform blocks in the buffer.
    void bind(size_t step, const RunObjects& objects, size_t offset);
    Status dispatch(const Step& step, const Command& command, const RunOptions& options) const;
    Status dispatch_queued(const Step& step, const Command& command, BandQueue& queue) const;
    void dispatch_whole(const Step& step, unsigned columns, unsigned rows) const;
    void dispatch_band(const Step& step, const Band& band) const;

    TexturePool* pool_;
    Reads reads_;
    std::vector<Texture*> textures_;       // textures of the pool, each once
    std::vector<unsigned> names_;          // names of the plan's textures
    std::vector<unsigned> image_formats_;  // likewise
    std::vector<ImageOf> images_;          // likewise, of imported ones
    std::vector<int> storage_;             // number of the storage of each of them
    std::vector<TextureId> lists_;
    std::vector<Command> commands_;
    UsedUnits used_;
    uint32_t barriers_ = 0;
};

}  // namespace postchain::gl

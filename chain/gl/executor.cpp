#include "chain/gl/executor.h"

#include <algorithm>

#include "chain/gl/debug.h"

namespace postchain {
namespace {

// One frame of the pool: at its end, whatever happens, textures that the last frames did not use
// are freed.
class PoolFrame {
  public:
    PoolFrame(gl::TexturePool& pool, uint64_t kept) : pool_(pool), kept_(kept) {
        pool_.begin_frame();
    }
    ~PoolFrame() { pool_.trim(kept_); }
    PoolFrame(const PoolFrame&) = delete;
    PoolFrame& operator=(const PoolFrame&) = delete;

  private:
    gl::TexturePool& pool_;
    uint64_t kept_;
};

}  // namespace

Executor::Executor(const gl::Device& device, const ExecutorOptions& options)
    : software_(device.software),
      class_(device.device_class()),
      reads_(gl::best_reads(class_)),
      options_(options),
      programs_(device.log, gl::shader_folder_of_environment()),
      clock_(device),
      timer_(device),
      transfers_(device.software) {}

RunDecision Executor::decide() const {
    RunDecision decision = RunDecision::go_on;
    for (const ContinueCallback& ask : asks_) decision = std::max(decision, ask());
    return decision;
}

// Textures that this step is the last to write.
Status Executor::show(const Plan& plan, int step, const StageObserver& observer) {
    for (const auto& binding : plan.steps[size_t(step)].bindings) {
        if (binding.access != Access::write) continue;
        bool again = false;
        for (size_t later = size_t(step) + 1; later < plan.steps.size(); ++later)
            for (const auto& other : plan.steps[later].bindings)
                again =
                    again || (other.access == Access::write && other.texture == binding.texture);
        if (again) continue;
        const auto& texture = plan.textures[size_t(binding.texture)];
        auto pixels = transfers_.download(running_->name_of(binding.texture), texture);
        if (!pixels.ok()) return pixels.status().at(texture.name);
        RETURN_IF_ERROR(observer(plan.steps[size_t(step)], texture, *pixels));
    }
    return Status();
}

Status Executor::execute(const Plan& plan, const std::map<Role, unsigned>& inputs,
                         const StageObserver& observer, gl::BandQueue* queue) {
    work_done_.clear();
    running_.reset();
    ASSIGN_OR_RETURN(auto compiled, gl::CompiledPlan::make(plan, pool_, programs_, objects_,
                                                           options_.labels, {}, reads_));
    running_.emplace(std::move(compiled));
    for (size_t i = 0; i < plan.textures.size(); ++i) {
        const auto& texture = plan.textures[i];
        if (!texture.imported || texture.first_step < 0) continue;
        const auto found = inputs.find(texture.role);
        if (found == inputs.end())
            return Status(StatusCode::internal, texture.name + " was not handed in");
        running_->import(TextureId(i), found->second);
    }
    gl::RunOptions options;
    options.labels = options_.labels;
    options.queue = queue;
    if (!queue) options.timer = &timer_;
    ++runs_;
    if (timing_) {
        clock_.begin(runs_);
        options.clock = &clock_;
        options.time_steps = time_steps_;
    }
    const std::function<Status(int)> after_step = [&](int step) {
        return show(plan, step, observer);
    };
    if (observer) options.after_step = &after_step;
    Status status = running_->run(objects_, options);
    if (status.ok()) dispatches_ += plan.steps.size();
    return status;
}

Result<std::map<Role, unsigned>> Executor::run(const Plan& plan,
                                               const std::map<Role, unsigned>& inputs,
                                               const StageObserver& observer) {
    const PoolFrame frame(pool_, options_.frames_kept);
    RETURN_IF_ERROR(execute(plan, inputs, observer, nullptr));
    std::map<Role, unsigned> outputs;
    for (const auto& [role, id] : plan.outputs) {
        if (plan.textures[size_t(id)].imported) {
            const auto found = inputs.find(role);
            if (found != inputs.end()) outputs[role] = found->second;
        } else if (const unsigned name = running_->name_of(id)) {
            outputs[role] = name;
        }
    }
    return outputs;
}

Result<FramePlanes> Executor::filter(const Plan& plan, PlaneView inputs,
                                     const StageObserver& observer) {
    const PoolFrame frame(pool_, options_.frames_kept);
    if (!plan.steps.empty()) gl::forget_errors();
    std::map<Role, unsigned> names;
    std::vector<gl::Texture*> uploaded;
    const auto release = [&] {
        for (gl::Texture* texture : uploaded) pool_.release(texture);
    };
    for (const auto& texture : plan.textures) {
        if (!texture.imported || !plan.reads.has(texture.role)) continue;
        const ImageF* plane = inputs.find(texture.role);
        Status status;
        if (!plane) {
            status = Status(StatusCode::internal, texture.name + " was not handed in");
        } else if (auto filled = fill_texture(texture, *plane); !filled.ok()) {
            status = filled.status();
        } else {
            uploaded.push_back(*filled);
            names[texture.role] = (*filled)->name;
        }
        if (!status.ok()) {
            release();
            return status.at(texture.name);
        }
    }
    // A software renderer has nothing to wait for.
    const gl::Meanwhile meanwhile =
        expect_ && !software_ ? gl::Meanwhile([this] { return upload_ahead(); }) : gl::Meanwhile();
    gl::BandQueue queue(
        software_, timer_, [this] { return decide(); }, meanwhile);
    Status status = execute(plan, names, observer, &queue);
    if (status.ok() && !plan.steps.empty()) status = gl::check_error("running the plan");
    FramePlanes results;
    for (const auto& [role, id] : plan.outputs) {
        if (!status.ok()) break;
        const auto& texture = plan.textures[size_t(id)];
        if (texture.imported) {
            results[role] = inputs.at(texture.role);
            continue;
        }
        auto pixels = transfers_.download(running_->name_of(id), texture, meanwhile);
        status = pixels.status();
        if (status.ok()) results[role] = std::move(*pixels);
    }
    for (size_t t = 0; t < plan.textures.size() && status.ok(); ++t) {
        const auto& texture = plan.textures[t];
        if (texture.format == Format::work_list)
            work_done_.push_back({texture.name, gl::count_work(running_->name_of(TextureId(t))),
                                  unsigned(texture.width)});
    }
    release();
    if (!status.ok()) return status;
    return results;
}

// The plane's texture, which the run before may have begun to fill.
Result<gl::Texture*> Executor::fill_texture(const PlanTexture& texture, const ImageF& pixels) {
    for (auto ahead = ahead_.begin(); ahead != ahead_.end(); ++ahead) {
        gl::Texture* const known = ahead->texture;
        if (ahead->pixels.get() != &pixels || *known != texture) continue;
        pool_.touch(known);
        const Status status = transfers_.finish(ahead->upload);
        if (!status.ok()) pool_.release(known);
        ahead_.erase(ahead);
        if (!status.ok()) return status;
        return known;
    }
    ASSIGN_OR_RETURN(auto made, pool_.acquire(texture));
    if (Status status = transfers_.upload(*made, pixels); !status.ok()) {
        pool_.release(made);
        return status;
    }
    return made;
}

// A piece of the next run's planes; false: nothing can be done at present.
bool Executor::upload_ahead() {
    if (!ahead_begun_)
        if (const NextRun next = expect_(); next.plan) begin_uploads(next);
    return std::any_of(ahead_.begin(), ahead_.end(),
                       [&](Ahead& ahead) { return transfers_.advance(ahead.upload); });
}

void Executor::begin_uploads(const NextRun& next) {
    forget_expected();
    ahead_begun_ = true;
    for (const PlanTexture& texture : next.plan->textures) {
        const auto plane = next.planes->find(texture.role);
        if (!texture.imported || !next.plan->reads.has(texture.role) || plane == next.planes->end())
            continue;
        auto made = pool_.acquire(texture, true);
        if (!made.ok()) return;  // the run reports it
        ahead_.push_back({plane->second, *made, {*made, plane->second.get()}});
    }
}

void Executor::expect(std::function<NextRun()> next) {
    expect_ = std::move(next);
    ahead_begun_ = false;
}

void Executor::forget_expected() {
    for (const Ahead& ahead : ahead_) pool_.release(ahead.texture);
    ahead_.clear();
}

std::vector<PassTime> Executor::pass_times() {
    std::vector<PassTime> times;
    const Times* newest = clock_.newest();
    if (!newest || newest->frame != runs_) return times;
    for (const auto& interval : newest->intervals)
        times.push_back({interval.pass, interval.name, interval.milliseconds});
    return times;
}

ExecutorCounters Executor::counters() const {
    ExecutorCounters counters;
    counters.texture_allocations = pool_.allocations();
    counters.textures_alive = pool_.alive();
    counters.texture_bytes_peak = pool_.bytes_peak();
    counters.programs = programs_.compiled();
    counters.dispatches = dispatches_;
    return counters;
}

}  // namespace postchain

#include "chain/gl/executor.h"

#include <epoxy/gl.h>

#include "chain/gl/debug.h"

namespace postchain {
namespace {

// A dispatch reads what the one before wrote, as a texture, an image, or a work list. Textures are
// also read back and, given back to the pool, uploaded to; lists are counted and emptied.
constexpr GLbitfield kBarriers = GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                                 GL_TEXTURE_UPDATE_BARRIER_BIT;
constexpr GLbitfield kListBarriers =
    GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT;

unsigned make_sampler(GLenum filter) {
    GLuint sampler = 0;
    glCreateSamplers(1, &sampler);
    glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GLint(filter));
    glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, GLint(filter));
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return sampler;
}

// One frame of the pool, however it ends: then what the last frames did not use is freed.
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
    : options_(options),
      pool_(device.log),
      programs_(device.log),
      clock_(device),
      sampler_nearest_(make_sampler(GL_NEAREST)),
      sampler_linear_(make_sampler(GL_LINEAR)) {
    glCreateBuffers(1, &block_buffer_);
}

Executor::~Executor() {
    glDeleteBuffers(1, &block_buffer_);
    glDeleteSamplers(1, &sampler_nearest_);
    glDeleteSamplers(1, &sampler_linear_);
}

// The step's program; its block must be the one that the step has filled.
Result<gl::Program> Executor::program_of(const Plan& plan, const Step& step) {
    auto program = programs_.get(step.program);
    if (!program.ok() ||
        (program->block == step.block_type && program->block_bytes == step.block.size()))
        return program;
    const auto text = [](const std::string& type, size_t bytes) {
        return type.empty() ? std::string("no block") : concat(type, " of ", bytes, " bytes");
    };
    return Status(StatusCode::internal,
                  concat(plan.passes[size_t(step.pass)].type, ".", step.name, ": the step brings ",
                         text(step.block_type, step.block.size()), ", ", step.program.file, " has ",
                         text(program->block, program->block_bytes)));
}

Status Executor::dispatch(const Plan& plan, const Step& step, const std::vector<unsigned>& names) {
    auto program = program_of(plan, step);
    if (!program.ok()) return program.status();
    const gl::DebugGroup group(plan.passes[size_t(step.pass)].type + "." + step.name);
    glUseProgram(program->name);
    if (!step.block.empty()) {
        // A fresh store each time: the driver keeps the old one for dispatches in flight.
        glNamedBufferData(block_buffer_, GLsizeiptr(step.block.size()), step.block.data(),
                          GL_STREAM_DRAW);
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, block_buffer_);
    }
    GLbitfield barriers = kBarriers;
    for (const auto& binding : step.bindings) {
        const unsigned name = names[size_t(binding.texture)];
        const auto unit = GLuint(binding.unit);
        if (binding.access == Access::list) {
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, unit, name);
            barriers |= kListBarriers;
        } else if (binding.access == Access::write) {
            const auto format = plan.textures[size_t(binding.texture)].format;
            glBindImageTexture(unit, name, 0, GL_FALSE, 0, GL_WRITE_ONLY,
                               gl::internal_format(format));
        } else {
            glBindTextureUnit(unit, name);
            glBindSampler(
                unit, binding.access == Access::sample_linear ? sampler_linear_ : sampler_nearest_);
        }
    }
    if (step.work_list >= 0) {
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, names[size_t(step.work_list)]);
        glDispatchComputeIndirect(0);
    } else {
        glDispatchCompute(GLuint(step.groups[0]), GLuint(step.groups[1]), GLuint(step.groups[2]));
    }
    glMemoryBarrier(barriers);
    ++dispatches_;
    return Status();
}

Status Executor::execute(const Plan& plan, std::vector<gl::Texture*>& textures,
                         const std::map<Role, unsigned>& inputs, const StageObserver& observer) {
    std::vector<unsigned> names(plan.textures.size(), 0);
    for (size_t i = 0; i < plan.textures.size(); ++i) {
        const auto& texture = plan.textures[i];
        if (!texture.imported || texture.first_step < 0) continue;
        const auto found = inputs.find(texture.role);
        if (found == inputs.end())
            return Status(StatusCode::internal, texture.name + " was not handed in");
        names[i] = found->second;
    }
    timed_passes_.clear();
    work_done_.clear();
    std::vector<int> last_write(plan.textures.size(), -1);
    for (int i = 0; i < int(plan.steps.size()); ++i)
        for (const auto& binding : plan.steps[size_t(i)].bindings)
            if (binding.access == Access::write) last_write[size_t(binding.texture)] = i;
    if (timing_) clock_.begin();
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        const Step& step = plan.steps[size_t(i)];
        for (size_t t = 0; t < plan.textures.size(); ++t) {
            const auto& texture = plan.textures[t];
            if (texture.imported || texture.first_step != i) continue;
            auto acquired = pool_.acquire(texture.format, texture.width, texture.height);
            if (!acquired.ok()) return acquired.status().at(texture.name);
            textures[t] = *acquired;
            names[t] = textures[t]->name;
            gl::label(texture.format == Format::work_list ? GL_BUFFER : GL_TEXTURE, names[t],
                      texture.name);
        }
        if (Status status = dispatch(plan, step, names); !status.ok()) return status;
        if (observer) {
            for (const auto& binding : step.bindings) {
                if (last_write[size_t(binding.texture)] != i) continue;
                const auto& texture = plan.textures[size_t(binding.texture)];
                auto pixels = gl::download(names[size_t(binding.texture)], texture.format,
                                           texture.width, texture.height);
                if (!pixels.ok()) return pixels.status().at(texture.name);
                if (Status s = observer(step, texture, *pixels); !s.ok()) return s;
            }
        }
        for (size_t t = 0; t < plan.textures.size(); ++t) {
            const auto& texture = plan.textures[t];
            if (texture.imported || texture.last_step != i) continue;
            if (texture.format == Format::work_list) continue;  // small; filter() counts it
            pool_.release(textures[t]);
            textures[t] = nullptr;
        }
        const bool last_of_pass =
            i + 1 == int(plan.steps.size()) || plan.steps[size_t(i) + 1].pass != step.pass;
        if (timing_ && last_of_pass) {
            clock_.mark();
            timed_passes_.push_back({step.pass, plan.passes[size_t(step.pass)].type, 0});
        }
    }
    return Status();
}

Result<std::vector<unsigned>> Executor::run_textures(const Plan& plan,
                                                     const std::map<Role, unsigned>& inputs,
                                                     const StageObserver& observer) {
    for (gl::Texture* texture : held_) pool_.release(texture);
    held_.clear();
    std::vector<gl::Texture*> textures(plan.textures.size(), nullptr);
    Status status = execute(plan, textures, inputs, observer);
    std::vector<unsigned> names(textures.size(), 0);
    for (size_t t = 0; t < textures.size(); ++t) {
        if (!textures[t]) continue;
        names[t] = textures[t]->name;
        held_.push_back(textures[t]);
    }
    if (!status.ok()) return status;
    return names;
}

Result<std::map<Role, unsigned>> Executor::run(const Plan& plan,
                                               const std::map<Role, unsigned>& inputs,
                                               const StageObserver& observer) {
    const PoolFrame frame(pool_, options_.frames_kept);
    auto names = run_textures(plan, inputs, observer);
    if (!names.ok()) return names.status();
    std::map<Role, unsigned> outputs;
    for (const auto& [role, id] : plan.outputs) {
        if (plan.textures[size_t(id)].imported) {
            const auto found = inputs.find(role);
            if (found != inputs.end()) outputs[role] = found->second;
        } else if (const unsigned name = (*names)[size_t(id)]) {
            outputs[role] = name;
        }
    }
    return outputs;
}

Result<FramePlanes> Executor::filter(const Plan& plan, PlaneView inputs,
                                     const StageObserver& observer) {
    auto results = filter_outputs(plan, inputs, {plan.outputs}, observer);
    if (!results.ok()) return results.status();
    return std::move(results->front());
}

Result<std::array<FramePlanes, 2>> Executor::filter_both(const MergedPlan& merged,
                                                         PlaneView inputs) {
    auto results = filter_outputs(merged.plan, inputs, {merged.outputs[0], merged.outputs[1]}, {});
    if (!results.ok()) return results.status();
    return std::array<FramePlanes, 2>{std::move((*results)[0]), std::move((*results)[1])};
}

Result<std::vector<FramePlanes>> Executor::filter_outputs(const Plan& plan, const PlaneView& inputs,
                                                          const std::vector<Outputs>& outputs,
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
        } else if (auto made = pool_.acquire(texture.format, texture.width, texture.height);
                   !made.ok()) {
            status = made.status();
        } else {
            uploaded.push_back(*made);
            names[texture.role] = (*made)->name;
            status = gl::upload(**made, *plane);
        }
        if (!status.ok()) {
            release();
            return status.at(texture.name);
        }
    }
    auto made = run_textures(plan, names, observer);
    Status status = made.status();
    if (status.ok() && !plan.steps.empty()) status = gl::check_error("running the plan");
    std::vector<FramePlanes> results(outputs.size());
    for (size_t i = 0; i < outputs.size() && status.ok(); ++i) {
        for (const auto& [role, id] : outputs[i]) {
            const auto& texture = plan.textures[size_t(id)];
            if (texture.imported) {
                results[i][role] = inputs.at(texture.role);
                continue;
            }
            auto pixels =
                gl::download((*made)[size_t(id)], texture.format, texture.width, texture.height);
            status = pixels.status();
            if (!status.ok()) break;
            results[i][role] = std::move(*pixels);
        }
    }
    for (size_t t = 0; t < plan.textures.size() && status.ok(); ++t) {
        const auto& texture = plan.textures[t];
        if (texture.format == Format::work_list)
            work_done_.push_back(
                {texture.name, gl::count_work((*made)[t]), unsigned(texture.width)});
    }
    release();
    if (!status.ok()) return status;
    return results;
}

std::vector<PassTime> Executor::pass_times() const {
    if (timed_passes_.empty()) return {};
    const auto milliseconds = clock_.read_if_ready();
    if (!milliseconds) return {};
    std::vector<PassTime> times = timed_passes_;
    for (size_t i = 0; i < times.size() && i < milliseconds->size(); ++i)
        times[i].milliseconds = (*milliseconds)[i];
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

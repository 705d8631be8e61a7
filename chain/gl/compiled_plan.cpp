#include "chain/gl/compiled_plan.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "chain/gl/debug.h"
#include "chain/plan/hazards.h"

namespace postchain::gl {
namespace {

// After the last step: textures are fetched, read back, or taken by the next frame; lists are
// counted and emptied.
constexpr GLbitfield kLastBarriers = GL_TEXTURE_FETCH_BARRIER_BIT |
                                     GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                                     GL_TEXTURE_UPDATE_BARRIER_BIT;
constexpr GLbitfield kLastListBarriers =
    GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT;

GLbitfield barriers_for(uint32_t waits, Reads reads) {
    GLbitfield bits = 0;
    if (waits & kWaitFetch)
        bits |= reads == Reads::images ? GL_SHADER_IMAGE_ACCESS_BARRIER_BIT
                                       : GL_TEXTURE_FETCH_BARRIER_BIT;
    if (waits & kWaitImage) bits |= GL_SHADER_IMAGE_ACCESS_BARRIER_BIT;
    if (waits & kWaitList) bits |= GL_SHADER_STORAGE_BARRIER_BIT;
    if (waits & kWaitLaunch) bits |= GL_COMMAND_BARRIER_BIT;
    return bits;
}

Status check_units(const UsedUnits& used) {
    const auto check = [](int count, const char* what, GLenum limit, const char* name) {
        GLint most = 0;
        glGetIntegerv(limit, &most);
        if (count <= most) return Status();
        return Status(StatusCode::gl, concat("a step uses ", count, " ", what,
                                             "; this device's limit is ", most, " (", name, ")"));
    };
#define CHECK(count, what, limit) \
    if (Status s = check(count, what, limit, #limit); !s.ok()) return s
    CHECK(used.textures, "texture units", GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS);
    CHECK(used.images, "image units", GL_MAX_COMPUTE_IMAGE_UNIFORMS);
    CHECK(used.lists, "storage buffers", GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS);
#undef CHECK
    return Status();
}

}  // namespace

Result<CompiledPlan> CompiledPlan::make(Plan plan, TexturePool& pool, ProgramCache& programs,
                                        RunObjects& objects, bool labels,
                                        const std::optional<MaxFrameSize>& max_size, Reads reads) {
    CompiledPlan compiled(std::move(plan), pool, objects.alignment(), reads);
    RETURN_IF_ERROR(compiled.take_programs(programs));
    RETURN_IF_ERROR(compiled.take_textures(labels, max_size));
    RETURN_IF_ERROR(objects.reserve(compiled.bytes().size()));
    return compiled;
}

CompiledPlan::~CompiledPlan() {
    for (Texture* texture : textures_) --texture->plans;
}

Status CompiledPlan::take_textures(bool labels, const std::optional<MaxFrameSize>& max_size) {
    const size_t count = plan().textures.size();
    const StoragePlan shared = share_storage(plan(), max_size);
    names_.assign(count, 0);
    image_formats_.assign(count, 0);
    images_.assign(count, {});
    Status status;
    for (const Storage& storage : shared.all) {
        auto acquired = pool_->acquire(storage);
        status = acquired.status();
        if (!status.ok()) break;
        textures_.push_back(*acquired);
    }
    for (Texture* texture : textures_) {
        pool_->release(texture);
        ++texture->plans;
    }
    storage_ = shared.numbers();
    for (size_t t = 0; t < count; ++t) {
        const int place = shared.of[t];
        if (place < 0) continue;
        const PlanTexture& texture = plan().textures[t];
        if (size_t(place) >= textures_.size()) return status.at(texture.name);
        names_[t] = textures_[size_t(place)]->name;
        image_formats_[t] = internal_format(texture.format);
        const bool list = texture.format == Format::work_list;
        if (list) lists_.push_back(TextureId(t));
        if (labels) label(list ? GL_BUFFER : GL_TEXTURE, names_[t], texture.name);
    }
    find_barriers();
    return Status();
}

bool CompiledPlan::holds_unused(uint64_t frames) const {
    return std::any_of(textures_.begin(), textures_.end(),
                       [&](const Texture* texture) { return pool_->unused(*texture, frames); });
}

void CompiledPlan::find_barriers() {
    const std::vector<uint32_t> waits = waits_of(plan(), storage_);
    barriers_ = 0;
    for (size_t i = 0; i < waits.size(); ++i) {
        commands_[i].barriers = barriers_for(waits[i], reads_);
        barriers_ += waits[i] != 0;
    }
}

Status CompiledPlan::take_programs(ProgramCache& programs) {
    const auto text = [](const std::string& type, size_t bytes) {
        return type.empty() ? std::string("no block") : concat(type, " of ", bytes, " bytes");
    };
    std::vector<ProgramKey> keys;
    for (const Step& step : plan().steps) {
        keys.push_back(reads_ == Reads::images ? image_program(plan(), step) : step.program);
        programs.begin(keys.back());
    }
    for (size_t i = 0; i < keys.size(); ++i) {
        const Step& step = plan().steps[i];
        ASSIGN_OR_RETURN(auto program, programs.get(keys[i]));
        if (program.uniforms_type != step.uniforms_type ||
            program.uniforms_bytes >
                step.uniforms.size())  // less: the driver left out unread members
            return Status(
                StatusCode::internal,
                concat(plan().name_of(step), ": the step brings ",
                       text(step.uniforms_type, step.uniforms.size()), ", ", step.program.file,
                       " has ", text(program.uniforms_type, program.uniforms_bytes)));
        commands_.push_back({program.name, 0, program.in_bands});
        for (const auto& binding : step.bindings) {
            const bool image = binding.access == Access::read || binding.access == Access::write;
            int& most = binding.access == Access::list ? used_.lists
                        : image                        ? used_.images
                                                       : used_.textures;
            most = std::max(most, binding.unit + 1);
        }
        if (step.work_list >= 0) used_.lists = std::max(used_.lists, 1);
    }
    const int most_images = reads_ == Reads::images ? kFirstReadImage : kMaxUnits;
    if (std::max(used_.textures, used_.lists) > kMaxUnits || used_.images > most_images)
        return Status(StatusCode::internal,
                      concat("a step uses more than ", kMaxUnits, " texture units or lists, or ",
                             most_images, " image units"));
    return check_units(used_);
}

void CompiledPlan::import(TextureId texture, unsigned name, unsigned image_format, ImageOf image) {
    names_[size_t(texture)] = name;
    image_formats_[size_t(texture)] = image_format;
    images_[size_t(texture)] = image;
}

void CompiledPlan::bind(size_t index, const RunObjects& objects, size_t offset) {
    const Step& step = plan().steps[index];
    const Command& command = commands_[index];
    glUseProgram(command.program);
    if (step.layers > 0) glUniform1i(kFirstLayer, step.first_layer);
    if (const Block& uniforms = block(index); uniforms.bytes > 0)
        glBindBufferRange(GL_UNIFORM_BUFFER, 0, objects.buffer(),
                          GLintptr(offset + uniforms.offset), GLsizeiptr(uniforms.bytes));
    for (const auto& binding : step.bindings) {
        const unsigned name = names_[size_t(binding.texture)];
        const auto unit = GLuint(binding.unit);
        switch (binding.access) {
            case Access::list:
                glBindBufferBase(GL_SHADER_STORAGE_BUFFER, unit, name);
                break;
            case Access::read:
            case Access::write: {
                const ImageOf image = images_[size_t(binding.texture)];
                glBindImageTexture(unit, name, image.level,
                                   plan().textures[size_t(binding.texture)].slices > 0, image.slice,
                                   binding.access == Access::read ? GL_READ_ONLY : GL_WRITE_ONLY,
                                   image_formats_[size_t(binding.texture)]);
                break;
            }
            case Access::sample_nearest:
                if (reads_ == Reads::images) {
                    const PlanTexture& texture = plan().textures[size_t(binding.texture)];
                    glBindImageTexture(kFirstReadImage + unit, name, 0, texture.slices > 0, 0,
                                       GL_READ_ONLY, internal_format(texture.format));
                    break;
                }
                glBindTextureUnit(unit, name);
                glBindSampler(unit, objects.sampler());
                break;
        }
    }
    if (command.barriers) glMemoryBarrier(command.barriers);
}

void CompiledPlan::dispatch_whole(const Step& step, unsigned columns, unsigned rows) const {
    if (step.work_list >= 0) {
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, names_[size_t(step.work_list)]);
        glDispatchComputeIndirect(0);
    } else {
        glDispatchCompute(columns, rows, GLuint(step.groups[2]));
    }
}

void CompiledPlan::dispatch_band(const Step& step, const Band& band) const {
    if (band.first != Band{}.first) glUniform2ui(kFirstGroup, band.first[0], band.first[1]);
    glDispatchCompute(band.count[0], band.count[1], GLuint(step.groups[2]));
    if (band.first != Band{}.first) glUniform2ui(kFirstGroup, 0, 0);
}

// If the length of a list is not known, the bands cover every block that it can have, and work
// groups beyond its end return at once.
Status CompiledPlan::dispatch(const Step& step, const Command& command,
                              const RunOptions& options) const {
    if (options.queue) return dispatch_queued(step, command, *options.queue);
    const bool list = step.work_list >= 0;
    const auto columns =
        unsigned(list ? plan().textures[size_t(step.work_list)].width : step.groups[0]);
    const unsigned rows = list ? 1 : unsigned(step.groups[1]);
    const double of_group = taps_of_group(step), taps = of_group * columns * rows;
    BandTimer* const timer = options.timer;
    const bool measured = timer && command.in_bands && taps > kBandTaps && timer->may_measure();
    BandTimer::Span span;
    if (measured) span = timer->begin();
    const double rate = timer ? timer->rates.of(command.program) : kUnknownRate;
    const double groups = groups_of_band(columns, rows, of_group / rate);
    if (!command.in_bands || groups >= double(columns) * rows)
        dispatch_whole(step, columns, rows);
    else
        for (Bands bands(columns, rows); bands.more();) dispatch_band(step, bands.next(groups));
    if (measured) {
        timer->end(span);
        timer->measure(span, command.program, taps, list ? kMostListRate : BandRates::kNoLimit);
    }
    return Status();
}

Status CompiledPlan::dispatch_queued(const Step& step, const Command& command,
                                     BandQueue& queue) const {
    const bool list = step.work_list >= 0, counted = list && queue.reads_counts();
    auto columns = unsigned(step.groups[0]), rows = unsigned(step.groups[1]);
    if (list) {
        columns = unsigned(plan().textures[size_t(step.work_list)].width);
        rows = 1;
    }
    const double taps = taps_of_group(step);
    queue.begin_dispatch(command.program, taps,
                         list && !counted ? kMostListRate : BandRates::kNoLimit);
    if (!command.in_bands || (list && !counted && columns * taps <= kBandMs * queue.rate())) {
        RETURN_IF_ERROR(queue.band_begins());
        dispatch_whole(step, columns, rows);
        queue.band_ends(list ? 0 : columns * rows);
        return Status();
    }
    if (counted) {
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        columns = count_work(names_[size_t(step.work_list)]);
    }
    for (Bands bands(columns, rows); bands.more();) {
        const Band band = bands.next(queue.groups());
        RETURN_IF_ERROR(queue.band_begins());
        dispatch_band(step, band);
        queue.band_ends(band.groups());
    }
    return Status();
}

void CompiledPlan::warm_up(RunObjects& objects, int step) {
    for (Texture* texture : textures_)
        if (!texture->filled) clear(*texture);
    const size_t offset = objects.upload(bytes());
    for (const TextureId list : lists_) empty_list(names_[size_t(list)]);
    glMemoryBarrier(kLastListBarriers);
    bind(size_t(step), objects, offset);
    glDispatchCompute(1, 1, GLuint(plan().steps[size_t(step)].groups[2]));
    glMemoryBarrier(kLastBarriers | kLastListBarriers);
}

Status CompiledPlan::run(RunObjects& objects, const RunOptions& options) {
    if (commands_.empty()) return Status();
    if (share_imports(plan(), names_, storage_)) find_barriers();
    for (Texture* texture : textures_) {
        pool_->touch(texture);
        texture->filled = true;
    }
    if (options.timer) options.timer->take();
    const size_t offset = objects.upload(bytes());
    for (const TextureId list : lists_) empty_list(names_[size_t(list)]);
    Status status;
    for (size_t i = 0; i < commands_.size() && status.ok(); ++i) {
        const Step& step = plan().steps[i];
        {
            std::optional<DebugGroup> group;
            if (options.labels) group.emplace(plan().name_of(step));
            bind(i, objects, offset);
            status = dispatch(step, commands_[i], options);
            if (options.clock && options.queue)
                options.clock->leave_out(options.queue->take_waited_ms());
        }
        if (options.after_step && status.ok()) {
            glMemoryBarrier(kLastBarriers | kLastListBarriers);
            status = (*options.after_step)(int(i));
        }
        const bool last_of_pass =
            i + 1 == commands_.size() || plan().steps[i + 1].pass != step.pass;
        if (options.clock && (last_of_pass || options.time_steps)) {
            const std::string& pass = plan().passes[size_t(step.pass)].type;
            options.clock->mark(step.pass, pass,
                                options.time_steps ? std::string_view(step.name) : "");
        }
    }
    glMemoryBarrier(kLastBarriers | (lists_.empty() ? 0 : kLastListBarriers) | options.barriers);
    return status;
}

}  // namespace postchain::gl

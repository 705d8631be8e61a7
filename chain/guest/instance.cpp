#include "chain/guest/instance.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "chain/gl/debug.h"
#include "chain/guest/frame_check.h"
#include "chain/guest/host_struct.h"
#include "chain/guest/validate.h"

namespace postchain::guest {
namespace {

// Does the host's loader lead to the GL of the current context?
Failure check_loader(const pc_create_info& info) {
    using GetString = const unsigned char* (*)(GLenum);
    if (!info.get_proc_address) return {};
    for (const char* name : {"glGetString", "glDispatchComputeIndirect", "glBindTextureUnit"})
        if (!info.get_proc_address(info.user, name))
            return {PC_ERROR_CONTEXT, concat("get_proc_address knows no ", name)};
    const auto get_string =
        reinterpret_cast<GetString>(info.get_proc_address(info.user, "glGetString"));
    for (const GLenum what : {GL_VERSION, GL_RENDERER}) {
        const auto* theirs = reinterpret_cast<const char*>(get_string(what));
        const auto* ours = reinterpret_cast<const char*>(glGetString(what));
        if (!theirs || !ours || std::strcmp(theirs, ours) != 0)
            return {PC_ERROR_CONTEXT,
                    concat("get_proc_address leads to \"", theirs ? theirs : "nothing",
                           "\", the current context is \"", ours ? ours : "none", "\"")};
    }
    return {};
}

// host_programs(), and that of the focus.
std::vector<ProgramKey> all_programs(const Chain& chain, const HostFrame& frame, const Plan& plan,
                                     DeviceClass device) {
    std::vector<ProgramKey> all = host_programs(chain, frame, plan, device);
    if (frame.focus && frame.depth.name) all.push_back(focus_program(frame));
    return all;
}

}  // namespace

Failure Instance::create(const pc_create_info& info, std::unique_ptr<Instance>& instance) {
    std::unique_ptr<Instance> made(new Instance(info));
    RETURN_IF_ERROR(made->open());
    instance = std::move(made);
    return {};
}

Failure Instance::open() {
    const bool own = (info_.flags & PC_OWN_CONTEXT) != 0;
    RETURN_IF_ERROR(check_epoxy());
    context_ = ContextId::current();
    if (own && context_)
        return {
            PC_ERROR_CONTEXT,
            "PC_OWN_CONTEXT: a context is current on this thread; leave the flag out to use it"};
    if (own) {
        auto made = egl::Context::create();
        if (!made.ok()) return {PC_ERROR_CONTEXT, made.status().message()};
        own_context_ = std::move(*made);
        context_ = ContextId::current();
    }
    if (!context_)
        return {PC_ERROR_CONTEXT,
                "no GL context is current on this thread; make the host's current"};
    RETURN_IF_ERROR(check_version());
    RETURN_IF_ERROR(check_loader(info_));
    device_ =
        gl::describe_current([this](const std::string& message) { log(PC_LOG_WARNING, message); });
    gl_version_ = uint32_t(epoxy_gl_version());
    GLint strategy = 0;
    glGetIntegerv(GL_RESET_NOTIFICATION_STRATEGY, &strategy);
    tells_loss_ = strategy == GL_LOSE_CONTEXT_ON_RESET;
    plans_.set_device(device_.device_class());
    objects_ = std::make_unique<Objects>(device_);
    objects_->pool.set_budget(info_.texture_budget);
    if (info_.load_program || info_.store_program)
        objects_->programs.use_binaries(
            store_of(info_), concat(device_.vendor, "\n", device_.renderer, "\n", device_.version));
    const auto limit = uint32_t(device_.limits.texture_px);
    if ((info_.max_width == 0) != (info_.max_height == 0) || info_.max_width > limit ||
        info_.max_height > limit)
        return {PC_ERROR_ARGUMENT,
                concat("max_width, max_height: ", info_.max_width, "x", info_.max_height,
                       "; give both or neither, up to ", limit)};
    if (info_.keep_frames) plans_.set_kept_frames(info_.keep_frames);
    max_sizes_ = MaxFrameSizes({int(info_.max_width), int(info_.max_height)}, plans_.kept_frames());
    return {};
}

Instance::~Instance() {
    if (!objects_) return;
    if (lost_ || !context_.is_current()) abandon();
    if (!objects_) return;
    plans_.forget_all();  // before the pool that their textures are of
    // A program that the last step left in use would be one that is deleted and current.
    const auto deleted = [] {
        GLint program = 0, status = GL_FALSE;
        glGetIntegerv(GL_CURRENT_PROGRAM, &program);
        if (program) glGetProgramiv(GLuint(program), GL_DELETE_STATUS, &status);
        return status == GL_TRUE;
    };
    const bool before = deleted();
    objects_.reset();
    if (!before && deleted()) glUseProgram(0);
}

void Instance::abandon() {
    if (!objects_) return;
    plans_.forget_all();
    objects_->pool.abandon();
    objects_->programs.abandon();
    objects_->focus.abandon();
    objects_->run.abandon();
    objects_->clock.abandon();
    objects_->timer.abandon();
    objects_.reset();
}

Failure Instance::check_context() {
    if (lost_) return {PC_ERROR_CONTEXT, "the context is lost: pc_abandon(), and begin anew"};
    if (!context_.is_current())
        return {PC_ERROR_CONTEXT,
                "the context that this instance was made in is not current on this thread"};
    if (tells_loss_ && glGetGraphicsResetStatus() != GL_NO_ERROR) {
        lost_ = true;
        return {PC_ERROR_CONTEXT, "the context was lost by a reset of the device"};
    }
    return {};
}

Failure Instance::check_size(const HostFrame& frame) const {
    const int limit = device_.limits.texture_px;
    if (frame.width <= limit && frame.height <= limit) return {};
    return {PC_ERROR_INPUT, concat("the frame is ", frame.width, "x", frame.height,
                                   "; this device's limit is ", limit, " a side")};
}

Failure Instance::check(const ChainVersion& chain, const pc_frame& given, HostFrame& frame) {
    RETURN_IF_ERROR(check_frame(&given, frame));
    RETURN_IF_ERROR(check_size(frame));
    RETURN_IF_ERROR(check_context());
    focused_.clear();
    RETURN_IF_ERROR(find_places(*chain.chain, focused_));
    if (!focused_.empty()) frame.focus = &objects_->focus.now(chain.id, focused_);
    return {};
}

template <class Work>
auto Instance::keep_state(const gl::UsedUnits& used, bool arrays, const Work& work) {
    if (info_.state == PC_STATE_RESTORE) state_.save(used, arrays);
    auto result = work();
    if (info_.state == PC_STATE_RESTORE) state_.restore();
    if (info_.state == PC_STATE_RESET) GlState::reset(used);
    return result;
}

// Precondition: its program is compiled.
Failure Instance::ready_focus(const HostFrame& frame) {
    return keep_state(Focus::kUsed, frame.arrays() != 0, [&] {
        return objects_->focus.prepare(frame, objects_->pool, objects_->programs, objects_->run);
    });
}

Failure Instance::follow_focus(const ChainVersion& chain, HostFrame& frame) {
    if (!frame.focus || frame.depth.name == 0) return {};
    if (!objects_->programs.has(focus_program(frame))) return plans_.not_prepared(chain, frame);
    RETURN_IF_ERROR(ready_focus(frame));
    ++plans_.dispatches;
    return keep_state(Focus::kUsed, frame.arrays() != 0, [&] {
        return objects_->focus.follow(chain.id, focused_, frame, objects_->run);
    });
}

std::vector<ProgramKey> Instance::programs_to_prepare(const ChainVersion& chain,
                                                      const HostFrame& frame,
                                                      const Plan& plan) const {
    std::vector<ProgramKey> programs = all_programs(*chain.chain, frame, plan, plans_.device());
    for (const Chain& variant : budgets_.variants(chain))
        for (ProgramKey& program : host_programs(variant, frame, plan, plans_.device()))
            if (std::ranges::find(programs, program) == programs.end())
                programs.push_back(std::move(program));
    return programs;
}

Failure Instance::prepare(const ChainVersion& host_chain, const pc_frame& given, bool wait) {
    const ChainVersion chain = budgets_.version(host_chain);
    const pc_frame first = with_neighbors_in_use(given);
    HostFrame frame;
    RETURN_IF_ERROR(check(chain, first, frame));
    const size_t before = objects_->programs.compiled();
    const auto list = [&](const Plan& plan) {
        max_sizes_.restore(chain.id);
        return programs_to_prepare(host_chain, frame, plan);
    };
    RETURN_IF_ERROR(plans_.compile_programs(chain, frame, wait, list));
    if (!wait && objects_->programs.compiled() > before) return {PC_PENDING, ""};
    if (frame.focus && frame.depth.name) RETURN_IF_ERROR(ready_focus(frame));
    objects_->pool.begin_frame();
    Entry* entry = nullptr;
    const auto other = plans_.other_cut(frame);
    if (other && find_or_make(chain, other->frame, entry).ok() &&
        !warm_up(*entry, other->frame, wait))
        return {PC_PENDING, ""};
    RETURN_IF_ERROR(find_or_make(chain, frame, entry));
    return warm_up(*entry, frame, wait) ? Failure() : Failure(PC_PENDING, "");
}

// The output is a texture of one texel: stores beside it are ignored.
bool Instance::warm_up(Entry& entry, const HostFrame& frame, bool wait) {
    std::vector<int> cold;
    for (int i = 0; i < int(entry.compiled->plan().steps.size()); ++i)
        if ((wait || cold.empty()) && !objects_->warm.contains(entry.compiled->program_of(i)))
            cold.push_back(i);
    if (cold.empty()) return true;
    HostFrame aside = frame;
    if (entry.host.writes_output) {
        aside.output.image = {};
        glCreateTextures(GL_TEXTURE_2D, 1, &aside.output.name);
        glTextureStorage2D(aside.output.name, 1, frame.output.format->name, 1, 1);
    }
    import_frame(entry.host, aside, *entry.compiled);
    wait = keep_state(entry.compiled->used(), entry.host.samples_arrays, [&] {
        for (const int step : cold) {
            entry.compiled->warm_up(objects_->run, step);
            objects_->warm.insert(entry.compiled->program_of(step));
        }
        return wait;
    });
    if (entry.host.writes_output) glDeleteTextures(1, &aside.output.name);
    return wait;
}

Failure Instance::find_or_make(const ChainVersion& chain, const HostFrame& frame, Entry*& entry) {
    const bool runs =
        std::exchange(newest_frame_, plans_.frames) != plans_.frames;  // not pc_prepare()
    const MaxFrameSize max_size = max_sizes_.size_for(chain.id, frame, runs),
                       tight = {frame.plane_width(), frame.plane_height()};
    Failure failure = plans_.find_or_make(chain, frame, max_size, entry);
    if (failure.result != PC_ERROR_MEMORY) return failure;
    // Once more without what other plans hold, unless they run in turn with this one.
    const bool in_turn = runs && forgot_ > 0 && plans_.frames <= forgot_ + plans_.kept_frames();
    if (runs) forgot_ = plans_.frames;
    forget_all();
    if (!in_turn) {
        failure = plans_.find_or_make(chain, frame, max_size, entry);
        if (failure.result != PC_ERROR_MEMORY) return failure;
        forget_all();
    }
    if (max_size != tight || in_turn) {
        failure = plans_.find_or_make(chain, frame, tight, entry);
        if (failure.result == PC_ERROR_MEMORY) forget_all();
    }
    max_sizes_.fall_back(chain.id, tight, failure.ok());
    return failure;
}

void Instance::forget_all() {
    plans_.forget_all();
    objects_->pool.begin_frame();
    objects_->pool.trim(0);
}

Result<std::unique_ptr<gl::CompiledPlan>> Instance::compile(Plan plan,
                                                            const MaxFrameSize& max_size) {
    ASSIGN_OR_RETURN(auto compiled, gl::CompiledPlan::make(
                                        std::move(plan), objects_->pool, objects_->programs,
                                        objects_->run, (info_.flags & PC_LABELS) != 0, max_size));
    return std::make_unique<gl::CompiledPlan>(std::move(compiled));
}

Failure Instance::dispatch(Entry& entry, const HostFrame& frame, bool timed) {
    gl::RunOptions options;
    options.labels = (info_.flags & PC_LABELS) != 0;
    options.barriers = frame.given->barriers;
    options.timer = &objects_->timer;
    if (timing_ > 0 || timed) {
        objects_->clock.begin(frame.given->frame_number, plans_.frames);
        options.clock = &objects_->clock;
        options.time_steps = timing_ > 1;
    }
    return keep_state(entry.compiled->used(), entry.host.samples_arrays,
                      [&] { return entry.compiled->run(objects_->run, options); });
}

Failure Instance::needs_of(const ChainVersion& host_chain, const pc_frame& given,
                           pc_frame_needs& out) {
    const ChainVersion version = budgets_.version(host_chain);
    const Chain& chain = *version.chain;
    HostFrame frame;
    RETURN_IF_ERROR(check_frame(&given, frame));
    RETURN_IF_ERROR(check_size(frame));
    Depths focused;
    RETURN_IF_ERROR(find_places(chain, focused));
    if (!focused.empty()) frame.focus = &focused;
    ASSIGN_OR_RETURN(auto host, make_host_plan(chain, frame, plans_.device()));
    plans_.count_needs(host.plan, max_sizes_.expected(frame),
                       programs_to_prepare(host_chain, frame, host.plan), out);
    return {};
}

Failure Instance::run(const ChainVersion& host_chain, const pc_frame& given, pc_texture& result) {
    ChainVersion chain = budgets_.version(host_chain);
    HostFrame frame;
    RETURN_IF_ERROR(check(chain, given, frame));
    const bool validates = (info_.flags & PC_VALIDATE) != 0;
    if (validates) {
        if (Status left = gl::check_error("the host left an error"); !left.ok())
            log(PC_LOG_WARNING, left.message());
        RETURN_IF_ERROR(check_deeper(frame));
        RETURN_IF_ERROR(validate(frame));
    }
    RETURN_IF_ERROR(follow_focus(chain, frame));
    ++plans_.frames;
    const bool timed = budgets_.govern(host_chain, objects_->clock, plans_.frames);
    chain = budgets_.version(host_chain);
    objects_->pool.begin_frame();
    Entry* entry = nullptr;
    Failure failure = find_or_make(chain, frame, entry);
    if (failure.result == PC_ERROR_PREPARE && budgets_.undo(host_chain)) {
        log(PC_LOG_WARNING,
            "the budget is not kept, because other samples are other programs here: "
            "call pc_prepare() after pc_set_budget()");
        chain = budgets_.version(host_chain);
        failure = find_or_make(chain, frame, entry);
    }
    if (!failure.ok()) return failure;
    plans_.run(*entry, chain, frame);
    const Plan& plan = entry->compiled->plan();
    if (!plan.steps.empty()) {
        import_frame(entry->host, frame, *entry->compiled);
        failure = dispatch(*entry, frame, timed);
        if (!failure.ok()) return failure;
    }
    const TextureId id = entry->host.result;
    if (entry->host.writes_output) {
        result = given.output;
    } else if (id >= 0) {
        result = {};
        result.name = entry->compiled->name_of(id);
        result.internal_format = gl::internal_format(plan.textures[size_t(id)].format);
        result.width = entry->key.max_size.width;
        result.height = entry->key.max_size.height;
    }
    plans_.forget_unused();
    objects_->pool.trim(plans_.kept_frames());
    if (!validates) return {};
    return gl::check_error("pc_run()");
}

void Instance::capabilities(pc_capabilities& out) const {
    out.api_version = PC_API_VERSION;
    out.software = device_.software;
    out.max_texture_px = uint32_t(device_.limits.texture_px);
    out.gl_version = gl_version_;
    std::strncpy(out.renderer, device_.renderer.c_str(), sizeof(out.renderer) - 1);
    std::strncpy(out.version, POSTCHAIN_VERSION, sizeof(out.version) - 1);
}

}  // namespace postchain::guest

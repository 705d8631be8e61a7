#include "chain/guest/postchain.h"

#include "chain/guest/frame_check.h"
#include "chain/guest/handles.h"
#include "chain/guest/host_struct.h"
#include "chain/guest/instance.h"
#include "chain/guest/validate.h"

using postchain::concat;
using postchain::guest::ChainVersion;
using postchain::guest::change_struct;
using postchain::guest::check_version;
using postchain::guest::copy_text;
using postchain::guest::copy_times;
using postchain::guest::create;
using postchain::guest::Failure;
using postchain::guest::FrameCopy;
using postchain::guest::guarded;
using postchain::guest::Instance;
using postchain::guest::look;
using postchain::guest::read_frame;
using postchain::guest::read_struct;
using postchain::guest::Use;
using postchain::guest::version_of;

struct pc_instance {
    std::unique_ptr<Instance> is;
};

namespace {

template <class Work>
pc_result call(pc_instance* instance, const Work& work) {
    return look(instance, "instance", [&] {
        Failure failure = guarded(work);
        instance->is->error = failure.text;
        if (failure.result < 0) instance->is->log(PC_LOG_ERROR, failure.text);
        return failure;
    });
}

// A call with a chain and a struct of the host, such as a frame.
template <class Struct, class Work>
pc_result call(pc_instance* instance, pc_chain* chain, const Struct* given, const char* name,
               const Work& work) {
    return call(instance, [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        Struct copy;
        const Struct* whole = nullptr;
        RETURN_IF_ERROR(read_struct(given, name, copy, whole));
        return work(*instance->is, version_of(chain), *whole);
    });
}

// A call with a chain and a frame.
template <class Work>
pc_result call(pc_instance* instance, pc_chain* chain, const pc_frame* frame, const Work& work) {
    return call(instance, [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        FrameCopy copy;
        const pc_frame* whole = nullptr;
        RETURN_IF_ERROR(read_frame(frame, copy, whole));
        return work(*instance->is, version_of(chain), *whole);
    });
}

}  // namespace

extern "C" {

pc_result pc_create(const pc_create_info* given, pc_instance** instance) {
    return create([&]() -> Failure {
        if (!instance) return {PC_ERROR_ARGUMENT, "instance is NULL"};
        *instance = nullptr;
        pc_create_info copy;
        const pc_create_info* info = nullptr;
        RETURN_IF_ERROR(read_struct(given, "pc_create_info", copy, info));
        RETURN_IF_ERROR(check_version(info->api_version));
        if (info->state > PC_STATE_LEAVE)
            return {PC_ERROR_ARGUMENT, concat("state: ", info->state, " is not a PC_STATE value")};
        if (info->flags > (2 * PC_OWN_CONTEXT - 1))
            return {PC_ERROR_VERSION, concat("pc_create_info.flags: ", info->flags,
                                             " has a bit that this library does not know")};
        if (info->reserved != 0) return {PC_ERROR_VERSION, "pc_create_info.reserved is not 0"};
        auto made = std::make_unique<pc_instance>();
        RETURN_IF_ERROR(Instance::create(*info, made->is));
        Use::begin_life(made.get(), "instance");
        *instance = made.release();
        return {};
    });
}

void pc_destroy(pc_instance* instance) {
    if (Use::end_life(instance, "instance")) delete instance;
}

void pc_abandon(pc_instance* instance) {
    if (!Use::end_life(instance, "instance")) return;
    instance->is->abandon();
    delete instance;
}

const char* pc_last_error(const pc_instance* instance) {
    return Use::is_alive(instance, "instance") ? instance->is->error.c_str() : "no such instance";
}

pc_result pc_query(const pc_instance* instance, pc_capabilities* out) {
    return look(instance, "instance", [&] {
        return change_struct(out, "pc_capabilities", [&](pc_capabilities& whole) {
            instance->is->capabilities(whole);
            return Failure();
        });
    });
}

pc_result pc_prepare(pc_instance* instance, pc_chain* chain, const pc_frame* frame, int wait) {
    return call(instance, chain, frame,
                [&](Instance& is, const ChainVersion& of, const pc_frame& whole) {
                    return is.prepare(of, &whole, wait != 0);
                });
}

pc_result pc_query_frame(pc_instance* instance, pc_chain* chain, const pc_frame* frame,
                         pc_frame_needs* needs) {
    return call(
        instance, chain, frame, [&](Instance& is, const ChainVersion& of, const pc_frame& whole) {
            return change_struct(needs, "pc_frame_needs",
                                 [&](pc_frame_needs& out) { return is.needs_of(of, &whole, out); });
        });
}

pc_result pc_run(pc_instance* instance, pc_chain* chain, const pc_frame* frame,
                 pc_texture* result) {
    FrameCopy copy;
    const pc_frame* whole = nullptr;
    const Failure read = guarded([&] { return read_frame(frame, copy, whole); });
    const pc_texture color = whole ? whole->color : pc_texture();
    pc_texture picture = color;
    const pc_result code = call(instance, [&]() -> Failure {
        if (!read.ok()) return read;
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        return instance->is->run(version_of(chain), whole, picture);
    });
    if (result) *result = code < 0 ? color : picture;
    return code;
}

pc_result pc_set_timing(pc_instance* instance, int level) {
    return call(instance, [&]() -> Failure {
        if (level < 0 || level > 2)
            return {PC_ERROR_ARGUMENT, concat("level: ", level, " is not 0, 1 or 2")};
        instance->is->set_timing(level);
        return {};
    });
}

pc_result pc_timings(pc_instance* instance, pc_time* times, uint32_t* count,
                     uint64_t* frame_number) {
    return call(instance, [&]() -> Failure {
        RETURN_IF_ERROR(instance->is->check_context());
        return copy_times(instance->is->newest_times(), times, count, frame_number);
    });
}

pc_result pc_set_budget(pc_instance* instance, pc_chain* chain, const pc_budget* budget) {
    return call(instance, chain, budget, "pc_budget",
                [&](Instance& is, const ChainVersion& of, const pc_budget& whole) {
                    return is.set_budget(of, whole);
                });
}

pc_result pc_query_budget(const pc_instance* instance, const pc_chain* chain,
                          pc_budget_state* state) {
    return look(instance, "instance", [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        const ChainVersion version = version_of(chain);
        return change_struct(state, "pc_budget_state", [&](pc_budget_state& whole) {
            instance->is->budget(version, whole);
            return Failure();
        });
    });
}

pc_result pc_count(const pc_instance* instance, pc_counters* counters) {
    return look(instance, "instance", [&] {
        return change_struct(counters, "pc_counters", [&](pc_counters& whole) {
            instance->is->count(whole);
            return Failure();
        });
    });
}

pc_result pc_explain(const pc_instance* instance, char* text, size_t* size) {
    return look(instance, "instance",
                [&] { return copy_text(instance->is->explain(), text, size); });
}

pc_result pc_check_motion(pc_instance* instance, const pc_frame* frame,
                          const pc_texture* other_color, int signs[2], float* margin) {
    return call(instance, [&]() -> Failure {
        if (!other_color || !signs || !margin)
            return {PC_ERROR_ARGUMENT, "other_color, signs or margin is NULL"};
        RETURN_IF_ERROR(instance->is->check_context());
        FrameCopy copy;
        const pc_frame* whole = nullptr;
        RETURN_IF_ERROR(read_frame(frame, copy, whole));
        return postchain::guest::check_motion(whole, *other_color, signs, *margin);
    });
}

}  // extern "C"

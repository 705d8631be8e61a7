#include "chain/guest/postchain.h"

#include "chain/guest/instance.h"
#include "chain/guest/instance_calls.h"
#include "chain/guest/validate.h"

namespace guest = postchain::guest;
using postchain::concat;
using postchain::guest::ChainVersion;
using postchain::guest::change_struct;
using postchain::guest::Failure;
using postchain::guest::FrameCopy;
using postchain::guest::Instance;
using postchain::guest::kKind;
using postchain::guest::read_frame;
using postchain::guest::Use;
using postchain::guest::version_of;

struct pc_instance {
    std::unique_ptr<Instance> is;
};

template <>
inline constexpr const char* postchain::guest::kKind<pc_instance> = "instance";
template <>
inline constexpr const char* postchain::guest::kName<pc_budget> = "pc_budget";

extern "C" {

pc_result pc_create(const pc_create_info* given, pc_instance** instance) {
    const auto check = [](const pc_create_info& info) -> Failure {
        if (info.state > PC_STATE_LEAVE)
            return {PC_ERROR_ARGUMENT, concat("state: ", info.state, " is not a PC_STATE value")};
        if (info.flags > (2 * PC_OWN_CONTEXT - 1))
            return {PC_ERROR_VERSION, concat("pc_create_info.flags: ", info.flags,
                                             " has a bit that this library does not know")};
        if (info.reserved != 0) return {PC_ERROR_VERSION, "pc_create_info.reserved is not 0"};
        return {};
    };
    return guest::create_handle(given, "pc_create_info", instance, check, Instance::create);
}

void pc_destroy(pc_instance* instance) {
    guest::destroy(instance);
}

void pc_abandon(pc_instance* instance) {
    if (!Use::end_life(instance, kKind<pc_instance>)) return;
    instance->is->abandon();
    delete instance;
}

const char* pc_last_error(const pc_instance* instance) {
    return guest::last_error(instance);
}

pc_result pc_query(const pc_instance* instance, pc_capabilities* out) {
    return guest::look(instance, kKind<pc_instance>, [&] {
        return change_struct(out, "pc_capabilities", [&](pc_capabilities& whole) {
            instance->is->capabilities(whole);
            return Failure();
        });
    });
}

pc_result pc_prepare(pc_instance* instance, pc_chain* chain, const pc_frame* frame, int wait) {
    return guest::prepare(instance, chain, frame, wait != 0);
}

pc_result pc_query_frame(pc_instance* instance, pc_chain* chain, const pc_frame* frame,
                         pc_frame_needs* needs) {
    return guest::query_frame(instance, chain, frame, needs);
}

pc_result pc_run(pc_instance* instance, pc_chain* chain, const pc_frame* frame,
                 pc_texture* result) {
    FrameCopy copy;
    const pc_frame* whole = nullptr;
    const Failure read = guest::guarded([&] { return read_frame(frame, copy, whole); });
    const pc_texture color = whole ? whole->color : pc_texture();
    pc_texture picture = color;
    const pc_result code = guest::call(instance, [&]() -> Failure {
        if (!read.ok()) return read;
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        return instance->is->run(version_of(chain), *whole, picture);
    });
    if (result) *result = code < 0 ? color : picture;
    return code;
}

pc_result pc_set_timing(pc_instance* instance, int level) {
    return guest::set_timing(instance, level);
}

pc_result pc_timings(pc_instance* instance, pc_time* times, uint32_t* count,
                     uint64_t* frame_number) {
    return guest::timings(instance, times, count, frame_number);
}

pc_result pc_set_budget(pc_instance* instance, pc_chain* chain, const pc_budget* budget) {
    return guest::call(instance, chain, budget,
                       [&](const ChainVersion& of, const pc_budget& whole) {
                           return instance->is->set_budget(of, whole);
                       });
}

pc_result pc_query_budget(const pc_instance* instance, const pc_chain* chain,
                          pc_budget_state* state) {
    return guest::look(instance, kKind<pc_instance>, [&]() -> Failure {
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
    return guest::count(instance, counters);
}

pc_result pc_explain(const pc_instance* instance, char* text, size_t* size) {
    return guest::explain(instance, text, size);
}

pc_result pc_check_motion(pc_instance* instance, const pc_frame* frame,
                          const pc_texture* other_color, int signs[2], float* margin) {
    return guest::call(instance, [&]() -> Failure {
        if (!other_color || !signs || !margin)
            return {PC_ERROR_ARGUMENT, "other_color, signs or margin is NULL"};
        RETURN_IF_ERROR(instance->is->check_context());
        FrameCopy copy;
        const pc_frame* whole = nullptr;
        RETURN_IF_ERROR(read_frame(frame, copy, whole));
        return guest::check_motion(whole, *other_color, signs, *margin);
    });
}

}  // extern "C"

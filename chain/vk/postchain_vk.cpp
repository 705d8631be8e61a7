#include "chain/vk/postchain_vk.h"

#include "chain/guest/instance_calls.h"
#include "chain/vk/instance.h"

namespace guest = postchain::guest;
using postchain::concat;
using postchain::guest::ChainVersion;
using postchain::guest::change_struct;
using postchain::guest::Failure;
using postchain::vk::Instance;

struct pc_vk_instance {
    std::unique_ptr<Instance> is;
};

namespace postchain::guest {

template <>
inline constexpr size_t kMinSize<pc_vk_create_info> = offsetof(pc_vk_create_info, queue_family);
template <>
inline constexpr size_t kMinSize<pc_vk_steps> = sizeof(pc_vk_steps);
template <>
inline constexpr const char* kKind<pc_vk_instance> = "Vulkan instance";
template <>
inline constexpr const char* kName<pc_vk_frame> = "pc_vk_frame";

}  // namespace postchain::guest

extern "C" {

pc_result pc_vk_create(const pc_vk_create_info* given, pc_vk_instance** instance) {
    const auto check = [](const pc_vk_create_info& info) -> Failure {
        if ((info.flags & ~uint32_t(PC_VALIDATE | PC_LABELS)) == 0) return {};
        return {PC_ERROR_VERSION, concat("pc_vk_create_info.flags: ", info.flags,
                                         " has a bit other than PC_VALIDATE and PC_LABELS")};
    };
    return guest::create_handle(given, "pc_vk_create_info", instance, check, Instance::create);
}

void pc_vk_destroy(pc_vk_instance* instance) {
    guest::destroy(instance);
}

const char* pc_vk_last_error(const pc_vk_instance* instance) {
    return guest::last_error(instance);
}

pc_result pc_vk_prepare(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                        int wait) {
    return guest::prepare(instance, chain, frame, wait != 0);
}

pc_result pc_vk_run(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                    VkCommandBuffer command_buffer) {
    return guest::call(instance, chain, frame,
                       [&](const ChainVersion& of, const pc_vk_frame& whole) {
                           return instance->is->run(of, whole, command_buffer);
                       });
}

pc_result pc_vk_begin(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                      pc_vk_steps* steps) {
    return guest::call(instance, chain, frame,
                       [&](const ChainVersion& of, const pc_vk_frame& whole) {
                           return change_struct(steps, "pc_vk_steps", [&](pc_vk_steps& out) {
                               return instance->is->begin(of, whole, out);
                           });
                       });
}

pc_result pc_vk_record(pc_vk_instance* instance, uint32_t dispatch,
                       VkCommandBuffer command_buffer) {
    return guest::call(instance, [&] { return instance->is->record(dispatch, command_buffer); });
}

pc_result pc_vk_give_up(pc_vk_instance* instance) {
    return guest::call(instance, [&] {
        instance->is->give_up();
        return Failure();
    });
}

pc_result pc_vk_set_timing(pc_vk_instance* instance, int level) {
    return guest::set_timing(instance, level);
}

pc_result pc_vk_timings(pc_vk_instance* instance, pc_time* times, uint32_t* count,
                        uint64_t* frame_number) {
    return guest::timings(instance, times, count, frame_number);
}

pc_result pc_vk_query_frame(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                            pc_frame_needs* needs) {
    return guest::query_frame(instance, chain, frame, needs);
}

pc_result pc_vk_count(const pc_vk_instance* instance, pc_counters* counters) {
    return guest::count(instance, counters);
}

pc_result pc_vk_explain(const pc_vk_instance* instance, char* text, size_t* size) {
    return guest::explain(instance, text, size);
}

}  // extern "C"

#include "chain/vk/postchain_vk.h"

#include "chain/guest/handles.h"
#include "chain/guest/host_struct.h"
#include "chain/vk/instance.h"

using postchain::concat;
using postchain::guest::change_struct;
using postchain::guest::check_version;
using postchain::guest::copy_times;
using postchain::guest::create;
using postchain::guest::Failure;
using postchain::guest::guarded;
using postchain::guest::look;
using postchain::guest::read_struct;
using postchain::guest::Use;
using postchain::guest::version_of;
using postchain::vk::Instance;

struct pc_vk_instance {
    std::unique_ptr<Instance> is;
};

namespace postchain::guest {

template <>
inline constexpr size_t kMinSize<pc_vk_create_info> = offsetof(pc_vk_create_info, queue_family);
template <>
inline constexpr size_t kMinSize<pc_vk_steps> = sizeof(pc_vk_steps);

}  // namespace postchain::guest

namespace {

constexpr const char* kKind = "Vulkan instance";

template <class Work>
pc_result call(pc_vk_instance* instance, const Work& work) {
    return look(instance, kKind, [&] {
        Failure failure = guarded(work);
        instance->is->error = failure.text;
        if (failure.result < 0) instance->is->log(PC_LOG_ERROR, failure.text);
        return failure;
    });
}

// A call with a chain and a frame.
template <class Work>
pc_result call(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
               const Work& work) {
    return call(instance, [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        pc_vk_frame copy;
        const pc_vk_frame* whole = nullptr;
        RETURN_IF_ERROR(read_struct(frame, "pc_vk_frame", copy, whole));
        return work(*instance->is, version_of(chain), *whole);
    });
}

}  // namespace

extern "C" {

pc_result pc_vk_create(const pc_vk_create_info* given, pc_vk_instance** instance) {
    return create([&]() -> Failure {
        if (!instance) return {PC_ERROR_ARGUMENT, "instance is NULL"};
        *instance = nullptr;
        pc_vk_create_info copy;
        const pc_vk_create_info* info = nullptr;
        RETURN_IF_ERROR(read_struct(given, "pc_vk_create_info", copy, info));
        RETURN_IF_ERROR(check_version(info->api_version));
        if ((info->flags & ~uint32_t(PC_VALIDATE | PC_LABELS)) != 0)
            return {PC_ERROR_VERSION, concat("pc_vk_create_info.flags: ", info->flags,
                                             " has a bit other than PC_VALIDATE and PC_LABELS")};
        auto made = std::make_unique<pc_vk_instance>();
        RETURN_IF_ERROR(Instance::create(*info, made->is));
        Use::begin_life(made.get(), kKind);
        *instance = made.release();
        return {};
    });
}

void pc_vk_destroy(pc_vk_instance* instance) {
    if (Use::end_life(instance, kKind)) delete instance;
}

const char* pc_vk_last_error(const pc_vk_instance* instance) {
    return Use::is_alive(instance, kKind) ? instance->is->error.c_str() : "no such instance";
}

pc_result pc_vk_prepare(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                        int wait) {
    return call(instance, chain, frame, [&](Instance& is, const auto& of, const auto& whole) {
        return is.prepare(of, whole, wait != 0);
    });
}

pc_result pc_vk_run(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                    VkCommandBuffer command_buffer) {
    return call(instance, chain, frame, [&](Instance& is, const auto& of, const auto& whole) {
        return is.run(of, whole, command_buffer);
    });
}

pc_result pc_vk_begin(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                      pc_vk_steps* steps) {
    return call(instance, chain, frame, [&](Instance& is, const auto& of, const auto& whole) {
        return change_struct(steps, "pc_vk_steps",
                             [&](pc_vk_steps& out) { return is.begin(of, whole, out); });
    });
}

pc_result pc_vk_record(pc_vk_instance* instance, uint32_t dispatch,
                       VkCommandBuffer command_buffer) {
    return call(instance, [&] { return instance->is->record(dispatch, command_buffer); });
}

pc_result pc_vk_give_up(pc_vk_instance* instance) {
    return call(instance, [&] {
        instance->is->give_up();
        return Failure();
    });
}

pc_result pc_vk_set_timing(pc_vk_instance* instance, int level) {
    return call(instance, [&] { return instance->is->set_timing(level); });
}

pc_result pc_vk_timings(pc_vk_instance* instance, pc_time* times, uint32_t* count,
                        uint64_t* frame_number) {
    return call(instance, [&]() -> Failure {
        return copy_times(instance->is->newest_times(), times, count, frame_number);
    });
}

pc_result pc_vk_query_frame(pc_vk_instance* instance, pc_chain* chain, const pc_vk_frame* frame,
                            pc_frame_needs* needs) {
    return call(instance, chain, frame, [&](Instance& is, const auto& of, const auto& whole) {
        return change_struct(needs, "pc_frame_needs",
                             [&](pc_frame_needs& out) { return is.needs_of(of, whole, out); });
    });
}

pc_result pc_vk_count(const pc_vk_instance* instance, pc_counters* counters) {
    return look(instance, kKind, [&] {
        return change_struct(counters, "pc_counters", [&](pc_counters& whole) {
            instance->is->count(whole);
            return Failure();
        });
    });
}

pc_result pc_vk_explain(const pc_vk_instance* instance, char* text, size_t* size) {
    return look(instance, kKind,
                [&] { return postchain::guest::copy_text(instance->is->explain(), text, size); });
}

}  // extern "C"

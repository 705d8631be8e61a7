#include "chain/guest/postchain_plan.h"

#include "chain/guest/frame_check.h"
#include "chain/guest/handles.h"
#include "chain/guest/host_struct.h"
#include "chain/guest/planner.h"

using postchain::concat;
using postchain::guest::change_struct;
using postchain::guest::check_version;
using postchain::guest::create;
using postchain::guest::Failure;
using postchain::guest::FrameCopy;
using postchain::guest::look;
using postchain::guest::Planner;
using postchain::guest::read_frame;
using postchain::guest::read_struct;
using postchain::guest::Use;
using postchain::guest::version_of;

struct pc_planner {
    std::unique_ptr<Planner> is;
};

namespace postchain::guest {

template <>
inline constexpr size_t kMinSize<pc_plan_create_info> = sizeof(pc_plan_create_info);
template <>
inline constexpr size_t kMinSize<pc_plan> = sizeof(pc_plan);

}  // namespace postchain::guest

namespace {

constexpr const char* kPlanner = "planner";

// A call with a chain and a frame.
template <class Work>
pc_result call(pc_planner* planner, pc_chain* chain, const pc_frame* frame, const Work& work) {
    return look(planner, kPlanner, [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        FrameCopy copy = {};
        const pc_frame* whole = nullptr;
        RETURN_IF_ERROR(read_frame(frame, copy, whole));
        if (whole == frame) copy.frame = *frame;
        for (pc_frame* one : {&copy.frame, &copy.neighbors[0], &copy.neighbors[1]})
            if ((one->flags & PC_BOTTOM_LEFT) == 0) one->flags |= PC_TOP_LEFT;
        return work(*planner->is, version_of(chain), copy.frame);
    });
}

}  // namespace

extern "C" {

pc_result pc_plan_create(const pc_plan_create_info* info, pc_planner** planner) {
    return create([&]() -> Failure {
        if (!planner) return {PC_ERROR_ARGUMENT, "planner is NULL"};
        *planner = nullptr;
        pc_plan_create_info copy;
        const pc_plan_create_info* whole = nullptr;
        RETURN_IF_ERROR(read_struct(info, "pc_plan_create_info", copy, whole));
        RETURN_IF_ERROR(check_version(whole->api_version));
        if ((whole->flags & ~uint32_t(PC_VALIDATE)) != 0 || whole->reserved != 0)
            return {PC_ERROR_VERSION,
                    "pc_plan_create_info: flags has another bit than PC_VALIDATE, or reserved is "
                    "not 0"};
        std::unique_ptr<pc_planner> made(new pc_planner);
        RETURN_IF_ERROR(Planner::create(*whole, made->is));
        Use::begin_life(made.get(), kPlanner);
        *planner = made.release();
        return {};
    });
}

void pc_plan_destroy(pc_planner* planner) {
    if (Use::end_life(planner, kPlanner)) delete planner;
}

pc_result pc_plan_programs(pc_planner* planner, pc_chain* chain, const pc_frame* frame,
                           uint64_t* keys, uint32_t* count) {
    return call(planner, chain, frame,
                [&](Planner& is, const auto& of, const pc_frame& whole) -> Failure {
                    if (!count) return {PC_ERROR_ARGUMENT, "count is NULL"};
                    return is.list_programs(of, whole, keys, *count);
                });
}

pc_result pc_plan_frame(pc_planner* planner, pc_chain* chain, const pc_frame* frame,
                        pc_plan* plan) {
    return call(planner, chain, frame, [&](Planner& is, const auto& of, const pc_frame& whole) {
        return change_struct(plan, "pc_plan",
                             [&](pc_plan& out) { return is.plan(of, whole, out); });
    });
}

}  // extern "C"

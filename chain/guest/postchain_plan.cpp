#include "chain/guest/postchain_plan.h"

#include "chain/guest/instance_calls.h"
#include "chain/guest/planner.h"

namespace guest = postchain::guest;
using postchain::guest::ChainVersion;
using postchain::guest::Failure;
using postchain::guest::FrameCopy;
using postchain::guest::Planner;

struct pc_planner {
    std::unique_ptr<Planner> is;
};

namespace postchain::guest {

template <>
inline constexpr size_t kMinSize<pc_plan_create_info> = sizeof(pc_plan_create_info);
template <>
inline constexpr size_t kMinSize<pc_plan> = sizeof(pc_plan);
template <>
inline constexpr const char* kKind<pc_planner> = "planner";

}  // namespace postchain::guest

namespace {

// A call with a chain and a frame.
template <class Work>
pc_result call(pc_planner* planner, pc_chain* chain, const pc_frame* frame, const Work& work) {
    return guest::look(planner, guest::kKind<pc_planner>, [&] {
        return guest::with_chain(chain, frame, [&](const ChainVersion& of, const pc_frame& given) {
            FrameCopy copy = {given, {}};
            guest::set_neighbors(copy.frame, {given.before, given.after}, copy.neighbors);
            for (pc_frame* one : {&copy.frame, &copy.neighbors[0], &copy.neighbors[1]})
                if ((one->flags & PC_BOTTOM_LEFT) == 0) one->flags |= PC_TOP_LEFT;
            return work(of, copy.frame);
        });
    });
}

}  // namespace

extern "C" {

pc_result pc_plan_create(const pc_plan_create_info* given, pc_planner** planner) {
    const auto check = [](const pc_plan_create_info& info) -> Failure {
        if ((info.flags & ~uint32_t(PC_VALIDATE)) == 0 && info.reserved == 0) return {};
        return {PC_ERROR_VERSION,
                "pc_plan_create_info: flags has another bit than PC_VALIDATE, or reserved is not "
                "0"};
    };
    return guest::create_handle(given, "pc_plan_create_info", planner, check, Planner::create);
}

void pc_plan_destroy(pc_planner* planner) {
    guest::destroy(planner);
}

pc_result pc_plan_programs(pc_planner* planner, pc_chain* chain, const pc_frame* frame,
                           uint64_t* keys, uint32_t* count) {
    return call(planner, chain, frame,
                [&](const ChainVersion& of, const pc_frame& whole) -> Failure {
                    if (!count) return {PC_ERROR_ARGUMENT, "count is NULL"};
                    return planner->is->list_programs(of, whole, keys, *count);
                });
}

pc_result pc_plan_frame(pc_planner* planner, pc_chain* chain, const pc_frame* frame,
                        pc_plan* plan) {
    return call(planner, chain, frame, [&](const ChainVersion& of, const pc_frame& whole) {
        return guest::change_struct(
            plan, "pc_plan", [&](pc_plan& out) { return planner->is->plan(of, whole, out); });
    });
}

}  // extern "C"

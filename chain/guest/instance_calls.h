// The shared bodies of the C functions of GL, Vulkan and the planner.
#pragma once

#include <type_traits>

#include "chain/guest/frame_check.h"
#include "chain/guest/handles.h"
#include "chain/guest/host_struct.h"

namespace postchain::guest {

// A pc_create_info with the log() of a host.
template <class Info>
class InstanceBase {
  public:
    explicit InstanceBase(const Info& info) : info_(info) {}
    InstanceBase(const InstanceBase&) = delete;
    InstanceBase& operator=(const InstanceBase&) = delete;

    void log(int level, const std::string& message) const {
        if (!info_.log || message == logged_) return;  // not every frame again
        logged_ = message;
        info_.log(info_.user, level, message.c_str());
    }

    std::string error;  // of the last call

  protected:
    const Info info_;
    int timing_ = 0;

  private:
    mutable std::string logged_;
};

// Messages name a handle by its kind, a struct by its C name. read_frame() knows that of pc_frame.
template <class Handle>
inline constexpr const char* kKind = nullptr;
template <class Struct>
inline constexpr const char* kName = nullptr;

// `check` checks the whole info, `make` makes Handle::is.
template <class Handle, class Info, class Check, class Make>
pc_result create_handle(const Info* given, const char* name, Handle** handle, const Check& check,
                        const Make& make) {
    return create([&]() -> Failure {
        if (!handle) return {PC_ERROR_ARGUMENT, concat(kKind<Handle>, " is NULL")};
        *handle = nullptr;
        Info copy;
        const Info* info = nullptr;
        RETURN_IF_ERROR(read_struct(given, name, copy, info));
        RETURN_IF_ERROR(check_version(info->api_version));
        RETURN_IF_ERROR(check(*info));
        auto made = std::make_unique<Handle>();
        RETURN_IF_ERROR(make(*info, made->is));
        Use::begin_life(made.get(), kKind<Handle>);
        *handle = made.release();
        return {};
    });
}

template <class Handle>
void destroy(Handle* handle) {
    if (Use::end_life(handle, kKind<Handle>)) delete handle;
}

template <class Handle>
const char* last_error(const Handle* handle) {
    return Use::is_alive(handle, kKind<Handle>) ? handle->is->error.c_str() : "no such instance";
}

template <class Handle, class Work>
pc_result call(Handle* handle, const Work& work) {
    return look(handle, kKind<Handle>, [&] {
        Failure failure = guarded(work);
        handle->is->error = failure.text;
        if (failure.result < 0) handle->is->log(PC_LOG_ERROR, failure.text);
        return failure;
    });
}

// Calls work(ChainVersion, Struct) with a complete copy of the host's struct; a pc_frame has its
// neighbors.
template <class Struct, class Work>
Failure with_chain(const pc_chain* chain, const Struct* given, const Work& work) {
    const Use use(chain, "chain");
    RETURN_IF_ERROR(use.failure());
    const Struct* whole = nullptr;
    if constexpr (std::is_same_v<Struct, pc_frame>) {
        FrameCopy copy;
        RETURN_IF_ERROR(read_frame(given, copy, whole));
        return work(version_of(chain), *whole);
    } else {
        Struct copy;
        RETURN_IF_ERROR(read_struct(given, kName<Struct>, copy, whole));
        return work(version_of(chain), *whole);
    }
}
template <class Handle, class Struct, class Work>
pc_result call(Handle* handle, const pc_chain* chain, const Struct* given, const Work& work) {
    return call(handle, [&] { return with_chain(chain, given, work); });
}

template <class Handle>
pc_result prepare(Handle* handle, const pc_chain* chain, const auto* frame, bool wait) {
    return call(handle, chain, frame, [&](const ChainVersion& of, const auto& whole) {
        return handle->is->prepare(of, whole, wait);
    });
}

template <class Handle>
pc_result query_frame(Handle* handle, const pc_chain* chain, const auto* frame,
                      pc_frame_needs* needs) {
    return call(handle, chain, frame, [&](const ChainVersion& of, const auto& whole) {
        return change_struct(needs, "pc_frame_needs", [&](pc_frame_needs& out) {
            return handle->is->needs_of(of, whole, out);
        });
    });
}

template <class Handle>
pc_result set_timing(Handle* handle, int level) {
    return call(handle, [&]() -> Failure {
        if (level < 0 || level > 2)
            return {PC_ERROR_ARGUMENT, concat("level: ", level, " is not 0, 1 or 2")};
        return handle->is->set_timing(level);
    });
}

template <class Handle>
pc_result timings(Handle* handle, pc_time* times, uint32_t* count, uint64_t* frame_number) {
    return call(handle, [&]() -> Failure {
        RETURN_IF_ERROR(handle->is->check_context());
        return copy_times(handle->is->newest_times(), times, count, frame_number);
    });
}

template <class Handle>
pc_result count(const Handle* handle, pc_counters* counters) {
    return look(handle, kKind<Handle>, [&] {
        return change_struct(counters, "pc_counters", [&](pc_counters& whole) {
            handle->is->count(whole);
            return Failure();
        });
    });
}

template <class Handle>
pc_result explain(const Handle* handle, char* text, size_t* size) {
    return look(handle, kKind<Handle>,
                [&] { return copy_text(handle->is->explain(), text, size); });
}

}  // namespace postchain::guest

#include "chain/guest/handles.h"

#include <algorithm>
#include <mutex>
#include <string_view>
#include <thread>
#include <vector>

namespace postchain::guest {
namespace {

struct Life {
    const void* handle;
    std::string_view kind;  // "instance" or "chain"
    bool shared = false;    // several threads may be in calls
    std::thread::id user = {};
    int calls = 0;  // of that thread; a callback may call the library
};

struct Lives {
    std::mutex mutex;
    std::vector<Life> all;

    Life* find(const void* handle, std::string_view kind) {
        const auto found = std::find_if(all.begin(), all.end(), [&](const Life& life) {
            return life.handle == handle && life.kind == kind;
        });
        return found == all.end() ? nullptr : &*found;
    }
};

Lives& lives() {
    static auto* all = new Lives;  // a host may destroy handles at its very end
    return *all;
}

// Why no call may begin.
Failure check(const Life* life, const void* handle, const char* kind) {
    if (!handle) return {PC_ERROR_ARGUMENT, concat(kind, " is NULL")};
    if (!life)
        return {PC_ERROR_ARGUMENT, concat(kind, " is not one of this library, or was destroyed")};
    if (life->calls > 0 && !life->shared && life->user != std::this_thread::get_id())
        return {PC_ERROR_ARGUMENT,
                concat(kind, ": another thread is in a call with it; make one call at a time")};
    return {};
}

}  // namespace

std::string& last_error_text() {
    thread_local std::string text;
    return text;
}

Use::Use(const void* handle, const char* kind) : handle_(handle), kind_(kind) {
    const std::lock_guard lock(lives().mutex);
    Life* life = lives().find(handle, kind);
    failure_ = check(life, handle, kind);
    if (!failure_.ok()) return;
    life->user = std::this_thread::get_id();
    ++life->calls;
}

Use::~Use() {
    if (!failure_.ok()) return;
    const std::lock_guard lock(lives().mutex);
    if (Life* life = lives().find(handle_, kind_)) --life->calls;
}

void Use::begin_life(const void* handle, const char* kind, bool shared) {
    const std::lock_guard lock(lives().mutex);
    lives().all.push_back({handle, kind, shared});
}

bool Use::end_life(const void* handle, const char* kind) {
    if (!handle) return false;
    const std::lock_guard lock(lives().mutex);
    const Life* life = lives().find(handle, kind);
    Failure failure = check(life, handle, kind);
    if (failure.ok() && life->calls > 0)  // this is a callback, or another thread's
        failure = {PC_ERROR_ARGUMENT,
                   concat(kind, ": a call with it is not finished; destroy it afterwards")};
    if (!failure.ok()) {
        last_error_text().swap(failure.text);
        return false;
    }
    lives().all.erase(lives().all.begin() + (life - lives().all.data()));
    return true;
}

bool Use::is_alive(const void* handle, const char* kind) {
    const std::lock_guard lock(lives().mutex);
    return lives().find(handle, kind) != nullptr;
}

pc_chain* new_chain(Chain chain) {
    std::unique_ptr<pc_chain> made(new pc_chain{ChainHandle(std::move(chain)), {}});
    Use::begin_life(made.get(), "chain", true);
    return made.release();
}

ChainVersion version_of(const pc_chain* chain) {
    const std::lock_guard lock(chain->mutex);
    return chain->is.version();
}

}  // namespace postchain::guest

// The structs behind the pointers of the C interface.
#pragma once

#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <string>

#include "chain/guest/chain_handle.h"

struct pc_chain {
    postchain::guest::ChainHandle is;
    mutable std::mutex mutex;  // of `is`
};

namespace postchain::guest {

// The text of pc_error(): of this thread's last call.
std::string& last_error_text();

// Handles that hosts have. A call on a handle refuses one that is null, foreign or destroyed, and
// an instance that another thread's call uses. A chain may be in several calls.
class Use {
  public:
    // `kind`: "instance", "chain"; static.
    Use(const void* handle, const char* kind);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    const Failure& failure() const { return failure_; }

    // `shared`: for handles that several threads may use at a time.
    static void begin_life(const void* handle, const char* kind, bool shared = false);
    // False if it is none, or a call with it is not finished.
    static bool end_life(const void* handle, const char* kind);
    static bool is_alive(const void* handle, const char* kind);

  private:
    const void* handle_;
    const char* kind_;
    Failure failure_;
};

// A handle of this chain.
pc_chain* new_chain(Chain chain);
// The values that a frame reads. Precondition: a Use of the chain.
ChainVersion version_of(const pc_chain* chain);

// The result of work(). An exception becomes a Failure, so that none leaves the library.
template <class Work>
Failure guarded(const Work& work) noexcept {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return {PC_ERROR_MEMORY, "out of memory"};  // short: stored in place
    } catch (const std::exception& e) {
        return {PC_ERROR_INTERNAL, e.what()};
    } catch (...) {
        return {PC_ERROR_INTERNAL, "unknown"};
    }
}

// Sets last_error_text(); to "" without memory for it.
inline void keep_error(const std::string& text) noexcept {
    try {
        last_error_text() = text;
    } catch (...) {
        last_error_text().clear();
    }
}

// A call that does not change the handle.
template <class Handle, class Work>
pc_result look(const Handle* handle, const char* kind, const Work& work) {
    const Use use(handle, kind);
    const Failure failure = use.failure().ok() ? guarded(work) : use.failure();
    keep_error(failure.text);
    return failure.result;
}

// The result of work(); its text goes to last_error_text().
template <class Work>
pc_result create(const Work& work) {
    Failure failure = guarded(work);
    last_error_text().swap(failure.text);
    return failure.result;
}

}  // namespace postchain::guest

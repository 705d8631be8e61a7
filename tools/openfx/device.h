// One GL context with its executor, on a thread of its own, for all effects of the process. The
// host's contexts are not touched, and the host is not called from this thread.
#pragma once

#include <functional>

#include "chain/gl/executor.h"

namespace postchain::openfx {

using DeviceWork = std::function<Status(Executor& executor, const gl::Device& device)>;

// Runs `work` on the device's thread, after the calls that came before, and waits for it. The first
// call makes thread and context. `canceled` is asked on the calling thread, every few milliseconds:
// then the work does not begin, or ends before the next band (StatusCode::canceled). Errors: those
// of the work; StatusCode::gl without a context, for which the next call tries again.
Status run_on_device(const DeviceWork& work, const std::function<bool()>& canceled);

// Frees textures and programs once the work before it is done. Does not wait.
void purge_device();
// Ends thread and context. The next run_on_device() makes others.
void close_device();

}  // namespace postchain::openfx

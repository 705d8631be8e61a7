// The GL context of the service, with its executor. Used by one thread.
#pragma once

#include <memory>
#include <string>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/pass/pass.h"

namespace postchain::service {

class GlDevice {
  public:
    // Creates a context that is current on this thread, and runs test(). Errors (gl).
    static Result<std::unique_ptr<GlDevice>> create(const egl::ContextOptions& options,
                                                    const PassRegistry& registry);

    // Filters a small image with a known result. Errors (gl).
    Status test();
    // After code that may have made another context current.
    Status make_current() { return context_->make_current(); }

    Executor& executor() { return *executor_; }
    const std::string& renderer() const { return renderer_; }
    bool software() const { return context_->device().software; }

  private:
    explicit GlDevice(const PassRegistry& registry) : registry_(registry) {}
    const PassRegistry& registry_;
    std::unique_ptr<egl::Context> context_;
    std::unique_ptr<Executor> executor_;  // destroyed before its context
    std::string renderer_;
};

}  // namespace postchain::service

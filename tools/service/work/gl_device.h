// The GL context of the service and what runs on it. Used by one thread.
#pragma once

#include <memory>
#include <string>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/pass.h"

namespace postchain::service {

class GlDevice {
  public:
    // Makes a context that is current on this thread, and tries it. Errors (gl).
    static Result<std::unique_ptr<GlDevice>> create(const egl::ContextOptions& options,
                                                    const PassRegistry& registry);

    // A small picture through a shader, whose result is known. Errors (gl).
    Status test();
    // After code that has made another context.
    Status make_current() { return context_->make_current(); }

    Executor& executor() { return *executor_; }
    const std::string& renderer() const { return renderer_; }
    bool software() const { return context_->device().software; }

  private:
    explicit GlDevice(const PassRegistry& registry) : registry_(registry) {}
    const PassRegistry& registry_;
    std::unique_ptr<egl::Context> context_;
    std::unique_ptr<Executor> executor_;  // ends before its context
    std::string renderer_;
};

}  // namespace postchain::service

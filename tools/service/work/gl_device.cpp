#include "tools/service/work/gl_device.h"

#include <cmath>

#include "chain/pass/planner.h"
#include "tools/sequence/run/device.h"

namespace postchain::service {

Result<std::unique_ptr<GlDevice>> GlDevice::create(const egl::ContextOptions& options,
                                                   const PassRegistry& registry) {
    try {
        ASSIGN_OR_RETURN(auto context, egl::Context::create(options));
        std::unique_ptr<GlDevice> made(new GlDevice(registry));
        made->context_ = std::move(context);
        made->executor_ = std::make_unique<Executor>(made->context_->device());
        made->renderer_ = sequence::renderer_text(made->context_->device());
        RETURN_IF_ERROR(made->test());
        return made;
    } catch (...) {
        return status_of_exception("the GL context");
    }
}

Status GlDevice::test() try {
    constexpr int kSide = 16;
    constexpr float kValue = 0.25f;
    Chain chain;
    if (!chain.append(registry_, "fxaa")) return Status();
    FrameDescription frame;
    frame.width = frame.height = frame.display_width = frame.display_height = kSide;
    frame.planes = {Role::color};
    PlanOptions options;
    options.elide = false;
    options.device = executor_->device_class();
    ASSIGN_OR_RETURN(auto plan, make_plan(chain, frame, options));
    FramePlanes planes;
    planes.emplace(Role::color, ImageF(kSide, kSide, 4, kValue));
    ASSIGN_OR_RETURN(auto result, executor_->filter(plan, planes));
    // An anti-aliasing filter keeps a uniform image.
    for (const float value : result.at(Role::color).data)
        if (!(std::abs(value - kValue) < 1e-3f))
            return Status(StatusCode::gl, concat("a test dispatch returned ", value, " instead of ",
                                                 kValue, "; the device is not reliable"));
    return Status();
} catch (...) {
    return status_of_exception("the test of the GL device");
}

}  // namespace postchain::service

#include <optional>

#include "chain/egl/context.h"
#include "tests/bench/bench_device.h"

namespace postchain::bench {
namespace {

class GlBenchDevice : public BenchDevice {
  public:
    explicit GlBenchDevice(bool steps) { executor_.set_timing(true, steps); }
    std::string text() const override { return device_text(context_->device()); }
    const char* clock() const override { return executor_.timing_source(); }
    bool software() const override { return context_->device().software; }
    DeviceClass device_class() const override { return executor_.device_class(); }
    void set_planes(const FramePlanes& planes) override { planes_.emplace(planes); }
    std::vector<PassTime> run(const Plan& plan) override {
        require(executor_.run(plan, planes_->inputs_of(plan)));
        return finished_times(executor_);
    }
    double bytes_of(const Plan& plan) override {
        Executor executor(context_->device());
        require(executor.run(plan, planes_->inputs_of(plan)));
        return double(executor.counters().texture_bytes_peak);
    }

  private:
    const std::unique_ptr<egl::Context> context_ = require(egl::Context::create());
    Executor executor_{context_->device()};
    std::optional<DevicePlanes> planes_;
};

}  // namespace

std::unique_ptr<BenchDevice> gl_bench_device(bool steps) {
    return std::make_unique<GlBenchDevice>(steps);
}

}  // namespace postchain::bench

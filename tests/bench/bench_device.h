// Devices on which gpu_bench runs plans: of GL, and of Vulkan.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "chain/gl/executor.h"
#include "tests/bench/bench_frame.h"

namespace postchain::bench {

class BenchDevice {
  public:
    virtual ~BenchDevice() = default;
    virtual std::string text() const = 0;
    virtual const char* clock() const = 0;
    virtual bool software() const = 0;
    virtual DeviceClass device_class() const = 0;
    // The planes that runs read from now on; they outlive the runs.
    virtual void set_planes(const FramePlanes& planes) = 0;
    // Runs the plan, and waits for its times.
    virtual std::vector<PassTime> run(const Plan& plan) = 0;
    // Bytes of the textures of one run.
    virtual double bytes_of(const Plan& plan) = 0;
};

// `steps`: times by step, otherwise by pass.
std::unique_ptr<BenchDevice> gl_bench_device(bool steps);
// Without Vulkan in the build the program ends.
std::unique_ptr<BenchDevice> vulkan_bench_device(bool steps);

}  // namespace postchain::bench

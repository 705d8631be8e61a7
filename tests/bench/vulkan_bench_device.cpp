// The plans of GL, run by chain/vk. Without validation layers, which tests of Vulkan use.
#include "tests/bench/bench_device.h"

#ifndef POSTCHAIN_BENCH_VULKAN

namespace postchain::bench {

std::unique_ptr<BenchDevice> vulkan_bench_device(bool) {
    fail("--vulkan: this build has no Vulkan");
}

}  // namespace postchain::bench

#else

#include <list>
#include <optional>

#include "chain/vk/compiled_plan.h"
#include "chain/vk/format.h"
#include "tests/vulkan/image.h"

namespace postchain::bench {
namespace {

using test::HostImage;
using test::Vulkan;

class VulkanBenchDevice : public BenchDevice {
  public:
    explicit VulkanBenchDevice(bool steps) : steps_(steps) {
        vk::Handles handles;
        handles.get_instance_proc_addr = vkGetInstanceProcAddr;
        handles.instance = vulkan_.instance;
        handles.physical = vulkan_.physical;
        handles.device = vulkan_.device;
        handles.queue_family = Vulkan::kFamily;
        require(device_.open(handles));
        if (device_.timestamp_bits() == 0) fail("--vulkan: the queue has no timestamps");
        require(sampler_.make(device_));
        programs_.emplace(device_, sampler_.handle(), vk::ProgramSet(), ProgramStore());
        pool_.emplace(device_, 0);
        clock_.emplace(device_, 1);
        unused_ = require(vk::make_image(device_, {Format::rgba32f, 1, 1, 0}));
    }
    std::string text() const override {
        VkPhysicalDeviceProperties properties;
        vkGetPhysicalDeviceProperties(vulkan_.physical, &properties);
        return concat("device: ", properties.deviceName, ", Vulkan ",
                      VK_API_VERSION_MAJOR(properties.apiVersion), ".",
                      VK_API_VERSION_MINOR(properties.apiVersion));
    }
    const char* clock() const override { return "vkCmdWriteTimestamp"; }
    bool software() const override { return vulkan_.software; }
    DeviceClass device_class() const override { return DeviceClass::gpu; }  // as pc_vk_run()
    void set_planes(const FramePlanes& planes) override {
        compiled_.reset();
        images_.clear();
        planes_ = &planes;
    }
    std::vector<PassTime> run(const Plan& plan) override {
        if (!compiled_ || !(made_ == plan)) make(plan);
        ++run_;
        compiled_->begin_run(run_, views_);
        vulkan_.run([&](VkCommandBuffer commands) {
            test::full_barrier(commands);
            require(clock_->begin(commands, 0, run_, plan.steps.size(), true));
            compiled_->record(commands, *clock_, steps_);
        });
        require(clock_->begin(VK_NULL_HANDLE, 0, run_, 0, false));  // reads that run's times
        std::vector<PassTime> times;
        for (const Times::Interval& one : clock_->newest()->intervals)
            times.push_back({one.pass, one.name, one.milliseconds});
        return times;
    }
    double bytes_of(const Plan& plan) override {
        return double(share_storage(plan, MaxFrameSize{plan.width, plan.height}).bytes());
    }

  private:
    void make(const Plan& plan) {
        compiled_.reset();
        pool_.emplace(device_, 0);
        const vk::Objects objects{device_, *pool_, *programs_, 1, *unused_, *unused_};
        compiled_ = require(
            vk::CompiledPlan::make(plan, objects, MaxFrameSize{plan.width, plan.height}, run_));
        made_ = plan;
        images_.clear();
        for (size_t t = 0; t < plan.textures.size(); ++t) {
            const PlanTexture& one = plan.textures[t];
            if (!one.imported || one.first_step < 0) continue;
            images_.emplace_back(vk::format_of(one.format), planes_->at(one.role));
            views_.at(images_.size() - 1) = {images_.back().image().view, VK_IMAGE_LAYOUT_GENERAL};
            compiled_->import(TextureId(t), unsigned(images_.size()));
        }
    }

    const bool steps_;
    Vulkan& vulkan_ = Vulkan::get();
    vk::Device device_;
    vk::Sampler sampler_;
    std::unique_ptr<vk::Image> unused_;
    std::optional<vk::ImagePool> pool_;
    std::optional<vk::Programs> programs_;
    std::optional<vk::Clock> clock_;
    const FramePlanes* planes_ = nullptr;
    std::list<HostImage> images_;
    vk::HostViews views_ = {};
    Plan made_;
    std::unique_ptr<vk::CompiledPlan> compiled_;
    uint64_t run_ = 0;
};

}  // namespace

std::unique_ptr<BenchDevice> vulkan_bench_device(bool steps) {
    Vulkan::with_layers = false;
    return std::make_unique<VulkanBenchDevice>(steps);
}

}  // namespace postchain::bench

#endif

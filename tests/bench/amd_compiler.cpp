#include "tests/bench/amd_compiler.h"

#include <glob.h>
#include <vulkan/vulkan.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "chain/plan/program_source.h"
#include "tests/bench/arguments.h"

namespace postchain::bench {
namespace {

constexpr const char* kDriver = "/usr/share/vulkan/icd.d/radeon_icd*.json";
constexpr const char* kRemedy =
    "install Mesa's Vulkan drivers, or name radeon_icd*.json in "
    "VK_ICD_FILENAMES";

// Leaves the Vulkan loader only RADV, unless the user chose.
bool choose_radv() {
    if (std::getenv("VK_ICD_FILENAMES")) return true;
    glob_t found = {};
    const bool any = glob(kDriver, 0, nullptr, &found) == 0;
    if (any) setenv("VK_ICD_FILENAMES", found.gl_pathv[0], 1);
    globfree(&found);
    return any;
}

template <class Info>
Info info_of(VkStructureType type) {
    Info info = {};
    info.sType = type;
    return info;
}

VkDescriptorSetLayout make_set_layout(VkDevice device) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    const VkDescriptorType kinds[] = {
        VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
        VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER};
    for (const VkDescriptorType kind : kinds)
        for (uint32_t i = 0; i < kUnitsOfAKind; ++i)
            bindings.push_back(
                {uint32_t(bindings.size()), kind, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    auto info = info_of<VkDescriptorSetLayoutCreateInfo>(
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    info.bindingCount = uint32_t(bindings.size());
    info.pBindings = bindings.data();
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    vkCreateDescriptorSetLayout(device, &info, nullptr, &layout);
    return layout;
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    std::string name = std::filesystem::temp_directory_path() / "postchain_bench_XXXXXX";
    if (!mkdtemp(name.data())) fail(name + ": cannot be created", 2);
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string TemporaryFolder::path(const std::string& name) const {
    return name.empty() ? path_ : path_ + "/" + name;
}

std::vector<uint32_t> spirv_of(const ProgramKey& program, const std::string& shaders) {
    static const TemporaryFolder folder;
    const Result<std::string> source = program_source(program, shaders);
    if (!source.ok()) fail(source.status().message(), 1);
    std::ofstream(folder.path("s.comp")) << *source;
    const std::string command =
        concat("glslangValidator -V --target-env vulkan1.2 --shift-image-binding ", kFirstImage,
               " --shift-ssbo-binding ", kFirstList, " --shift-UBO-binding ", kFirstBlock, " ",
               folder.path("s.comp"), " -o ", folder.path("s.spv"), " >", folder.path("log"));
    if (std::system(command.c_str()) != 0) {
        std::ifstream log(folder.path("log"));
        fail(program.text() + ":\n" + std::string(std::istreambuf_iterator<char>(log), {}), 1);
    }
    std::vector<uint32_t> words(std::filesystem::file_size(folder.path("s.spv")) / 4);
    std::ifstream(folder.path("s.spv"), std::ios::binary)
        .read(reinterpret_cast<char*>(words.data()), std::streamsize(4 * words.size()));
    return words;
}

struct AmdCompiler::Handles {
    VkInstance instance = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkDescriptorSetLayout set = VK_NULL_HANDLE;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    PFN_vkGetPipelineExecutableStatisticsKHR statistics = nullptr;
    PFN_vkGetPipelineExecutableInternalRepresentationsKHR representations = nullptr;

    ~Handles() {
        if (device) {
            vkDestroyPipelineLayout(device, layout, nullptr);
            vkDestroyDescriptorSetLayout(device, set, nullptr);
            vkDestroyDevice(device, nullptr);
        }
        if (instance) vkDestroyInstance(instance, nullptr);
    }
};

AmdCompiler::AmdCompiler() : handles_(std::make_unique<Handles>()) {}

AmdCompiler::~AmdCompiler() = default;

Result<std::unique_ptr<AmdCompiler>> AmdCompiler::create(const std::string& generation) {
    if (!choose_radv())
        return Status(StatusCode::usage, concat(kDriver, " does not exist: ", kRemedy));
    setenv("RADV_FORCE_FAMILY", generation.c_str(), 1);
    setenv("MESA_SHADER_CACHE_DISABLE", "1", 1);  // what comes from the cache has no statistics
    std::unique_ptr<AmdCompiler> made(new AmdCompiler);
    Handles& vk = *made->handles_;

    auto application = info_of<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.apiVersion = VK_API_VERSION_1_2;
    auto instance = info_of<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    instance.pApplicationInfo = &application;
    if (vkCreateInstance(&instance, nullptr, &vk.instance) != VK_SUCCESS)
        return Status(StatusCode::usage, concat("no Vulkan driver can be loaded: ", kRemedy));
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    uint32_t count = 1;
    vkEnumeratePhysicalDevices(vk.instance, &count, &physical);
    if (!physical)
        return Status(StatusCode::usage, concat("the Vulkan driver is not RADV: ", kRemedy));

    auto reports = info_of<VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR);
    reports.pipelineExecutableInfo = VK_TRUE;
    auto features =
        info_of<VkPhysicalDeviceFeatures2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2);
    vkGetPhysicalDeviceFeatures2(physical, &features);
    features.pNext = &reports;
    const float priority = 1;
    auto queue = info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    const char* extension = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
    auto device = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
    device.pNext = &features;
    device.queueCreateInfoCount = 1;
    device.pQueueCreateInfos = &queue;
    device.enabledExtensionCount = 1;
    device.ppEnabledExtensionNames = &extension;
    if (vkCreateDevice(physical, &device, nullptr, &vk.device) != VK_SUCCESS)
        return Status(StatusCode::usage, concat("the Vulkan driver is not RADV: ", kRemedy));
    vk.statistics = reinterpret_cast<PFN_vkGetPipelineExecutableStatisticsKHR>(
        vkGetDeviceProcAddr(vk.device, "vkGetPipelineExecutableStatisticsKHR"));
    vk.representations = reinterpret_cast<PFN_vkGetPipelineExecutableInternalRepresentationsKHR>(
        vkGetDeviceProcAddr(vk.device, "vkGetPipelineExecutableInternalRepresentationsKHR"));

    vk.set = make_set_layout(vk.device);
    auto layout =
        info_of<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &vk.set;
    const VkPushConstantRange first_group = {VK_SHADER_STAGE_COMPUTE_BIT, 0, 8};
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &first_group;
    vkCreatePipelineLayout(vk.device, &layout, nullptr, &vk.layout);
    return made;
}

std::string AmdCompiler::assembly_of(const Handles& vk, const VkPipelineExecutableInfoKHR& of) {
    uint32_t count = 0;
    vk.representations(vk.device, &of, &count, nullptr);
    std::vector<VkPipelineExecutableInternalRepresentationKHR> all(
        count, info_of<VkPipelineExecutableInternalRepresentationKHR>(
                   VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INTERNAL_REPRESENTATION_KHR));
    vk.representations(vk.device, &of, &count, all.data());
    std::string text;
    for (auto& one : all) {
        if (std::string(one.name) != "Assembly") continue;
        text.resize(one.dataSize);
        one.pData = text.data();
    }
    vk.representations(vk.device, &of, &count, all.data());
    return text;
}

Result<AmdCompiler::Compiled> AmdCompiler::compile(const std::vector<uint32_t>& spirv) {
    const Handles& vk = *handles_;
    auto code = info_of<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    code.codeSize = 4 * spirv.size();
    code.pCode = spirv.data();
    VkShaderModule module = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
    if (vkCreateShaderModule(vk.device, &code, nullptr, &module) == VK_SUCCESS) {
        auto info =
            info_of<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
        info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR |
                     VK_PIPELINE_CREATE_CAPTURE_INTERNAL_REPRESENTATIONS_BIT_KHR;
        info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        info.stage.module = module;
        info.stage.pName = "main";
        info.layout = vk.layout;
        vkCreateComputePipelines(vk.device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    }
    Compiled found;
    if (pipeline) {
        auto executable =
            info_of<VkPipelineExecutableInfoKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR);
        executable.pipeline = pipeline;
        uint32_t count = 0;
        vk.statistics(vk.device, &executable, &count, nullptr);
        std::vector<VkPipelineExecutableStatisticKHR> rows(
            count, info_of<VkPipelineExecutableStatisticKHR>(
                       VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR));
        vk.statistics(vk.device, &executable, &count, rows.data());
        for (const auto& row : rows) found.statistics[row.name] = row.value.u64;
        found.assembly = assembly_of(vk, executable);
    }
    vkDestroyPipeline(vk.device, pipeline, nullptr);
    vkDestroyShaderModule(vk.device, module, nullptr);
    if (found.statistics.empty()) return Status(StatusCode::gl, "RADV does not compile it");
    return found;
}

}  // namespace postchain::bench

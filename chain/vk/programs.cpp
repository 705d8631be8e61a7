#include "chain/vk/programs.h"

#include <cstring>

#include "chain/base/parameter.h"
#include "chain/plan/program_source.h"
#include "chain/vk/compiler.h"

namespace postchain::vk {
namespace {

VkDescriptorType type_of(Kind kind) {
    switch (kind) {
        case Kind::texture:
            return VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
        case Kind::image:
            return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
        case Kind::list:
            return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        case Kind::uniforms:
            break;
    }
    return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC;
}

}  // namespace

Programs::~Programs() {
    for (const auto& [text, program] : programs_) destroy(*program);
}

void Programs::destroy(const Program& program) const {
    device_.fn().DestroyPipeline(device_.handle(), program.pipeline, device_.allocator());
    device_.fn().DestroyPipelineLayout(device_.handle(), program.layout, device_.allocator());
    device_.fn().DestroyDescriptorSetLayout(device_.handle(), program.set, device_.allocator());
}

// An entry of the store: a hash of the words, and the words.
Result<Spirv> Programs::spirv_of(const ProgramKey& key) {
    ASSIGN_OR_RETURN(const auto source, program_source(key));
    const uint64_t number = program_key(source);
    if (auto words = set_.find(number)) {
        ++loaded_;
        return with_units(std::move(*words));
    }
    const std::string name = hex_of(number);
    if (store_.load) {
        const std::vector<std::byte> bytes = store_.load(name);
        uint64_t hash = 0;
        if (bytes.size() > sizeof(hash) && bytes.size() % 4 == 0) {
            std::memcpy(&hash, bytes.data(), sizeof(hash));
            const auto stored = std::span(bytes).subspan(sizeof(hash));
            std::vector<uint32_t> words(stored.size() / 4);
            std::memcpy(words.data(), stored.data(), stored.size());
            if (hash == hash_bytes(stored)) {
                ++loaded_;
                return with_units(std::move(words));
            }
        }
    }
    ASSIGN_OR_RETURN(auto words, compile(source, key.text()));
    if (store_.store) {
        const auto bytes = std::as_bytes(std::span(words));
        const uint64_t hash = hash_bytes(bytes);
        std::vector<std::byte> entry(sizeof(hash) + bytes.size());
        std::memcpy(entry.data(), &hash, sizeof(hash));
        std::memcpy(entry.data() + sizeof(hash), bytes.data(), bytes.size());
        store_.store(name, entry);
    }
    return with_units(std::move(words));
}

Status Programs::make(const Spirv& spirv, Program& program) const {
    const Functions& fn = device_.fn();
    const VkDevice device = device_.handle();
    program.units = spirv.units;
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const Unit& unit : spirv.units)
        bindings.push_back({binding_of(unit.kind, unit.number), type_of(unit.kind), 1,
                            VK_SHADER_STAGE_COMPUTE_BIT,
                            unit.kind == Kind::texture ? &sampler_ : nullptr});
    auto set = info_of<VkDescriptorSetLayoutCreateInfo>(
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    set.bindingCount = uint32_t(bindings.size());
    set.pBindings = bindings.data();
    RETURN_IF_ERROR(
        status_of(fn.CreateDescriptorSetLayout(device, &set, device_.allocator(), &program.set),
                  "vkCreateDescriptorSetLayout"));
    auto layout =
        info_of<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &program.set;
    const VkPushConstantRange pushed = {VK_SHADER_STAGE_COMPUTE_BIT, 0, kPushedBytes};
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &pushed;
    RETURN_IF_ERROR(
        status_of(fn.CreatePipelineLayout(device, &layout, device_.allocator(), &program.layout),
                  "vkCreatePipelineLayout"));
    auto code = info_of<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    code.codeSize = 4 * spirv.words.size();
    code.pCode = spirv.words.data();
    auto info =
        info_of<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.pName = "main";
    info.layout = program.layout;
    RETURN_IF_ERROR(
        status_of(fn.CreateShaderModule(device, &code, device_.allocator(), &info.stage.module),
                  "vkCreateShaderModule"));
    const VkResult made = fn.CreateComputePipelines(device, device_.cache(), 1, &info,
                                                    device_.allocator(), &program.pipeline);
    fn.DestroyShaderModule(device, info.stage.module, device_.allocator());
    return status_of(made, "vkCreateComputePipelines");
}

Result<const Program*> Programs::get(const ProgramKey& key) {
    const std::string text = key.text();
    if (const auto known = programs_.find(text); known != programs_.end())
        return known->second.get();
    const auto spirv = spirv_of(key);
    if (!spirv.ok()) return spirv.status().at(text);
    auto program = std::make_unique<Program>();
    if (Status s = make(*spirv, *program); !s.ok()) {
        destroy(*program);
        return s.at(text);
    }
    device_.name(VK_OBJECT_TYPE_PIPELINE, number_of(program->pipeline), text);
    return programs_.emplace(text, std::move(program)).first->second.get();
}

}  // namespace postchain::vk

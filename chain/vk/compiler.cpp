#include "chain/vk/compiler.h"

#if POSTCHAIN_GLSLANG
#include <glslang/Include/glslang_c_interface.h>
#include <glslang/Public/resource_limits_c.h>

#include <memory>
#endif

namespace postchain::vk {

#if POSTCHAIN_GLSLANG
Result<std::vector<uint32_t>> compile(const std::string& source, const std::string& name) {
    static const bool ready = glslang_initialize_process() != 0;
    glslang_input_t input = {};
    input.language = GLSLANG_SOURCE_GLSL;
    input.stage = GLSLANG_STAGE_COMPUTE;
    input.client = GLSLANG_CLIENT_VULKAN;
    input.client_version = GLSLANG_TARGET_VULKAN_1_2;
    input.target_language = GLSLANG_TARGET_SPV;
    input.target_language_version = GLSLANG_TARGET_SPV_1_3;
    input.code = source.c_str();
    input.default_version = 450;
    input.default_profile = GLSLANG_CORE_PROFILE;
    input.messages = glslang_messages_t(GLSLANG_MSG_SPV_RULES_BIT | GLSLANG_MSG_VULKAN_RULES_BIT);
    input.resource = glslang_default_resource();
    const std::unique_ptr<glslang_shader_t, decltype(&glslang_shader_delete)> shader(
        ready ? glslang_shader_create(&input) : nullptr, glslang_shader_delete);
    const std::unique_ptr<glslang_program_t, decltype(&glslang_program_delete)> program(
        glslang_program_create(), glslang_program_delete);
    if (!shader || !program) return Status(StatusCode::memory, "glslang: not enough memory");
    const auto fault = [&](const char* log) {
        return Status(StatusCode::gl, concat("shader ", name, " does not compile:\n", log));
    };
    if (!glslang_shader_preprocess(shader.get(), &input) ||
        !glslang_shader_parse(shader.get(), &input))
        return fault(glslang_shader_get_info_log(shader.get()));
    glslang_program_add_shader(program.get(), shader.get());
    if (!glslang_program_link(program.get(), input.messages))
        return fault(glslang_program_get_info_log(program.get()));
    glslang_program_SPIRV_generate(program.get(), GLSLANG_STAGE_COMPUTE);
    std::vector<uint32_t> words(glslang_program_SPIRV_get_size(program.get()));
    if (words.empty()) return fault("no SPIR-V");
    glslang_program_SPIRV_get(program.get(), words.data());
    return words;
}
#else
Result<std::vector<uint32_t>> compile(const std::string&, const std::string& name) {
    return Status(
        StatusCode::gl,
        concat("program ", name,
               " is not among pc_vk_create_info.programs, and this library has no "
               "compiler; make them by postchain-programs, of this version, for this chain "
               "and this kind of frame"));
}
#endif

}  // namespace postchain::vk

#include "tests/chain/executor_support.h"

#include <array>
#include <filesystem>

#include "chain/pass/work_list.h"
#include "shaders/embedded.h"
#include "tests/support/environment.h"
#include "tests/support/gpu.h"
#include "tests/support/text_file.h"

namespace postchain::test {
namespace {

namespace fs = std::filesystem;

// out = in * scale + position of the pixel in x.
const char* const kShader = R"(#version 450 core
layout(local_size_x = 16, local_size_y = 16) in;
layout(std140, binding = 0) uniform Block { float scale; } block;
layout(binding = 0) uniform sampler2D source;
layout(binding = 0) writeonly uniform image2D result;
void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(result)))) return;
    imageStore(result, p, texelFetch(source, p, 0) * block.scale + vec4(p.x, 0, 0, 0));
}
)";

struct Block {
    static constexpr const char* kName = "Block";
    float scale;
    std::array<float, 3> pad;
};

// Sorts blocks of 16 x 16 pixels by the color of their first pixel; then one step for each list.
const char* const kSort = R"(#version 450 core
#include "common/work_list.glsl"
layout(binding = 0) uniform sampler2D source;
layout(std430, binding = 0) buffer Dark { WORK_LIST } dark;
layout(std430, binding = 1) buffer Light { WORK_LIST } light;
void main() {
    ivec2 block = invocation_at();
    if (any(greaterThanEqual(kBlockPx * block, textureSize(source, 0)))) return;
    if (texelFetch(source, kBlockPx * block, 0).x < 0.5) ADD_TO_WORK_LIST(dark, block)
    else ADD_TO_WORK_LIST(light, block)
}
)";
const char* const kFill = R"(#version 450 core
#include "common/work_list.glsl"
layout(binding = 0) writeonly uniform image2D result;
void main() {
    ivec2 p;
    if (!next_pixel(imageSize(result), p)) return;
    imageStore(result, p, vec4(VALUE));
}
)";

// Writes the size of the dispatch that a pixel is in.
const char* const kCount = R"(#version 450 core
#include "common/work_group.glsl"
layout(binding = 0) writeonly uniform image2D result;
void main() {
    imageStore(result, invocation_at(), vec4(gl_NumWorkGroups.xy, group_at()));
}
)";

Plan plan_of_pass(const char* pass, int width, int height) {
    Plan plan;
    plan.width = width;
    plan.height = height;
    plan.passes = {{pass, "", false}};
    return plan;
}

}  // namespace

std::unique_ptr<TempFolder> Execute::folder_;
std::unique_ptr<Executor> Execute::executor_;

void Execute::SetUpTestSuite() {
    executor();  // a GL context
    folder_ = std::make_unique<TempFolder>();
    for (const auto& [name, text] : {std::pair("scale.comp", kShader),
                                     {"sort.comp", kSort},
                                     {"fill.comp", kFill},
                                     {"count.comp", kCount}})
        write_text(folder_->path(name), text);
    for (const auto& file : embedded_shaders()) {
        const fs::path path = folder_->path(std::string(file.path));
        fs::create_directories(path.parent_path());
        write_text(path, std::string(file.text));
    }
    executor_ = make_executor();
}

void Execute::TearDownTestSuite() {
    executor_.reset();
    folder_.reset();
}

std::unique_ptr<Executor> Execute::make_executor(const ExecutorOptions& options,
                                                 const gl::Device& device) {
    set_variable("POSTCHAIN_SHADER_DIR", folder_->path());
    auto made = std::make_unique<Executor>(device, options);
    set_variable("POSTCHAIN_SHADER_DIR", "");  // is read once, when an executor is made
    return made;
}

Plan Execute::two_steps(int width, int height, Format format) {
    Plan plan = plan_of_pass("scale", width, height);
    plan.reads = {Role::color};
    plan.textures = {{{Format::rgba32f, width, height}, "input.color", true, Role::color, 0, 0},
                     {{format, width, height}, "0.scale.a", false, Role::color, 0, 1},
                     {{Format::rgba32f, width, height}, "0.scale.b", false, Role::color, 1, 2}};
    for (int i = 0; i < 2; ++i) {
        Step step;
        step.name = i ? "b" : "a";
        step.program.file = "scale.comp";
        step.bindings = {{0, i, Access::sample_nearest}, {0, i + 1, Access::write}};
        step.set_uniforms(Block{2, {}});
        step.groups = groups_for(width, height);
        plan.steps.push_back(step);
    }
    plan.outputs[Role::color] = 2;
    return plan;
}

Plan Execute::sorted(int width, int height) {
    const auto blocks = groups_for(width, height);
    Plan plan = plan_of_pass("sort", width, height);
    plan.reads = {Role::color};
    const int most = blocks[0] * blocks[1];
    plan.textures = {{{Format::rgba32f, width, height}, "input.color", true, Role::color, 0, 0},
                     {{Format::work_list, most, 1}, "0.sort.dark", false, Role::color, 0, 1},
                     {{Format::work_list, most, 1}, "0.sort.light", false, Role::color, 0, 2},
                     {{Format::rgba32f, width, height}, "0.sort.result", false, Role::color, 1, 3}};
    Step sort;
    sort.name = "sort";
    sort.program.file = "sort.comp";
    sort.bindings = {{0, 0}, {0, 1, Access::list}, {1, 2, Access::list}};
    sort.groups = groups_for(blocks[0], blocks[1]);
    plan.steps.push_back(sort);
    for (int list : {1, 2}) {
        Step fill;
        fill.name = "fill";
        fill.program = {"fill.comp", {{"VALUE", std::to_string(list)}}};
        fill.bindings = {{0, 3, Access::write}};
        fill.groups = blocks;
        launch_by(fill, list);
        plan.steps.push_back(fill);
    }
    plan.outputs[Role::color] = 3;
    return plan;
}

Plan Execute::counted(uint64_t group_taps) {
    Plan plan = plan_of_pass("count", 7 * 16, 5 * 16);
    plan.textures = {
        {{Format::rgba32f, plan.width, plan.height}, "0.count.result", false, Role::color, 0, 1}};
    Step step;
    step.name = "count";
    step.program.file = "count.comp";
    step.bindings = {{0, 0, Access::write}};
    step.groups = {7, 5, 1};
    step.group_taps = group_taps;
    plan.steps.push_back(step);
    plan.outputs[Role::color] = 0;
    return plan;
}

}  // namespace postchain::test

// The programs that plans of random chains need, those between a guest's textures and its chain,
// and those that render scenes, as SPIR-V of the reference compiler: they are valid, agree with the
// steps that run them, and leave a device no choice of rounding where bits are promised.
//
//   POSTCHAIN_PROGRAM_CASES=1200   more chains
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>

#include "chain/base/status.h"
#include "chain/guest/chain_handle.h"
#include "chain/guest/followed_depths.h"
#include "chain/guest/frame_check.h"
#include "chain/guest/host_plan.h"
#include "chain/plan/program_source.h"
#include "shaders/shared/scene_uniforms.h"
#include "tests/elision/random_case.h"
#include "tests/elision/support.h"
#include "tests/programs/spirv.h"
#include "tests/support/gpu.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/scenes/scene.h"

namespace postchain::test {
namespace {

constexpr uint64_t kCases = 16;

// With every rule of elision and with none: by program, a step that runs it.
std::map<std::string, Step> steps_of_programs() {
    const char* more = std::getenv("POSTCHAIN_PROGRAM_CASES");
    std::map<std::string, Step> steps;
    for (uint64_t i = 0; i < (more ? std::strtoull(more, nullptr, 10) : kCases); ++i) {
        const RandomCase one = random_case(i * kCasesOfAShape / 4);
        PlanOptions all = no_rule(one.elided.precision);
        all.outputs = one.elided.outputs;
        for (PlanOptions options : {all, one.elided})
            for (const DeviceClass device : {DeviceClass::software, DeviceClass::gpu}) {
                options.device = device;
                const auto plan = make_plan(one.chain, one.frame, options);
                if (!plan.ok())
                    continue;  // a Gaussian too wide, a focus nearer than the focal length
                for (const Step& step : plan->steps) steps.emplace(step.program.text(), step);
            }
    }
    return steps;
}

// Adds the steps of a guest's plans: planes of a host in every form, and debug views.
void add_steps_of_guests(std::map<std::string, Step>& steps) {
    Chain chain;
    append(chain, "joint_blur", {{"neighbors", std::string("none")}});
    append(chain, "motion_blur", {{"mode", std::string("guertin")}});
    for (ChainLink& link : chain.links) link.matte = guest::kMask;
    std::set<std::string> views = {"", "fill"};
    for (int i = 0; i < 64; ++i) {
        pc_frame given = {};
        given.struct_size = sizeof(given);
        if (i & 1) given.flags |= PC_TOP_LEFT;
        if (i & 2) given.flags |= PC_MOTION_JITTERED;
        given.color = {1, GL_RGBA16F, 64, 48, 0, 0};
        given.depth = {2, GL_R32F, 64, 48, 0, 0};
        given.motion = {3, GL_RG32F, 64, 48, 0, 0};
        if (i & 4) given.exposure = {4, GL_R32F, 1, 1, 0, 0};
        if (i & 8) given.output = {5, GL_RGBA8, 64, 48, 0, 0};
        if (i & 32) {
            given.mask = {6, GL_R8, 64, 48, 0, 0};
            if (i & 1) given.color_slice.target = GL_TEXTURE_2D_ARRAY;
            if (i & 2) given.depth_slice.target = GL_TEXTURE_2D_ARRAY;
            if (i & 4) given.motion_slice.target = GL_TEXTURE_2D_ARRAY;
            if (i & 8) given.mask_slice.target = GL_TEXTURE_2D_ARRAY;
        }
        given.depth_encoding = i & 16 ? PC_DEPTH_INVERSE : PC_DEPTH_REVERSE_INFINITE;
        given.near_clip = 0.1f;
        given.focal_length_mm = given.sensor_width_mm = 35;
        given.f_stop = 2;
        given.focus_distance = 3;
        if (i & 2) given.view_projection[0] = given.other_view_projection[0] = 1;
        for (const std::string& view : views) {
            given.debug_view = view.c_str();
            guest::HostFrame frame;
            const auto failure = guest::check_frame(&given, frame);
            ASSERT_TRUE(failure.ok()) << failure.text;
            const auto host = guest::make_host_plan(chain, frame, DeviceClass::gpu);
            if (!host.ok()) continue;  // packed bits
            for (const Step& step : host->plan.steps) steps.emplace(step.program.text(), step);
            const Step focus = guest::focus_step(frame, 0, 1);
            steps.emplace(focus.program.text(), focus);
            if (i == 0 && view.empty())
                for (const PlanTexture& texture : host->plan.textures) views.insert(texture.name);
        }
        views = {"", "fill"};
    }
}

// Adds a step for each way in which a generated scene is rendered, with what the renderer binds.
void add_steps_of_scenes(std::map<std::string, Step>& steps) {
    constexpr auto kCells = size_t(BokehKernel::kSide) * BokehKernel::kSide;
    for (const auto& info : scenes::scenes()) {
        scenes::SceneModel model = info.make();
        for (int i = 0; i < 9; ++i) {
            if (i & 4)
                model.lens.aperture_image = *BokehKernel::make(std::vector<float>(kCells, 1.0f));
            Step step;
            step.program = scenes::program_for(model, (i & 9) != 0, (i & 2) != 0, i == 8);
            step.set_uniforms(shared::SceneUniforms{});
            for (int list = 0; list < 8; ++list)
                step.bindings.push_back({list, TextureId(list), Access::list});
            if ((i & 6) == 6) step.bindings.push_back({0, 8});
            steps.emplace(step.program.text(), step);
        }
    }
}

// Programs that no other promises to equal.
bool is_promised(const Step& step) {
    return step.program.file != "guest/debug_view.comp" &&
           step.program.file != "scenes/render.comp";
}

// Units of the step. A list that launches it is read at unit 0.
std::set<Unit> units_of(const Step& step) {
    std::set<Unit> units;
    for (const Binding& binding : step.bindings) {
        const bool image = binding.access == Access::write || binding.access == Access::read;
        const Kind kind = binding.access == Access::list ? Kind::list
                          : image                        ? Kind::image
                                                         : Kind::texture;
        units.insert({kind, uint32_t(binding.unit)});
    }
    return units;
}

std::string text_of(const Unit& unit) {
    const char* names[] = {"texture ", "image ", "list "};
    return concat(names[int(unit.kind)], unit.number);
}

Spirv spirv_of(const std::string& path) {
    const std::string bytes = read_text(path);
    std::vector<uint32_t> words(bytes.size() / 4);
    std::copy_n(bytes.data(), 4 * words.size(), reinterpret_cast<char*>(words.data()));
    return read_spirv(words);
}

TEST(Programs, AreValidAgreeWithTheirStepsAndLeaveNoChoiceOfRounding) {
    const TempFolder folder;
    auto steps = steps_of_programs();
    add_steps_of_guests(steps);
    add_steps_of_scenes(steps);
    std::set<std::string> files;
    for (const auto& [text, step] : steps) files.insert(step.program.file);
    for (const char* file : {"guest/import.comp", "guest/export.comp", "guest/debug_view.comp",
                             "guest/layer_start.comp", "guest/focus.comp", "guest/import_mask.comp",
                             "scenes/render.comp"})
        EXPECT_TRUE(files.contains(file)) << file;
    ASSERT_GT(steps.size(), 100u);
    size_t number = 0;
    std::map<std::string, std::string> names;  // by program
    for (const auto& [text, step] : steps) {
        names[text] = folder.path(concat(number++, ".comp"));
        write_text(names[text], must(program_source(step.program)));
    }
    // Both print what is wrong.
    const std::string compile =
        "cd " + folder.path() +
        " && ls *.comp | xargs -P2 -I{} sh -c "
        "'glslangValidator -G -g {} -o {}.spv >{}.log && spirv-val --target-env opengl4.5 {}.spv "
        ">>{}.log 2>&1 || { cat {}.log; exit 1; }'";
    EXPECT_EQ(std::system(compile.c_str()), 0)
        << "glslangValidator and spirv-val: tools/install_packages.sh --tests";

    std::set<std::string> contracted;
    for (const auto& [text, step] : steps) {
        SCOPED_TRACE(text);
        const Spirv spirv = spirv_of(names[text] + ".spv");
        if (is_promised(step)) {
            for (const std::string& where : spirv.contracted)
                contracted.insert(step.program.file + ": " + where);
            // Devices filter with weights of 8 bits and more.
            EXPECT_FALSE(spirv.samples);
        }
        if (step.program.file == "inverse_warp/gather.comp" &&
            !step.program.defines.contains("SOFTWARE_RENDERER")) {
            for (const std::string& name : spirv.arrays)
                EXPECT_TRUE(name == "deferred" || name == "taps")
                    << name << " is or holds an array, which a GPU may keep in memory";
        }
        const std::set<Unit> bound = units_of(step);
        EXPECT_EQ(bound.size(), step.bindings.size()) << "two bindings of one unit";
        // Its uniforms say which of its units it uses.
        for (const Unit& unit : spirv.units) {
            if (step.program.file == "guest/import.comp") continue;
            EXPECT_TRUE(bound.contains(unit)) << text_of(unit) << " is not bound";
        }
        std::map<std::string, size_t> block;
        if (!step.uniforms_type.empty()) block[step.uniforms_type] = step.uniforms.size();
        EXPECT_EQ(spirv.blocks, block);
    }
    for (const std::string& where : contracted) ADD_FAILURE() << where << " is not precise";
}

TEST(Programs, FastMathLeavesTheRoundingToTheDevice) {
    const TempFolder folder;
    const std::string path = folder.path("gather.comp");
    for (const bool fast_math : {false, true}) {
        Chain chain;
        append(chain, "motion_blur", {{"neighbors", std::string("none")}});
        FrameDescription frame;
        frame.width = 64;
        frame.height = 48;
        frame.planes = {Role::color, Role::inverse_depth, Role::motion};
        const auto plan = must(make_plan(chain, frame, {.elide = false, .fast_math = fast_math}));
        const auto gather = std::ranges::find(plan.steps, std::string("gather"), &Step::name);
        ASSERT_NE(gather, plan.steps.end());
        write_text(path, must(program_source(gather->program)));
        ASSERT_EQ(std::system(
                      concat("glslangValidator -G -g ", path, " -o ", path, ".spv >", path, ".log")
                          .c_str()),
                  0)
            << read_text(path + ".log");
        EXPECT_EQ(spirv_of(path + ".spv").contracted.empty(), !fast_math);
    }
}

}  // namespace
}  // namespace postchain::test

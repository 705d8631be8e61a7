// The programs that plans of random chains need, as SPIR-V of the reference compiler: they are
// valid, agree with the steps that run them, and leave a device no choice of rounding.
//
//   POSTCHAIN_PROGRAM_CASES=1200   more chains
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <set>

#include "chain/gl/program.h"
#include "chain/status.h"
#include "tests/elision/random_case.h"
#include "tests/elision/support.h"
#include "tests/programs/spirv.h"
#include "tests/support/temp_folder.h"

namespace postchain::test {
namespace {

constexpr uint64_t kCases = 16;

std::string read_file(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
}

// With every rule of elision and with none: by program, a step that runs it.
std::map<std::string, Step> steps_of_programs() {
    const char* more = std::getenv("POSTCHAIN_PROGRAM_CASES");
    std::map<std::string, Step> steps;
    for (uint64_t i = 0; i < (more ? std::strtoull(more, nullptr, 10) : kCases); ++i) {
        const RandomCase one = random_case(i * kCasesOfAShape / 4);
        PlanOptions all = no_rule(one.elided.precision);
        all.outputs = one.elided.outputs;
        for (const PlanOptions& options : {all, one.elided}) {
            const auto plan = make_plan(one.chain, one.frame, options);
            if (!plan.ok()) continue;  // a Gaussian too wide, a focus nearer than the focal length
            for (const Step& step : plan->steps) steps.emplace(step.program.text(), step);
        }
    }
    return steps;
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

TEST(Programs, AreValidAgreeWithTheirStepsAndLeaveNoChoiceOfRounding) {
    const TempFolder folder;
    const auto steps = steps_of_programs();
    ASSERT_GT(steps.size(), 100u);
    size_t number = 0;
    std::map<std::string, std::string> names;  // by program
    for (const auto& [text, step] : steps) {
        const auto source = gl::program_source(step.program);
        ASSERT_TRUE(source.ok()) << source.status().message();
        names[text] = folder.path(concat(number++, ".comp"));
        std::ofstream(names[text]) << *source;
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
        const std::string bytes = read_file(names[text] + ".spv");
        std::vector<uint32_t> words(bytes.size() / 4);
        std::copy_n(bytes.data(), 4 * words.size(), reinterpret_cast<char*>(words.data()));
        const Spirv spirv = read_spirv(words);
        for (const std::string& where : spirv.contracted)
            contracted.insert(step.program.file + ": " + where);
        // Devices filter with weights of 8 bits and more.
        EXPECT_FALSE(spirv.samples);
        const std::set<Unit> bound = units_of(step);
        EXPECT_EQ(bound.size(), step.bindings.size()) << "two bindings of one unit";
        for (const Unit& unit : spirv.units)
            EXPECT_TRUE(bound.contains(unit)) << text_of(unit) << " is not bound";
        std::map<std::string, size_t> block;
        if (!step.uniforms_type.empty()) block[step.uniforms_type] = step.uniforms.size();
        EXPECT_EQ(spirv.blocks, block);
    }
    for (const std::string& where : contracted) ADD_FAILURE() << where << " is not precise";
}

}  // namespace
}  // namespace postchain::test

// Programs in other languages, compiled to SPIR-V again, filter as those that they are made from.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <regex>

#include "chain/vk/program_set.h"
#include "chain/vk/spirv.h"
#include "config/chain_from_text.h"
#include "tests/programs/spirv.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/vulkan/frames.h"
#include "tests/vulkan/program_files.h"

namespace postchain::test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 40, kHeight = 24;
// Every tier, and the shipped chains with other passes or values.
const std::vector<std::string> kChains = {"tier:realtime", "tier:fast", "tier:balanced",
                                          "tier:best",     "paper",     "dof_first"};

std::string all_chains() {
    std::string names;
    for (const std::string& name : kChains) names += name + " ";
    return names;
}

pc::Chain chain_named(const std::string& name) {
    pc_chain* made = nullptr;
    const pc_result result = name.find(':') == std::string::npos
                                 ? pc_chain_shipped(name.c_str(), &made)
                                 : pc_chain_create(name.c_str(), &made);
    EXPECT_EQ(result, PC_OK) << pc_error();
    return pc::Chain(made);
}

TEST(Languages, HlslFiltersAsSpirv) {
    const TempFolder temp;
    const fs::path folder = temp.path("hlsl");
    write_programs("hlsl", folder, all_chains());
    compile_hlsl(folder);
    std::map<uint64_t, std::vector<uint32_t>> programs;
    for (const fs::path& file : files_in(folder, ".spv")) {
        auto& words = programs[std::stoull(file.stem(), nullptr, 16)];
        words = words_of(file);
        EXPECT_TRUE(read_spirv(words).contracted.empty()) << file;
    }
    const std::vector<std::byte> set = vk::ProgramSet::write(programs);
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.load_program = nullptr;
    info.store_program = nullptr;
    info.programs = set.data();
    info.programs_size = set.size();
    const auto translated = vk_instance(info);
    const auto direct = vk_instance(kWidth, kHeight);
    const auto canonical = canonical_frame(kWidth, kHeight);
    for (const std::string& name : kChains) {
        SCOPED_TRACE(name);
        const auto made = chain_named(name);
        VkFrame frame(canonical.test.planes, canonical.frame);
        const ImageF expected = filtered(direct, made, frame);
        expect_equal(filtered(translated, made, frame), expected);
        EXPECT_FALSE(equal_bits(expected, frame.color.read())) << "it did nothing";
    }
    const pc_counters counters = count(translated);
    EXPECT_GT(counters.programs, 20u);
    EXPECT_EQ(counters.programs_loaded, counters.programs);
}

TEST(Languages, GlslIsTheSourceOfTheSpirv) {
    const TempFolder temp;
    const fs::path glsl = temp.path("glsl"), spirv = temp.path("spirv");
    write_programs("glsl", glsl, all_chains());
    write_programs("spirv", spirv, all_chains());
    ASSERT_EQ(std::system(concat("cd ", glsl.string(),
                                 " && ls *.comp | sed s/.comp// | xargs -P2 -I{} sh -c '"
                                 "glslangValidator -V --target-env spirv1.3 {}.comp -o {}.spv "
                                 ">{}.log || { cat {}.log; exit 1; }; "
                                 "spirv-val --target-env vulkan1.2 ",
                                 spirv.string(), "/{}.spv'")
                              .c_str()),
              0);
    const auto files = files_in(spirv, ".spv");
    EXPECT_GT(files.size(), 50u);
    for (const fs::path& file : files)
        EXPECT_EQ(words_of(file), must(vk::with_units(words_of(glsl / file.filename()))).words)
            << file;
}

// By a compiler of C++, with a stand-in for Metal's library: names, types and arguments.
TEST(Languages, MslNamesWhatItUses) {
    const TempFolder temp;
    const fs::path folder = temp.path("msl");
    write_programs("msl", folder, "tier:realtime paper");
    static const std::regex kSwizzle(R"(([\w)\]])\.([xyzw]{2,4})\b)");
    for (const fs::path& file : files_in(folder, ".metal")) {
        std::string text = read_text(file);
        const std::string array = "template<typename T, size_t Num>\nstruct spvUnsafeArray";
        if (const size_t at = text.find(array); at != std::string::npos)
            text.erase(at, text.find("\n};\n", at) + 4 - at);
        write_text(file, std::regex_replace(text, kSwizzle, "$1.$2()"));
    }
    EXPECT_EQ(std::system(concat("cd ", folder.string(),
                                 " && ls *.metal | xargs -P2 -I{} sh -c '" CXX_COMPILER
                                 " -std=c++20 -x c++ -fsyntax-only -fsingle-precision-constant -w "
                                 "-I " POSTCHAIN_SOURCE_DIR "/tests/vulkan/metal {} 2>{}.log || "
                                 "{ grep error {}.log; exit 1; }'")
                              .c_str()),
              0);
}

}  // namespace
}  // namespace postchain::test

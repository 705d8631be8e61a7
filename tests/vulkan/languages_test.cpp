// Programs in HLSL, compiled back to SPIR-V, filter as the programs that they were made from.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <regex>

#include "chain/vk/program_set.h"
#include "config/chain_from_text.h"
#include "tests/programs/spirv.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::languages_test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 40, kHeight = 24;
// Every tier, and the shipped chains with other passes or values.
const std::vector<std::string> kChains = {"tier:realtime", "tier:fast", "tier:balanced",
                                          "tier:best",     "paper",     "dof_first"};

std::vector<uint32_t> words_of(const fs::path& file) {
    const std::string bytes = read_text(file);
    std::vector<uint32_t> words(bytes.size() / 4);
    std::copy_n(bytes.data(), 4 * words.size(), reinterpret_cast<char*>(words.data()));
    return words;
}

// Files of the programs of all chains.
void write_programs(const std::string& language, const fs::path& folder) {
    std::string command =
        concat(PROGRAMS_PROGRAM, " --format ", language, " --output ", folder.string());
    for (const std::string& name : kChains) command += " " + name;
    ASSERT_EQ(std::system((command + " 2>" + folder.string() + ".log").c_str()), 0)
        << read_text(folder.string() + ".log");
}

// Runs the command, with {} for the name of each file, for all files of the folder.
void for_each_file(const fs::path& folder, const std::string& ending, const std::string& command) {
    const std::string all =
        concat("cd ", folder.string(), " && ls *", ending, " | xargs -P2 -I{} sh -c '", command,
               " >{}.log 2>&1 || { cat {}.log; exit 1; }'");
    ASSERT_EQ(std::system(all.c_str()), 0)
        << "glslangValidator and spirv-val: tools/install_packages.sh --tests";
}

// As SPIR-V counts places: by kind, and the first group as a push constant.
void use_units_of_spirv(const fs::path& file) {
    std::string text = read_text(file);
    static const std::regex kLists(R"(register\(([tu])1([6-9]), space0\))");
    static const std::regex kFirstGroup(R"(cbuffer \w+ : register\(b1, space0\))");
    std::smatch list;
    while (std::regex_search(text, list, kLists))
        text = concat(list.prefix().str(), "register(", list[1].str(), list[2].str()[0] - '6',
                      ", space0)", list.suffix().str());
    text = std::regex_replace(text, kFirstGroup, "[[vk::push_constant]] cbuffer FirstGroup");
    write_text(file, text);
}

// A set of the files' SPIR-V, for pc_vk_create_info.programs.
std::string set_of(const fs::path& folder) {
    std::map<uint64_t, std::vector<uint32_t>> programs;
    for (const auto& file : fs::directory_iterator(folder))
        if (file.path().extension() == ".spv")
            programs[std::stoull(file.path().stem(), nullptr, 16)] = words_of(file);
    const std::vector<std::byte> set = vk::ProgramSet::write(programs);
    return std::string(reinterpret_cast<const char*>(set.data()), set.size());
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
    const TempFolder folder;
    const fs::path at = folder.path("hlsl");
    write_programs("hlsl", at);
    for (const auto& file : fs::directory_iterator(at))
        if (file.path().extension() == ".hlsl") use_units_of_spirv(file.path());
    for_each_file(at, ".hlsl",
                  "glslangValidator -D -V -e main -S comp {} -o $(basename {} .hlsl).spv && "
                  "spirv-val --target-env vulkan1.0 $(basename {} .hlsl).spv");
    for (const auto& file : fs::directory_iterator(at))
        if (file.path().extension() == ".spv") {
            EXPECT_TRUE(read_spirv(words_of(file)).contracted.empty()) << file.path();
        }

    const std::string programs = set_of(at);
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.load_program = nullptr;
    info.store_program = nullptr;
    info.programs = programs.data();
    info.programs_size = programs.size();
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

}  // namespace
}  // namespace postchain::test::languages_test

// Tests of the folder that postchain-programs writes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/vk/program_set.h"
#include "chain/vk/spirv.h"
#include "shaders/shared/fxaa_uniforms.h"
#include "shaders/shared/guest_uniforms.h"
#include "tests/programs/spirv.h"
#include "tests/support/filled_json.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/support/transcript.h"
#include "tests/vulkan/program_files.h"

namespace postchain::test {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
namespace fs = std::filesystem;

json index_of(const fs::path& folder) {
    return json::parse(read_text(folder / "index.json"));
}

// The last program of this shader.
json program_of(const json& index, const std::string& shader) {
    json found;
    for (const json& program : index.at("programs"))
        if (program.at("shader") == shader) found = program;
    return found;
}

const char* const kExpected = POSTCHAIN_SOURCE_DIR "/tests/vulkan/expected";

// Every member. The key is another one with each change of the shader, and versions of glslang
// count other operations.
void say(nlohmann::ordered_json program) {
    const std::string key = program.at("key"), file = program.at("file");
    EXPECT_TRUE(file.starts_with(key + ".")) << file;
    program["key"] = "KEY";
    program["file"] = "KEY" + file.substr(key.size());
    static const std::regex counted("(\"precise\":|\")[0-9]+(,| precise)");
    const std::string same = std::regex_replace(program.dump(), counted, "$010$2");
    Transcript::say(filled_json(nlohmann::ordered_json::parse(same)));
}

nlohmann::ordered_json in_order(const fs::path& folder, const std::string& shader) {
    const auto index = nlohmann::ordered_json::parse(read_text(folder / "index.json"));
    for (const auto& program : index.at("programs"))
        if (program.at("shader") == shader) return program;
    ADD_FAILURE() << shader;
    return {};
}

std::set<std::string> matches_of(const std::string& text, const char* pattern) {
    const std::regex expression(pattern);
    std::set<std::string> found;
    for (std::sregex_iterator match(text.begin(), text.end(), expression), end; match != end;
         ++match)
        EXPECT_TRUE(found.insert(match->str(1)).second) << match->str(1) << " twice";
    return found;
}

// Where the index says that units, uniform block and first group are.
std::set<std::string> places_of(const json& program, const char* key) {
    std::set<std::string> places;
    for (const json& unit : program.at("units"))
        EXPECT_TRUE(places.insert(unit.at(key)).second) << unit;
    for (const char* block : {"uniforms", "first_group"})
        if (!program.at(block).is_null()) places.insert(program.at(block).at(key));
    return places;
}

TEST(ProgramFiles, AreBoundAsTheIndexSays) {
    const TempFolder temp;
    const fs::path hlsl = temp.path("hlsl"), msl = temp.path("msl");
    write_programs("hlsl", hlsl, "motion_blur");
    write_programs("msl", msl, "motion_blur");
    const json of_hlsl = index_of(hlsl), of_msl = index_of(msl);
    ASSERT_GT(of_hlsl.at("programs").size(), 10u);
    ASSERT_EQ(of_msl.at("programs").size(), of_hlsl.at("programs").size());
    for (const json& program : of_hlsl.at("programs")) {
        const std::string text = read_text(hlsl / program.at("file").get<std::string>());
        EXPECT_EQ(matches_of(text, R"(register\((\w+), space0\))"), places_of(program, "register"));
        EXPECT_THAT(text, HasSubstr("void main("));
        EXPECT_EQ(program.at("shader_model"), "5.1");
        std::vector<std::string> loads;
        for (const json& unit : program.at("units"))
            if (unit.at("kind") == "image" && unit.at("access") != "write")
                loads.push_back("typed load of one uint from " +
                                unit.at("register").get<std::string>());
        EXPECT_EQ(program.at("notes"), json(loads));
        EXPECT_EQ(text.find("SamplerState"), std::string::npos);
    }
    for (const json& program : of_msl.at("programs")) {
        const std::string text = read_text(msl / program.at("file").get<std::string>());
        EXPECT_EQ(matches_of(text, R"(\[\[((?:texture|buffer)\(\d+\))\]\])"),
                  places_of(program, "argument"));
        EXPECT_THAT(text, HasSubstr("kernel void main0("));
        EXPECT_EQ(text.find("sampler "), std::string::npos);
    }

    const Transcript whole(kExpected);
    for (const fs::path& folder : {hlsl, msl}) say(in_order(folder, "common/keep.comp"));
    std::set<std::string> lines;  // keys are in another order with each change of a shader
    for (const json& program : of_msl.at("programs")) {
        std::string line = concat(program.at("shader").get<std::string>(), ": group_size ",
                                  program.at("group_size").dump(), ", shared_bytes ",
                                  program.at("shared_bytes").dump());
        for (const json& note : program.at("notes"))
            if (note.dump().find("precise") == std::string::npos) line += ", " + note.dump();
        std::set<std::string> units;
        for (const json& unit : program.at("units")) {
            std::string text = "\n ";
            for (const char* key : {"argument", "name", "access", "type"})
                text += " " + unit.at(key).get<std::string>();
            units.insert(text);
        }
        for (const std::string& unit : units) line += unit;
        lines.insert(line);
    }
    for (const std::string& line : lines) Transcript::say(line);
    const json gather = program_of(of_hlsl, "inverse_warp/gather.comp");
    const json list = {
        {"kind", "list"},    {"unit", 0},  {"name", "work_list"},        {"access", "read"},
        {"register", "t16"}, {"space", 0}, {"type", "ByteAddressBuffer"}};
    const json color = {{"kind", "texture"},          {"unit", 0},        {"name", "color"},
                        {"access", "read"},           {"register", "t0"}, {"space", 0},
                        {"type", "Texture2D<float4>"}};
    const json blurred = {{"kind", "image"},
                          {"unit", 0},
                          {"name", "blurred"},
                          {"access", "write"},
                          {"register", "u0"},
                          {"space", 0},
                          {"type", "RWTexture2D<float4>"}};
    EXPECT_THAT(gather.at("units"), IsSupersetOf({list, color, blurred}));
    const json filled = {{"kind", "list"},         {"unit", 1},        {"name", "still_blocks"},
                         {"access", "read_write"}, {"type", "device"}, {"argument", "buffer(3)"}};
    EXPECT_THAT(program_of(of_msl, "inverse_warp/starts.comp").at("units"), Contains(filled));
}

TEST(ProgramFiles, TheIndexHasTheLayoutOfTheUniformBlock) {
    const TempFolder temp;
    const fs::path folder = temp.path("spirv");
    write_programs("spirv", folder, "fxaa");
    const json index = index_of(folder);
    const json fxaa = program_of(index, "fxaa/fxaa.comp");
    const Transcript whole(kExpected);
    say(in_order(folder, "fxaa/fxaa.comp"));
    const fs::path glsl = temp.path("glsl");
    write_programs("glsl", glsl, "fxaa");
    say(in_order(glsl, "fxaa/luma.comp"));
    const json block = fxaa.at("uniforms");
    EXPECT_EQ(block.at("name"), shared::FxaaUniforms::kName);
    EXPECT_EQ(block.at("bytes"), sizeof(shared::FxaaUniforms));
    EXPECT_EQ(block.at("binding"), 48);
    const auto member = [](const char* name, const char* type, size_t offset) {
        return json{{"name", name}, {"type", type}, {"offset", offset}};
    };
    using shared::FxaaUniforms;
    using shared::GuestUniforms;
    json walk = member("walk", "ivec4", offsetof(FxaaUniforms, walk));
    walk.update({{"count", 3}, {"stride", 16}});
    const json of_fxaa[] = {member("size", "ivec2", offsetof(FxaaUniforms, size)),
                            member("subpix", "float", offsetof(FxaaUniforms, subpix)),
                            member("hint_gate", "int", offsetof(FxaaUniforms, hint_gate)),
                            member("luma_weights", "vec4", offsetof(FxaaUniforms, luma_weights)),
                            walk};
    EXPECT_THAT(block.at("members"), IsSupersetOf(of_fxaa));
    EXPECT_EQ(block.at("members").size(), 9u);
    const json import = program_of(index, "guest/import.comp");
    EXPECT_EQ(import.at("uniforms").at("bytes"), sizeof(GuestUniforms));
    EXPECT_THAT(import.at("uniforms").at("members"),
                Contains(member("sky_y", "vec4", offsetof(GuestUniforms, sky_y))));
}

// Each option adds the programs that its frames alone need.
TEST(ProgramFiles, EachOptionAddsItsPrograms) {
    struct Case {
        const char *option, *chain, *program;
    };
    constexpr Case kCases[] = {{"mask", "fxaa", "guest/import_mask.comp "},
                               {"exposure", "fxaa", "guest/export.comp EXPOSURE=1"},
                               {"before", "motion_blur", "gather.comp AFTER=0 BARREL=0 BEFORE=1"},
                               {"after", "motion_blur", "gather.comp AFTER=1 BARREL=0 BEFORE=0"},
                               {"half-resolution", "motion_blur", "guest/export_half.comp "},
                               {"fast-math", "fxaa", " precise="}};
    const TempFolder temp;
    for (const Case& one : kCases) {
        const fs::path folder = temp.path(one.option);
        write_programs("glsl", folder, concat("--", one.option, " ", one.chain));
        for (const Case& other : kCases) {
            const json index = index_of(folder);
            const bool has = std::ranges::any_of(index.at("programs"), [&](const json& program) {
                return program.at("name").get<std::string>().find(other.program) !=
                       std::string::npos;
            });
            EXPECT_EQ(has, other.option == one.option) << one.option << ", " << other.option;
        }
    }
}

TEST(ProgramFiles, HaveTheProgramsOfTheSet) {
    const TempFolder temp;
    const fs::path folder = temp.path("spirv");
    write_programs("spirv", folder, "fxaa");
    const std::string set = temp.path("set");
    ASSERT_EQ(run_programs("fxaa >" + set, temp.path("log")), 0);
    const std::string bytes = read_text(set);
    const auto programs = must(vk::ProgramSet::read(std::as_bytes(std::span(bytes))));
    const json index = index_of(folder);
    EXPECT_EQ(index.at("language"), "spirv");
    for (const json& program : index.at("programs")) {
        const std::string key = program.at("key");
        EXPECT_EQ(program.at("file"), key + ".spv");
        const auto words = programs.find(std::stoull(key, nullptr, 16));
        ASSERT_TRUE(words);
        EXPECT_EQ(must(vk::with_units(*words)).words, words_of(folder / (key + ".spv")));
    }
}

// A compiler of HLSL may not fuse what one of GLSL may not.
TEST(ProgramFiles, OfHlslAreAsPrecise) {
    const TempFolder temp;
    const fs::path folder = temp.path("hlsl");
    write_programs("hlsl", folder, "fxaa");
    compile_hlsl(folder);
    const auto files = files_in(folder, ".spv");
    EXPECT_GE(files.size(), 3u);
    for (const fs::path& file : files)
        EXPECT_TRUE(read_spirv(words_of(file)).contracted.empty()) << file;
}

TEST(ProgramFiles, ReplaceOnlyTheirOwn) {
    const TempFolder temp;
    const fs::path folder = temp.path("own"), foreign = temp.path("foreign");
    const std::string log = temp.path("log");
    const auto names = [](const fs::path& at) {
        std::set<std::string> found;
        for (const auto& file : fs::directory_iterator(at)) found.insert(file.path().filename());
        return found;
    };
    write_programs("glsl", folder, "fxaa");
    write_programs("msl", folder, "depth_of_field");
    std::set<std::string> listed = {"index.json", ".postchain-programs"};
    const json index = index_of(folder);
    for (const json& program : index.at("programs")) listed.insert(program.at("file"));
    EXPECT_EQ(names(folder), listed);

    fs::create_directory(foreign);
    write_text(foreign / "mine.txt", "mine");
    const std::string into = "--format glsl --output " + foreign.string();
    EXPECT_EQ(run_programs(into + " fxaa", log), 5);
    EXPECT_THAT(read_text(log), HasSubstr("name another with --output"));
    EXPECT_EQ(names(foreign), std::set<std::string>{"mine.txt"});

    const Transcript whole(kExpected);
    const std::string fresh = temp.path("fresh");
    for (const auto& [words, message] :
         {std::pair("--output " + fresh, "--format and --output go together"),
          std::pair(std::string("--format hlsl"), "--format and --output go together"),
          std::pair("--format dxil --output " + fresh, "known are spirv, hlsl, msl, glsl"),
          std::pair("--format hlsl --output " + fresh + " fxa", "fxaa"),
          std::pair(std::string("--format"), "--format needs a value")}) {
        EXPECT_EQ(run_programs(words, log), 2) << words;
        EXPECT_THAT(read_text(log), HasSubstr(message));
        Transcript::say(read_text(log));
    }
    EXPECT_FALSE(fs::exists(fresh));
}

}  // namespace
}  // namespace postchain::test

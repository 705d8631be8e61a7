#include "chain/gl/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <span>
#include <vector>

#include "chain/base/status.h"
#include "chain/gl/device.h"
#include "chain/plan/program_source.h"
#include "tests/guest/gl_calls.h"
#include "tests/support/environment.h"
#include "tests/support/gpu.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

namespace postchain {
namespace {

using ::testing::HasSubstr;

const std::string kVersion = "#version 450 core\n", kInclude = "#include \"common/value.glsl\"\n",
                  kValue = "float value() { return 1.0; }\n",
                  kBody =
                      "layout(local_size_x = 1) in;\n"
                      "layout(binding = 0) writeonly uniform image2D result;\n"
                      "void main() { imageStore(result, ivec2(0), vec4(value())); }\n";

// A shader folder of its own, in development mode.
class Programs : public ::testing::Test {
  protected:
    void SetUp() override {
        test::executor();  // a GL context
        std::filesystem::create_directories(folder_.path("common"));
        test::set_variable("POSTCHAIN_SHADER_DIR", folder_.path());
        test::GlCalls::start();
    }
    void TearDown() override {
        test::GlCalls::stop();
        EXPECT_EQ(test::GlCalls::objects(), 0) << "an object outlives its cache";
        test::set_variable("POSTCHAIN_SHADER_DIR", "");
    }
    void write(const std::string& name, const std::string& text) {
        test::write_text(folder_.path(name), kVersion + text);
    }
    const test::TempFolder folder_;
};

// A line as the device's compiler writes it: Mesa, or NVIDIA.
std::string line_of(int line) {
    return gl::describe_current().software ? concat(":", line) : concat("(", line, ")");
}

TEST_F(Programs, IncludesAndDefinesReachTheCompiler) {
    test::write_text(folder_.path("common/value.glsl"), "float value() { return FACTOR; }\n");
    write("a.comp", kInclude + kBody);
    gl::ProgramCache cache({}, gl::shader_folder_of_environment());
    const auto program = test::must(cache.get({"a.comp", {{"FACTOR", "2.0"}}}));
    EXPECT_EQ(*cache.get({"a.comp", {{"FACTOR", "2.0"}}}), program) << "compiled once";
    EXPECT_EQ(cache.compiled(), 1u);
    ASSERT_TRUE(cache.get({"a.comp", {{"FACTOR", "3.0"}}}).ok());
    EXPECT_EQ(cache.compiled(), 2u);
}

TEST_F(Programs, CompileErrorNamesTheIncludedFileAndItsLine) {
    test::write_text(folder_.path("common/value.glsl"),
                     "// one\n// two\nfloat value() { return oops; }\n");
    write("a.comp", kInclude + kBody);
    gl::ProgramCache cache({}, gl::shader_folder_of_environment());
    auto program = cache.get({"a.comp", {}});
    ASSERT_FALSE(program.ok());
    EXPECT_EQ(program.status().code(), StatusCode::gl);
    EXPECT_THAT(program.status().message(), HasSubstr("common/value.glsl" + line_of(3)));
}

TEST_F(Programs, LinkErrorHasTheLog) {
    write("a.comp", "float value();\n" + kBody);
    gl::ProgramCache cache({}, gl::shader_folder_of_environment());
    EXPECT_THAT(test::error_of(cache.get({"a.comp", {}})), HasSubstr("value"));
}

TEST_F(Programs, MissingIncludeAndCircleNamePlace) {
    const std::pair<const char*, const char*> rows[] = {{"common/none.glsl", "a.comp:2"},
                                                        {"common/none.glsl", "none.glsl"},
                                                        {"a.comp", "includes itself"}};
    for (const auto& [file, words] : rows) {
        write("a.comp", concat("#include \"", file, "\"\n"));
        EXPECT_THAT(test::error_of(resolve_includes("a.comp", folder_.path())), HasSubstr(words));
    }
}

TEST_F(Programs, FailedReloadKeepsTheLastGoodProgram) {
    write("a.comp", kValue + kBody);
    std::vector<std::string> said;
    gl::ProgramCache cache([&](const std::string& text) { said.push_back(text); },
                           gl::shader_folder_of_environment());
    const auto good = test::must(cache.get({"a.comp", {}}));
    write("a.comp", "broken;\n" + kBody);
    const auto kept = test::must(cache.get({"a.comp", {}}));
    EXPECT_EQ(kept, good);
    ASSERT_TRUE(cache.get({"a.comp", {}}).ok());
    ASSERT_EQ(said.size(), 1u) << "said once";
    EXPECT_THAT(said[0], HasSubstr("a.comp" + line_of(2)));
    write("a.comp", kValue + "// changed\n" + kBody);
    ASSERT_TRUE(cache.get({"a.comp", {}}).ok());
    EXPECT_EQ(cache.compiled(), 2u) << "a good change is compiled";
    const auto last = test::must(cache.get({"a.comp", {}}));
    std::filesystem::remove(folder_.path("a.comp"));
    EXPECT_EQ(test::must(cache.get({"a.comp", {}})), last);
    EXPECT_EQ(said.size(), 2u);
}

// Beside others, before it or behind it.
TEST_F(Programs, BlockOfTheProgram) {
    const std::string block =
        "layout(std140, binding = 0) uniform Sizes { ivec2 size; float edge; } block;\n";
    const std::string other =
        "layout(std140, binding = 1) uniform Other { vec4 more[9]; } other;\n";
    write("none.comp", kValue + kBody);
    write("other.comp", other + kValue + kBody);
    for (const std::string& blocks : {block, block + other, other + block}) {
        write("a.comp", blocks + kValue + kBody);
        gl::ProgramCache cache({}, gl::shader_folder_of_environment());
        const auto with = test::must(cache.get({"a.comp", {}}));
        EXPECT_EQ(with.uniforms_type, "Sizes");  // also if nothing reads it
        EXPECT_EQ(with.uniforms_bytes, 16u);
        for (const char* file : {"none.comp", "other.comp"}) {
            const auto without = test::must(cache.get({file, {}}));
            EXPECT_EQ(without.uniforms_type, "");
            EXPECT_EQ(without.uniforms_bytes, 0u);
        }
    }
}

// Binaries of embedded programs alone: files of a folder may change.
TEST_F(Programs, BinariesAreOfEmbeddedPrograms) {
    write("a.comp", kValue + kBody);
    std::map<std::string, std::vector<std::byte>> stored;
    int asked = 0;
    const ProgramStore store = {[&](const std::string& key) {
                                    ++asked;
                                    return stored[key];
                                },
                                [&](const std::string& key, std::span<const std::byte> bytes) {
                                    stored[key].assign(bytes.begin(), bytes.end());
                                }};
    gl::ProgramCache from_folder({}, gl::shader_folder_of_environment());
    from_folder.use_binaries(store, "device");
    ASSERT_TRUE(from_folder.get({"a.comp", {}}).ok());
    EXPECT_EQ(asked, 0);
    EXPECT_TRUE(stored.empty());
    const ProgramKey embedded = {"guest/export.comp", {{"EXPOSURE", "0"}}};
    for (const size_t loaded : {0u, 1u}) {
        gl::ProgramCache cache;
        cache.use_binaries(store, "device");
        ASSERT_TRUE(cache.get(embedded).ok());
        EXPECT_EQ(cache.loaded(), loaded);
        EXPECT_EQ(cache.compiled(), 1u);
        EXPECT_EQ(stored.size(), 1u);
    }
    gl::ProgramCache begun;  // and never finished
    begun.begin(embedded);
}

TEST_F(Programs, TheFolderIsReadFromTheEnvironmentOnce) {
    write("a.comp", kValue + kBody);
    gl::ProgramCache from_folder({}, gl::shader_folder_of_environment());
    test::set_variable("POSTCHAIN_SHADER_DIR", "");
    gl::ProgramCache embedded({}, gl::shader_folder_of_environment());
    EXPECT_TRUE(from_folder.get({"a.comp", {}}).ok());
    EXPECT_FALSE(embedded.get({"a.comp", {}}).ok());
    write("a.comp", "float value() { return 2.0; }\n" + kBody);
    EXPECT_TRUE(from_folder.get({"a.comp", {}}).ok());
    EXPECT_EQ(from_folder.compiled(), 2u) << "still the folder's";
}

}  // namespace
}  // namespace postchain

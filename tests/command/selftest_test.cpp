// postchain selftest passes on this device, and fails if a shader is wrong.
#include "tests/command/fixture.h"

namespace postchain::test::selftest_test {
namespace {

namespace fs = std::filesystem;

class SelftestTest : public CommandTest {
  protected:
    // This build's shaders with one line of one shader replaced.
    Launch with_shader(const std::string& file, const std::string& from, const std::string& to) {
        const std::string folder = at("shaders");
        fs::remove_all(folder);
        fs::copy(POSTCHAIN_SHADERS, folder, fs::copy_options::recursive);
        std::string text = read_text(folder + "/" + file);
        const size_t place = text.find(from);
        EXPECT_NE(place, std::string::npos) << file;
        if (place != std::string::npos) text.replace(place, from.size(), to);
        write_text(folder + "/" + file, text);
        Launch launch;
        launch.environment["POSTCHAIN_SHADER_DIR"] = folder;
        launch.environment["TMPDIR"] = at("out");
        return launch;
    }
};

TEST_F(SelftestTest, PassesAndLeavesNoFile) {
    Launch launch;
    launch.environment["TMPDIR"] = at("out");
    expect_prints(run({"selftest", "--only", "fxaa"}, launch), 0,
                  {"postchain ", "fxaa            ok", "passed"});
    const auto json = run({"selftest", "--only", "w*read", "--json"}, launch);
    EXPECT_EQ(json.code, 0) << json.text();
    const Json object = json_lines(json.out).at(0);
    EXPECT_FALSE(object["renderer"].get<std::string>().empty());
    ASSERT_EQ(object["tests"].size(), 1u);
    EXPECT_EQ(object["tests"][0]["test"], "write and read");
    EXPECT_EQ(object["tests"][0]["ok"], true);
    EXPECT_TRUE(fs::is_empty(at("out")));
    EXPECT_EQ(run({"selftest", "--only", "nothing"}).code, 2);
}

TEST_F(SelftestTest, AFolderThatCannotBeWrittenFails) {
    Launch launch;
    launch.environment["TMPDIR"] = at("none");
    expect_prints(run({"selftest", "--only", "write"}, launch), 7, {"write and read  FAILED"});
}

TEST_F(SelftestTest, AWrongShaderIsFoundAndItsPassNamed) {
    const char* stored = "STORE(result_plane, p, ";
    expect_prints(run({"selftest", "--only", "fxaa"},
                      with_shader("fxaa/fxaa.comp", stored, "STORE(result_plane, p, 1.01 * ")),
                  7, {"fxaa            FAILED", "reference"});
    // A shader that does not compile is a fault of its pass too.
    const auto broken =
        run({"selftest", "--only", "fxaa", "--json"},
            with_shader("fxaa/fxaa.comp", stored, "no_such_call(result_plane, p, "));
    EXPECT_EQ(broken.code, 7) << broken.text();
    const Json test = json_lines(broken.out).at(0)["tests"].at(0);
    EXPECT_EQ(test["ok"], false);
    EXPECT_TRUE(contains(test["faults"].dump(), "fxaa.comp")) << test;
}

}  // namespace
}  // namespace postchain::test::selftest_test

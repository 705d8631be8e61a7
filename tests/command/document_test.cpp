// Generated documents match the program. After a change of tables or options run
// tools/update_expected.sh:
//
//   postchain passes --markdown -> docs/parameters.md below its introduction
#include "tests/command/fixture.h"

namespace postchain::test::document_test {
namespace {

const std::string kRoot = POSTCHAIN_SOURCE_DIR;
const char* kRemedy = "run tools/update_expected.sh";

TEST(Documents, ParametersAreTheProgramsOwn) {
    const auto passes = run({"passes", "--markdown"});
    const std::string document = read_text(kRoot + "/docs/parameters.md");
    ASSERT_TRUE(document.starts_with("# Parameters\n"));
    EXPECT_TRUE(document.ends_with("\n\n" + passes.out))
        << "docs/parameters.md is out of date; " << kRemedy;
}

TEST(Documents, CameraMetadataIsTheProgramsOwn) {
    const auto table = run({"inspect", "--camera-metadata"});
    ASSERT_TRUE(table.out.starts_with("| value |")) << table.text();
    EXPECT_TRUE(read_text(kRoot + "/docs/profiles.md").ends_with("\n\n" + table.out))
        << "docs/profiles.md is out of date; " << kRemedy;
}

std::string help_of(const std::string& subcommand, const std::string& option) {
    const auto lines = matches(run({subcommand, "--help"}).out, "\n  (" + option + "[ {][^\n]*)");
    EXPECT_EQ(lines.size(), 1u) << subcommand << " " << option;
    return lines.empty() ? "" : lines[0];
}

TEST(Documents, EveryMetricAndRuleHasItsPage) {
    const std::string metrics = read_text(kRoot + "/docs/metrics.md");
    const auto names = matches(help_of("diff", "--metric"), "[:,] ([a-z0-9_]+) \\(");
    EXPECT_GE(names.size(), 10u);
    for (const auto& name : names)
        EXPECT_TRUE(contains(metrics, "| `" + name + "` |"))
            << name << " is not in docs/metrics.md";
    const std::string architecture = read_text(kRoot + "/docs/architecture.md");
    const auto rules = matches(help_of("plan", "--no-elide") + help_of("plan", "--elide"),
                               "\\b([a-z]+_[a-z_]+)\\b");
    EXPECT_GE(rules.size(), 10u);
    for (const auto& rule : rules)
        EXPECT_TRUE(contains(architecture, "| `" + rule + "` |"))
            << rule << " is not in docs/architecture.md";
}

// ```yaml blocks that start a chain file must plan without complaints about the chain.
void check_chains_of(const std::string& path, int at_least) {
    TempFolder folder;
    const std::string document = read_text(path);
    write_frame(folder.path("in.0001.exr"), make_planes(24, 16));
    int count = 0;
    for (size_t i = document.find("```yaml\n"); i != std::string::npos;
         i = document.find("```yaml\n", i + 1)) {
        const size_t begin = i + 8;
        const std::string text = document.substr(begin, document.find("```", begin) - begin);
        if (!contains(text, "postchain: 1")) continue;
        ++count;
        write_text(folder.path("chain.yaml"), text);
        expect_ends(run({"plan", folder.path("chain.yaml"), "-i", folder.path("in.0001.exr"),
                         "--set", "camera.focal_length_mm=50", "--set", "camera.sensor_width_mm=36",
                         "--set", "camera.f_stop=2", "--set", "camera.focus_distance=2"}),
                    0);
    }
    EXPECT_GE(count, at_least) << path;
}

TEST(Documents, ChainsInDocumentsParse) {
    check_chains_of(kRoot + "/docs/chain_file.md", 1);
    if (std::filesystem::exists(kRoot + "/README.md")) check_chains_of(kRoot + "/README.md", 1);
}

}  // namespace
}  // namespace postchain::test::document_test

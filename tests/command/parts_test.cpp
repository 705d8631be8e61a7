// Subcommands that other programs have: the command starts them, completes them, and
// docs/command.md has them all.
#include <set>

#include "tests/command/completion.h"

namespace postchain::test::parts_test {
namespace {

TEST(Parts, EveryVerbAndOptionIsInCommandMd) {
    const std::string document = read_text(std::string(POSTCHAIN_SOURCE_DIR) + "/docs/command.md");
    ASSERT_NE(document, "");
    const std::string help = run({"--help"}).out;
    EXPECT_FALSE(contains(help, "Subcommands:")) << "a subcommand without a group";
    const auto subcommands = matches(help, "\n  ([a-z]+) ");
    ASSERT_GE(subcommands.size(), 9u);
    std::set<std::string> options;
    for (const auto& subcommand : subcommands) {
        EXPECT_TRUE(contains(document, "postchain " + subcommand))
            << subcommand << " is not in docs/command.md";
        for (const auto& name :
             matches(run({subcommand, "--help"}).out, "\n  (?:-[a-z],)?(--[a-z-]+)"))
            options.insert(name);
    }
    // The first block of the document lists the subcommands as the help does.
    const size_t begin = document.find("\n```\n") + 5;
    const std::string block = document.substr(begin, document.find("\n```\n", begin) - begin);
    EXPECT_EQ(matches(block, "postchain ([a-z]+)"), subcommands);
    const std::string list = help.substr(help.find("--version"));
    for (const auto& group : matches(list, "\n([A-Z][a-z ]+):\n"))
        EXPECT_TRUE(contains(block, group)) << group;
    EXPECT_GE(options.size(), 25u);
    for (const auto& option : options)
        EXPECT_TRUE(contains(document, option)) << option << " is not in docs/command.md";
    // The reverse: the document names only existing options and subcommands.
    for (const auto& name : matches(document, "(--[a-z][a-z-]*)"))
        EXPECT_TRUE(options.count(name) || name == "--version" || name == "--help") << name;
    for (const auto& name : matches(document, "postchain ([a-z]+)\\b"))
        EXPECT_EQ(std::count(subcommands.begin(), subcommands.end(), name), 1)
            << "postchain " << name;
    for (const char* code : {"0", "1", "2", "3", "4", "5", "6", "7", "8", "130", "143"})
        EXPECT_TRUE(contains(document, std::string("| ") + code + " |")) << "exit code " << code;
}

using Words = std::set<std::string>;
using PartsCompletion = Completion;

TEST_F(PartsCompletion, IsThatOfTheirPrograms) {
    EXPECT_EQ(offered({"postchain", "scene", "whe"}), Words{"wheels"});
    EXPECT_EQ(offered({"postchain", "scene", "--tru"}), (Words{"--truth", "--truth-samples"}));
    EXPECT_EQ(offered({"postchain", "ab", "paper", "--on-existing", ""}),
              (Words{"fail", "overwrite"}));
    EXPECT_EQ(offered({"postchain", "serve", "--farm-fo"}), Words{"--farm-folder"});
}

// The command alone in a folder.
TEST(Parts, AMissingProgramIsNamedWithItsPackage) {
    TempFolder folder;
    const std::string command = folder.path("postchain");
    std::filesystem::copy_file(with_command({})[0], command);
    for (const auto& [subcommand, package] : {std::pair{"ab", "postchain-lab"},
                                              {"tune", "postchain-lab"},
                                              {"scene", "postchain-lab"},
                                              {"serve", "postchain-serve"},
                                              {"view", "postchain-view"}}) {
        const Outcome outcome = run_program({command, subcommand, "--help"});
        expect_ends(outcome, 2,
                    {concat(folder.path(package), ": cannot be started"),
                     concat("install the package ", package)});
        EXPECT_EQ(outcome.out, "");
        EXPECT_TRUE(contains(run_program({command, "--help"}).out, concat("\n  ", subcommand)));
    }
    // Its own subcommands need no part.
    EXPECT_EQ(run_program({command, "passes"}).code, 0);
}

// Words, exit code and streams are those of the part's program.
TEST(Parts, AreStartedWithTheirWords) {
    const Outcome missing = run({"ab", "paper"});
    expect_ends(missing, 2, {"postchain ab --help"});
    expect_ends(run({"scene", "nothing", "-o", "x"}), 2, {"nothing"});
    EXPECT_TRUE(contains(run({"serve", "--help"}).out, "Usage: postchain serve"));
}

}  // namespace
}  // namespace postchain::test::parts_test

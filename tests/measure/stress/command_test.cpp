// `postchain stress` as a command: its outputs, independence of the thread count, and errors.
#include <gtest/gtest.h>

#include <set>

#include "passes/registry.h"
#include "tests/command/command.h"

namespace postchain::stress {
namespace {

test::Outcome command(test::Arguments arguments, const test::Launch& launch = {}) {
    arguments.insert(arguments.begin(), "stress");
    return test::run(arguments, launch);
}

TEST(StressCommand, WritesTableAndJsonOfTheCellsAskedFor) {
    const test::TempFolder folder;
    const auto outcome = command({"--only", "/size/1x1/", "--json", "-o", folder.path("made")});
    EXPECT_EQ(outcome.code, 0) << outcome.out;
    const auto json = nlohmann::json::parse(outcome.out);
    // Every pass and two orders, two precisions.
    EXPECT_EQ(json["cells"].size(), 2 * (builtin_passes().types().size() + 2));
    EXPECT_EQ(json["failed"], 0);
    EXPECT_EQ(json["checks"], json["ok"].get<int>() + json["limits"].get<int>());
    EXPECT_EQ(json["cells"][0]["checks"][0]["verdict"], "ok");
    EXPECT_EQ(test::read_text(folder.path("made/stress.json")), outcome.out);
    const std::string page = test::read_text(folder.path("made/index.html"));
    EXPECT_NE(page.find(concat("\"cells\":", json["cells"].size(), ",")), std::string::npos);
    EXPECT_NE(page.find("\"postchain stress --only '/size/1x1/'\""), std::string::npos);
    EXPECT_EQ(test::read_text(folder.path("made/stress.txt")),
              command({"--only", "/size/1x1/"}).out);
}

// Outputs and results are identical for any number of threads, which the software renderer reads
// from its environment once, when the context is created.
TEST(StressCommand, BitsDoNotDependOnTheNumberOfThreads) {
    // 97x61: 28 work groups, which no thread count divides evenly. The default run covers every
    // pass, paper and dof_first; the others are the remaining shipped chains.
    for (test::Arguments arguments :
         std::vector<test::Arguments>{{"--only", "/size/97x61/"},
                                      {"fast", "--only", "/size/97x61/fp16"},
                                      {"best", "--only", "/size/41x31/fp32"}}) {
        arguments.insert(arguments.end(), {"--json", "--device", "software"});
        std::set<std::string> outputs;
        for (const char* threads : {"1", "2", "8"}) {
            const auto outcome = command(arguments, {.environment = {{"LP_NUM_THREADS", threads}}});
            EXPECT_EQ(outcome.code, 0) << outcome.text();
            EXPECT_NE(outcome.out.find("\"bits\":\""), std::string::npos);
            outputs.insert(outcome.out);
        }
        EXPECT_EQ(outputs.size(), 1u) << arguments[0];
    }
}

TEST(StressCommand, OneChainWithSettingsAndErrors) {
    const auto one =
        command({"fast", "--set", "joint_blur.samples=5", "--only", "fast/size/41x31"});
    EXPECT_EQ(one.code, 0) << one.out;
    EXPECT_NE(one.out.find("2 cells"), std::string::npos) << one.out;
    EXPECT_EQ(command({"--only", "no such cell"}).code, 2);
    EXPECT_EQ(command({"no_such_chain"}).code, 3);
    EXPECT_EQ(command({"--only", "/size/1x1/fp16", "-o", "/dev/null/x"}).code, 5);
}

}  // namespace
}  // namespace postchain::stress

// `postchain stress` as a command: its outputs, independence of the thread count, and errors.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "chain/status.h"
#include "passes/registry.h"

namespace postchain::stress {
namespace {

struct Outcome {
    int code = -1;
    std::string out;
};

Outcome command(const std::string& arguments, const std::string& environment = "") {
    Outcome outcome;
    const std::string line =
        concat(environment, " ", POSTCHAIN_COMMAND, " stress ", arguments, " 2>/dev/null");
    FILE* pipe = popen(line.c_str(), "r");
    if (!pipe) return outcome;
    char buffer[4096];
    for (size_t n; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) outcome.out.append(buffer, n);
    const int status = pclose(pipe);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome;
}

std::string read(const std::filesystem::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

TEST(StressCommand, WritesTableAndJsonOfTheCellsAskedFor) {
    const auto folder = std::filesystem::path(testing::TempDir()) / concat("stress", getpid());
    const auto outcome = command("--only '/size/1x1/' --json -o " + (folder / "made").string());
    EXPECT_EQ(outcome.code, 0) << outcome.out;
    const auto json = nlohmann::json::parse(outcome.out);
    // Every pass and two orders, two precisions.
    EXPECT_EQ(json["cells"].size(), 2 * (builtin_passes().types().size() + 2));
    EXPECT_EQ(json["failed"], 0);
    EXPECT_EQ(json["checks"], json["ok"].get<int>() + json["limits"].get<int>());
    EXPECT_EQ(json["cells"][0]["checks"][0]["verdict"], "ok");
    EXPECT_EQ(read(folder / "made/stress.json"), outcome.out);
    const std::string page = read(folder / "made/index.html");
    EXPECT_NE(page.find(concat("\"cells\":", json["cells"].size(), ",")), std::string::npos);
    EXPECT_NE(page.find("\"postchain stress --only '/size/1x1/'\""), std::string::npos);
    EXPECT_EQ(read(folder / "made/stress.txt"), command("--only '/size/1x1/'").out);
    std::filesystem::remove_all(folder);
}

// Outputs and results are identical for any number of threads, which the software renderer reads
// from its environment once, when the context is created.
TEST(StressCommand, BitsDoNotDependOnTheNumberOfThreads) {
    // 97x61: 28 work groups, which no thread count divides evenly. The default run covers every
    // pass, paper and dof_first; the others are the remaining shipped chains.
    for (const char* arguments : {"--only '/size/97x61/'", "fast --only '/size/97x61/fp16'",
                                  "best --only '/size/41x31/fp32'"}) {
        std::set<std::string> outputs;
        for (const char* threads : {"1", "2", "8"}) {
            const auto outcome = command(std::string(arguments) + " --json --device software",
                                         concat("LP_NUM_THREADS=", threads));
            EXPECT_EQ(outcome.code, 0) << arguments << "\n" << outcome.out;
            EXPECT_NE(outcome.out.find("\"bits\":\""), std::string::npos);
            outputs.insert(outcome.out);
        }
        EXPECT_EQ(outputs.size(), 1u) << arguments;
    }
}

TEST(StressCommand, OneChainWithSettingsAndErrors) {
    const auto one = command("fast --set joint_blur.samples=5 --only 'fast/size/41x31'");
    EXPECT_EQ(one.code, 0) << one.out;
    EXPECT_NE(one.out.find("2 cells"), std::string::npos) << one.out;
    EXPECT_EQ(command("--only 'no such cell'").code, 2);
    EXPECT_EQ(command("--set motion_blur.samples=5").code, 2);
    EXPECT_EQ(command("no_such_chain").code, 3);
    EXPECT_EQ(command("--only /size/1x1/fp16 -o /dev/null/x").code, 5);
}

}  // namespace
}  // namespace postchain::stress

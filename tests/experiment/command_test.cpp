// The command as a process: exit codes, and a bench that is killed.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/experiment/support.h"

namespace postchain::experiment {

using namespace report;
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string read(const std::string& path) {
    std::ifstream file(path);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

class Command : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 1, 2);
        test::write_truth(folder_.path(), "truth", 1, 2, 0.125f);
        std::ofstream(folder_.path("chain.yaml")) << test::kChainText;
        std::ofstream(folder_.path("other.yaml")) << test::kOtherOrderText;
    }

    // `file_limit`: maximum bytes per file, to simulate a full disk; 0 = none.
    pid_t start(const std::vector<std::string>& arguments, rlim_t file_limit = 0) {
        const pid_t pid = fork();
        if (pid != 0) return pid;
        const int log = open(folder_.path("log").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
        dup2(log, STDOUT_FILENO);
        dup2(log, STDERR_FILENO);
        if (file_limit > 0) {
            const rlimit limit{file_limit, file_limit};
            setrlimit(RLIMIT_FSIZE, &limit);
        }
        std::vector<char*> argv = {const_cast<char*>(POSTCHAIN_COMMAND)};
        for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
        argv.push_back(nullptr);
        execv(POSTCHAIN_COMMAND, argv.data());
        _exit(127);
    }
    int wait(pid_t pid) {
        int status = 0;
        waitpid(pid, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    }
    int run(const std::vector<std::string>& arguments, rlim_t file_limit = 0) {
        return wait(start(arguments, file_limit));
    }
    std::string log() const { return read(folder_.path("log")); }

    std::vector<std::string> bench(const std::vector<std::string>& more = {}) {
        std::vector<std::string> all = {"bench",     folder_.path("chain.yaml"),
                                        "-i",        folder_.path("in.####.exr"),
                                        "-r",        folder_.path("truth.####.exr"),
                                        "-o",        folder_.path("report"),
                                        "--device",  "software",
                                        "--repeats", "2"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    std::vector<std::string> ab(const std::vector<std::string>& more = {}) {
        std::vector<std::string> all = {"ab",
                                        folder_.path("chain.yaml"),
                                        folder_.path("other.yaml"),
                                        "-i",
                                        folder_.path("in.####.exr"),
                                        "-r",
                                        folder_.path("truth.####.exr"),
                                        "-o",
                                        folder_.path("report"),
                                        "--device",
                                        "software",
                                        "--repeats",
                                        "2"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    size_t results() const {
        std::error_code error;
        size_t count = 0;
        for (const auto& entry : fs::directory_iterator(folder_.path("report/results"), error))
            count += entry.path().filename().string()[0] != '.';
        return count;
    }
    test::TempFolder folder_;
};

TEST_F(Command, AbWritesAllFourFiles) {
    EXPECT_EQ(run(ab()), 0) << log();
    for (const char* name : {"index.html", "report.json", "report.csv", "report.md"})
        EXPECT_TRUE(fs::exists(folder_.path(std::string("report/") + name))) << name;
    EXPECT_THAT(log(), HasSubstr("Too few frames to decide (n = 2"));
    const auto json = nlohmann::json::parse(read(folder_.path("report/report.json")));
    EXPECT_EQ(json["variants"][0]["name"], "chain");
    EXPECT_EQ(json["variants"][1]["name"], "other");
    // The folder is not empty now.
    EXPECT_EQ(run(ab()), 5) << log();
    EXPECT_EQ(run(ab({"--on-existing", "overwrite", "--fail-above", "mse=1e-9"})), 8) << log();
    EXPECT_EQ(run(ab({"--on-existing", "overwrite", "--fail-above", "mse=1"})), 0) << log();
}

TEST_F(Command, UsageErrorsComeBeforeAnythingIsWritten) {
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.sampels=5,9"})), 2);
    EXPECT_THAT(log(), HasSubstr("did you mean 'samples'"));
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=4"})), 2);
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=5,7,9", "--max-variants", "2"})), 2);
    EXPECT_EQ(run(bench({"--under", "filp=1"})), 2);
    EXPECT_EQ(run(bench({"--fail-above", "psnr=30"})), 2);
    EXPECT_EQ(run(ab({"--fail-above", "mse"})), 2);
    EXPECT_FALSE(fs::exists(folder_.path("report")));
}

TEST_F(Command, ATruthThatDoesNotFitIsAnInputError) {
    fs::remove(folder_.path("truth.0002.exr"));
    EXPECT_EQ(run(ab()), 0) << log();
    EXPECT_THAT(log(), HasSubstr("1 of 2 frames were measured"));
    EXPECT_EQ(run(ab({"--on-existing", "overwrite", "--frames", "2"})), 4);
    EXPECT_THAT(log(), HasSubstr("the ground truth has no file for any of the"));
}

TEST_F(Command, AFullDiskIsAnOutputErrorAndLeavesNoHalfFile) {
    EXPECT_EQ(run(ab(), 4096), 5) << log();
    EXPECT_THAT(log(), HasSubstr("report"));
    EXPECT_FALSE(fs::exists(folder_.path("report/report.json")));
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path("report")))
        EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr(".tmp")));
}

TEST_F(Command, UnderPicksAChainThatRuns) {
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=5,9", "--under", "mse=1"})), 0) << log();
    // Results on stdout: the faster variant is in the Pareto set, whatever its error.
    EXPECT_THAT(log(), HasSubstr(" ms  hdr_flip 0."));
    EXPECT_THAT(log(), HasSubstr("  in the Pareto set"));
    EXPECT_EQ(
        run({"plan", folder_.path("report/under_mse.yaml"), "-i", folder_.path("in.0001.exr")}), 0)
        << log();
    // The same folder, with nothing left to do; no variant meets the limit.
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=5,9", "--under", "mse=1e-9"})), 8);
    EXPECT_THAT(log(), HasSubstr("no variant; the closest is"));
}

// SIGKILL after the first results: the next run reuses them and finishes the rest.
TEST_F(Command, AKilledBenchGoesOn) {
    const auto arguments = bench({"--sweep", "motion_blur.samples=5,7,9,11,13,15"});
    const pid_t pid = start(arguments);
    const auto begin = std::chrono::steady_clock::now();
    // Results of the input and of the ground truth come first.
    while (results() < 4 && std::chrono::steady_clock::now() - begin < std::chrono::minutes(2))
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    kill(pid, SIGKILL);
    EXPECT_EQ(wait(pid), 1000 + SIGKILL) << "finished before it could be killed";
    std::map<std::string, fs::file_time_type> before;
    for (const auto& entry : fs::directory_iterator(folder_.path("report/results")))
        if (entry.path().extension() == ".json" && entry.path().filename().string()[0] != '.')
            before[entry.path()] = entry.last_write_time();
    ASSERT_GE(before.size(), 4u);
    EXPECT_FALSE(fs::exists(folder_.path("report/report.json")));
    EXPECT_EQ(run(arguments), 0) << log();
    EXPECT_EQ(results(), 6u * 3u + 4u);  // two frames and a timing each; input and ground truth
    for (const auto& [path, time] : before) EXPECT_EQ(fs::last_write_time(path), time) << path;
    const auto json = nlohmann::json::parse(read(folder_.path("report/report.json")));
    EXPECT_EQ(json["variants"].size(), 6u);
    EXPECT_TRUE(json["variants"][0]["resumed"].get<bool>());
    for (const auto& variant : json["variants"]) {
        EXPECT_TRUE(variant["failure"].is_null());
        EXPECT_EQ(variant["metrics"]["mse"]["frames"].size(), 2u);
        EXPECT_FALSE(variant["timing"].is_null());
    }
}

TEST_F(Command, TerminationStopsWithItsCode) {
    const pid_t pid = start(bench({"--sweep", "motion_blur.samples=5,7,9,11,13,15"}));
    const auto begin = std::chrono::steady_clock::now();
    while (results() < 1 && std::chrono::steady_clock::now() - begin < std::chrono::minutes(2))
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    kill(pid, SIGTERM);
    EXPECT_EQ(wait(pid), 143) << log();
}

}  // namespace
}  // namespace postchain::experiment

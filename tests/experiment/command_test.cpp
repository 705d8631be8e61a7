// The command as a process: exit codes, and a bench that is killed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/command/command.h"
#include "tests/experiment/support.h"

namespace postchain::experiment {

using namespace report;
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Command : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 1, 2);
        test::write_truth(folder_.path(), "truth", 1, 2, 0.125f);
        test::write_text(folder_.path("chain.yaml"), test::kChainText);
        test::write_text(folder_.path("other.yaml"), test::kOtherOrderText);
    }

    // The exit code, or 1000 and the signal that ended it.
    int run(const test::Arguments& arguments, const test::Launch& launch = {}) {
        return code_of(test::run(arguments, launch));
    }
    int code_of(const test::Outcome& outcome) {
        log_ = outcome.out + outcome.err;
        return outcome.signal ? 1000 + outcome.signal : outcome.code;
    }
    const std::string& log() const { return log_; }

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
    // Sends the signal as soon as there are `least` results.
    int signal_after(size_t least, int signal, const test::Arguments& arguments) {
        test::Process process(test::with_command(arguments));
        while (results() < least && process.running())
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        process.send(signal);
        return code_of(process.wait());
    }
    test::TempFolder folder_;
    std::string log_;
};

TEST_F(Command, AbWritesAllFourFiles) {
    EXPECT_EQ(run(ab()), 0) << log();
    for (const char* name : {"index.html", "report.json", "report.csv", "report.md"})
        EXPECT_TRUE(fs::exists(folder_.path(std::string("report/") + name))) << name;
    EXPECT_THAT(log(), HasSubstr("Too few frames to decide (n = 2"));
    const auto json = nlohmann::json::parse(test::read_text(folder_.path("report/report.json")));
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
    EXPECT_EQ(run(ab(), {.file_bytes = 4096}), 5) << log();
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
    // Results of the input and of the ground truth come first.
    EXPECT_EQ(signal_after(4, SIGKILL, arguments), 1000 + SIGKILL)
        << "finished before it could be killed";
    std::map<std::string, fs::file_time_type> before;
    for (const auto& entry : fs::directory_iterator(folder_.path("report/results")))
        if (entry.path().extension() == ".json" && entry.path().filename().string()[0] != '.')
            before[entry.path()] = entry.last_write_time();
    ASSERT_GE(before.size(), 4u);
    EXPECT_FALSE(fs::exists(folder_.path("report/report.json")));
    EXPECT_EQ(run(arguments), 0) << log();
    EXPECT_EQ(results(), 6u * 3u + 4u);  // two frames and a timing each; input and ground truth
    for (const auto& [path, time] : before) EXPECT_EQ(fs::last_write_time(path), time) << path;
    const auto json = nlohmann::json::parse(test::read_text(folder_.path("report/report.json")));
    EXPECT_EQ(json["variants"].size(), 6u);
    EXPECT_TRUE(json["variants"][0]["resumed"].get<bool>());
    for (const auto& variant : json["variants"]) {
        EXPECT_TRUE(variant["failure"].is_null());
        EXPECT_EQ(variant["metrics"]["mse"]["frames"].size(), 2u);
        EXPECT_FALSE(variant["timing"].is_null());
    }
}

TEST_F(Command, TerminationStopsWithItsCode) {
    EXPECT_EQ(signal_after(1, SIGTERM, bench({"--sweep", "motion_blur.samples=5,7,9,11,13,15"})),
              143)
        << log();
}

}  // namespace
}  // namespace postchain::experiment

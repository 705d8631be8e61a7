// The command as a process: exit codes, and a bench that is killed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "tests/measure/experiment/command.h"

namespace postchain::experiment {

using namespace report;
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ExperimentCommand : public test::MeasureCommand {
  protected:
    void SetUp() override {
        MeasureCommand::SetUp();
        test::write_text(at("other.yaml"), test::kOtherOrderText);
    }
    int run(const test::Arguments& arguments, const test::Launch& launch = {}) {
        return code_of(test::run(arguments, launch));
    }
    int code_of(const test::Outcome& outcome) {
        log_ = outcome.out + outcome.err;
        return outcome.code;
    }
    const std::string& log() const { return log_; }

    test::Arguments bench(const test::Arguments& more = {}) const {
        return measured({"bench", at("chain.yaml"), "-o", at("report"), "--repeats", "5"}, more);
    }
    test::Arguments ab(const test::Arguments& more = {}) const {
        return measured(
            {"ab", at("chain.yaml"), at("other.yaml"), "-o", at("report"), "--repeats", "2"}, more);
    }
    size_t results() const {
        std::error_code error;
        size_t count = 0;
        for (const auto& entry : fs::directory_iterator(at("report/results"), error))
            count += entry.path().filename().string()[0] != '.';
        return count;
    }
    // Sends the signal as soon as there are `least` results.
    int signal_after(size_t least, int signal, const test::Arguments& arguments) {
        test::Process process(test::with_command(arguments));
        process.until([&] { return results() >= least; });
        process.send(signal);
        return code_of(process.wait());
    }
    std::string log_;
};

TEST_F(ExperimentCommand, AbWritesAllFourFiles) {
    EXPECT_EQ(run(ab()), 0) << log();
    for (const char* name : {"index.html", "report.json", "report.csv", "report.md"})
        EXPECT_TRUE(fs::exists(at(std::string("report/") + name))) << name;
    EXPECT_THAT(log(), HasSubstr("Too few frames to decide (n = 2"));
    const auto json = nlohmann::json::parse(test::read_text(at("report/report.json")));
    EXPECT_EQ(json["variants"][0]["name"], "chain");
    EXPECT_EQ(json["variants"][1]["name"], "other");
    // The folder is not empty now.
    EXPECT_EQ(run(ab()), 5) << log();
    EXPECT_EQ(run(ab({"--on-existing", "overwrite", "--fail-above", "mse=1e-9"})), 8) << log();
    EXPECT_EQ(run(ab({"--on-existing", "overwrite", "--fail-above", "mse=1"})), 0) << log();
}

TEST_F(ExperimentCommand, ErrorsComeBeforeAnythingIsWritten) {
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=5,7,9", "--max-variants", "2"})), 2);
    EXPECT_EQ(run(bench({"--under", "filp=1"})), 2);
    EXPECT_EQ(run(ab({"--fail-above", "mse"})), 2);
    fs::remove(at("truth.0002.exr"));
    EXPECT_EQ(run(ab({"--frames", "2"})), 4) << log();
    EXPECT_FALSE(fs::exists(at("report")));
}

TEST_F(ExperimentCommand, AFullDiskIsAnOutputErrorAndLeavesNoHalfFile) {
    EXPECT_EQ(run(ab(), {.file_bytes = 4096}), 5) << log();
    EXPECT_THAT(log(), HasSubstr("report"));
    EXPECT_FALSE(fs::exists(at("report/report.json")));
    for (const auto& entry : fs::recursive_directory_iterator(at("report")))
        EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr(".tmp")));
}

TEST_F(ExperimentCommand, UnderPicksAChainThatRuns) {
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=5,9", "--under", "mse=1"})), 0) << log();
    // Results on stdout: the faster variant is in the Pareto set, whatever its error.
    EXPECT_THAT(log(), HasSubstr(" ms  hdr_flip 0."));
    EXPECT_THAT(log(), HasSubstr("  in the Pareto set"));
    EXPECT_EQ(run({"plan", at("report/under_mse.yaml"), "-i", at("in.0001.exr")}), 0) << log();
    // The same folder, with nothing left to do; no variant meets the limit.
    EXPECT_EQ(run(bench({"--sweep", "motion_blur.samples=5,9", "--under", "mse=1e-9"})), 8);
    EXPECT_THAT(log(), HasSubstr("no variant; the closest is"));
}

// SIGKILL after the first results: the next run reuses them and finishes the rest.
TEST_F(ExperimentCommand, AKilledBenchGoesOn) {
    const auto arguments = bench({"--sweep", "motion_blur.samples=5,7,9,11,13,15"});
    // Results of the input and of the ground truth come first.
    signal_after(4, SIGKILL, arguments);
    std::map<std::string, fs::file_time_type> before;
    for (const auto& entry : fs::directory_iterator(at("report/results")))
        if (entry.path().extension() == ".json" && entry.path().filename().string()[0] != '.')
            before[entry.path()] = entry.last_write_time();
    ASSERT_GE(before.size(), 4u);
    EXPECT_EQ(run(arguments), 0) << log();
    EXPECT_EQ(results(), 6u * 3u + 4u);  // two frames and a timing each; input and ground truth
    for (const auto& [path, time] : before) EXPECT_EQ(fs::last_write_time(path), time) << path;
}

TEST_F(ExperimentCommand, TerminationStopsWithItsCode) {
    // The timing does not end before the signal comes.
    EXPECT_EQ(signal_after(1, SIGTERM, bench({"--repeats", "10000"})), 143) << log();
}

}  // namespace
}  // namespace postchain::experiment

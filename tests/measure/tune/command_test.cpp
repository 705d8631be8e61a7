// postchain tune as a process: files, exit codes, bad input, signals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "tests/measure/experiment/command.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class TuneCommand : public test::MeasureCommand {
  protected:
    void SetUp() override {
        MeasureCommand::SetUp();
        fs::create_directory(at("out"));
    }
    std::string tuned() const { return at("out/tuned.yaml"); }
    test::Arguments tune(const test::Arguments& more = {}, bool truth = true) const {
        return measured({"tune", at("chain.yaml"), "-o", tuned(), "--repeats", "1"}, more, truth);
    }
    // Ended by SIGTERM when its progress contains `word`.
    test::Outcome terminated(const test::Arguments& arguments, const std::string& word) const {
        test::Process process(test::with_command(arguments), {.stdout_path = at("progress")});
        process.until([&] { return test::contains(test::read_text(at("progress")), word); });
        process.send(SIGTERM);
        return process.wait();
    }
    // Refused with this code, and nothing is written.
    void expect_refused(const test::Arguments& arguments, int code, const std::string& message) {
        const auto outcome = test::run(arguments);
        EXPECT_EQ(outcome.code, code) << outcome.text();
        EXPECT_THAT(outcome.err, HasSubstr(message));
        EXPECT_TRUE(fs::is_empty(at("out"))) << message;
    }
};

TEST_F(TuneCommand, WritesAChainThatRunsAndOnlyThat) {
    const auto outcome = test::run(tune({"--budget", "100s"}));
    ASSERT_EQ(outcome.code, 0) << outcome.text();
    const std::string file = test::read_text(tuned());
    EXPECT_THAT(file, HasSubstr("# postchain tune "));
    EXPECT_THAT(file, HasSubstr("# reference: ground truth "));
    EXPECT_THAT(file, HasSubstr("\n# *"));
    EXPECT_THAT(outcome.out, HasSubstr("hdr_flip  chain\n"));
    EXPECT_TRUE(outcome.out.ends_with(tuned() + "\n")) << outcome.out;
    EXPECT_EQ(std::distance(fs::directory_iterator(at("out")), {}), 1);
    const auto plan = test::run({"plan", tuned(), "-i", at("in.0001.exr")});
    EXPECT_EQ(plan.code, 0) << plan.text();
    const auto json = test::run(tune({"--budget", "100s", "--on-existing", "overwrite", "--json"}));
    EXPECT_EQ(json.code, 0) << json.text();
    EXPECT_EQ(nlohmann::json::parse(json.out)["with_truth"], true);
}

TEST_F(TuneCommand, AGeneratedSceneWithADefaultChainAndASetValue) {
    ASSERT_EQ(test::run({"scene", "wheels", "-o", at("s"), "--frames", "1-2", "--size", "96x54",
                         "--truth-samples", "0"})
                  .code,
              0);
    const auto outcome = test::run(
        {"tune", "-i", at("s/sharp.####.exr"), "--camera", at("s/camera.json"), "-o", tuned(),
         "--device", "software", "--error", "0.5", "--set", "joint_blur.samples=8", "--set",
         "joint_blur.neighbors=none", "--repeats", "1", "--measure-frames", "1"});
    ASSERT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_THAT(outcome.err, HasSubstr("no ground truth: the converged image of balanced itself"));
    const std::string file = test::read_text(tuned());
    EXPECT_THAT(file, HasSubstr("# reference: no ground truth: the converged image"));
    EXPECT_THAT(file, HasSubstr("joint_blur samples 8 starts "));
    EXPECT_THAT(file, Not(HasSubstr("neighbors both denoise true")));
}

TEST_F(TuneCommand, AGoalThatCannotBeMetWritesNothing) {
    expect_refused(tune({"--budget", "0.000001s"}), 8, "the fastest of ");
    expect_refused(tune({"--error", "0.0001", "--max-chains", "2"}), 8, "nothing is written");
}

TEST_F(TuneCommand, BadArgumentsAndFrames) {
    expect_refused(tune({"--budget", "0"}), 2, "--budget: '0' is not a time above 0");
    // The output is an input.
    expect_refused(tune({"--budget", "1s", "--on-existing", "overwrite", "-o", at("chain.yaml")}),
                   2, "chain.yaml");
    EXPECT_EQ(test::read_text(at("chain.yaml")), test::kChainText);
    expect_refused(tune({"--budget", "1s", "--frames", "1-3"}), 4, "1 requested frame not on disk");
    // A folder that is missing is found before the frames, not after the last chain.
    expect_refused(tune({"--budget", "1s", "--frames", "1-3", "-o", at("none/tuned.yaml")}), 5,
                   "none/tuned.yaml: folder ");
    // Color without depth and motion.
    for (const bool truth : {false, true})
        expect_refused(tune({"--budget", "1s", "-i", at("truth.####.exr")}, truth), 4, "motion");
}

TEST_F(TuneCommand, AFullDiskLeavesNothing) {
    const auto outcome =
        test::run(tune({"--budget", "100s", "--max-chains", "1"}), {.file_bytes = 100});
    EXPECT_EQ(outcome.code, 5) << outcome.text();
    EXPECT_TRUE(fs::is_empty(at("out")));
}

TEST_F(TuneCommand, AStoppedWalkLeavesTheBestAndGoesOn) {
    const test::Arguments walk = {"--budget",  "100s", "--progress",   "openjd",
                                  "--repeats", "60",   "--max-chains", "6"};
    // The progress of the third chain says that two are measured.
    const auto stopped = terminated(tune(walk), "2/6, ");
    ASSERT_EQ(stopped.code, 143) << stopped.text();
    EXPECT_THAT(stopped.err, HasSubstr(" measured chains; the same command goes on"));
    const std::string best = test::read_text(tuned());
    EXPECT_THAT(best, HasSubstr("# the walk was stopped after "));
    EXPECT_EQ(test::run({"plan", tuned(), "-i", at("in.0001.exr")}).code, 0);

    // Another walk does not go on with it.
    const auto other = test::run(tune({"--budget", "90s", "--repeats", "60"}));
    EXPECT_EQ(other.code, 5) << other.text();
    EXPECT_THAT(other.err, HasSubstr("is of a stopped walk with other settings"));
    EXPECT_EQ(test::read_text(tuned()), best);

    const auto whole = test::run(tune(walk));
    ASSERT_EQ(whole.code, 0) << whole.text();
    EXPECT_THAT(whole.err, HasSubstr(" chains were measured before the stop"));
    EXPECT_THAT(test::read_text(tuned()), Not(HasSubstr("stopped")));
    EXPECT_EQ(std::distance(fs::directory_iterator(at("out")), {}), 1);
    // A complete file stays.
    EXPECT_EQ(test::run(tune(walk)).code, 5);
}

TEST_F(TuneCommand, TerminationLeavesNothing) {
    // The timing does not end before the signal comes.
    const auto outcome = terminated(
        tune({"--budget", "100s", "--progress", "openjd", "--repeats", "10000"}), "openjd");
    EXPECT_EQ(outcome.code, 143) << outcome.text();
    EXPECT_THAT(outcome.err, HasSubstr("no chain is written; run the same command again"));
    EXPECT_TRUE(fs::is_empty(at("out")));
}

}  // namespace
}  // namespace postchain

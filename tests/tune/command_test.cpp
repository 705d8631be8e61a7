// postchain tune as a process: files, exit codes, bad input, signals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/command/command.h"
#include "tests/experiment/support.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class Tune : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 1, 2);
        test::write_truth(folder_.path(), "truth", 1, 2, 0.125f);
        test::write_text(folder_.path("chain.yaml"), test::kChainText);
        fs::create_directory(at("out"));
    }
    std::string at(const std::string& name) const { return folder_.path(name); }
    std::string tuned() const { return at("out/tuned.yaml"); }
    test::Arguments tune(const test::Arguments& more = {}, bool truth = true) const {
        test::Arguments all = {"tune",  at("chain.yaml"), "-i",       at("in.####.exr"), "-o",
                               tuned(), "--device",       "software", "--repeats",       "1"};
        if (truth) all.insert(all.end(), {"-r", at("truth.####.exr")});
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    // Refused with this code, and nothing is written.
    void expect_refused(const test::Arguments& arguments, int code, const std::string& message) {
        const auto outcome = test::run(arguments);
        EXPECT_EQ(outcome.code, code) << outcome.text();
        EXPECT_THAT(outcome.err, HasSubstr(message));
        EXPECT_TRUE(fs::is_empty(at("out"))) << message;
    }
    test::TempFolder folder_;
};

TEST_F(Tune, WritesAChainThatRunsAndOnlyThat) {
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

    // It stays unless it may be replaced.
    const auto refused = test::run(tune({"--budget", "100s"}));
    EXPECT_EQ(refused.code, 5) << refused.text();
    EXPECT_THAT(refused.err, HasSubstr("--on-existing overwrite"));
    EXPECT_EQ(test::read_text(tuned()), file);
    const auto again =
        test::run(tune({"--budget", "100s", "--on-existing", "overwrite", "--json"}));
    EXPECT_EQ(again.code, 0) << again.text();
    EXPECT_EQ(nlohmann::json::parse(again.out)["with_truth"], true);
}

TEST_F(Tune, AGeneratedSceneWithADefaultChainAndASetValue) {
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

TEST_F(Tune, AGoalThatCannotBeMetWritesNothing) {
    expect_refused(tune({"--budget", "1us"}), 2, "use a form like 0.2, 0.2s or 200ms");
    expect_refused(tune({"--budget", "0.000001s"}), 8, "the fastest of ");
    expect_refused(tune({"--error", "0.0001", "--max-chains", "2"}), 8,
                   "allow a larger error, or start from another CHAIN; nothing is written");
}

TEST_F(Tune, BadArguments) {
    expect_refused(tune({"--budget", "0"}), 2, "--budget: '0' is not a time above 0");
    expect_refused(tune({"--budget=-1s"}), 2, "--budget: '-1s' is not a time above 0");
    expect_refused(tune({"--error", "0"}), 2, "--error");
    expect_refused(tune(), 2, "give a time per frame (--budget 0.2s) or a mean HDR-FLIP");
    expect_refused(tune({"--budget", "1s", "--error", "0.1"}), 2, "give one of the two");
    expect_refused(tune({"--budget", "1s", "--set", "motion_blur.sampels=5"}), 2,
                   "did you mean 'samples'");
    // Several chains are compared only against a truth.
    test::Arguments two = tune({"--budget", "1s"}, false);
    two.insert(two.begin() + 1, "paper");
    expect_refused(two, 2, "name one, or give --truth");
    // The output is an input.
    test::Arguments onto = tune({"--budget", "1s", "--on-existing", "overwrite"});
    onto[5] = at("chain.yaml");
    expect_refused(onto, 2, "chain.yaml");
    EXPECT_EQ(test::read_text(at("chain.yaml")), test::kChainText);
}

TEST_F(Tune, BadFrames) {
    expect_refused(tune({"--budget", "1s", "--frames", "1-3"}), 4, "1 requested frame not on disk");
    test::write_rgb(at("small.0001.exr"), ImageF(8, 8, 3));
    expect_refused(tune({"--budget", "1s", "-r", at("small.####.exr")}, false), 4,
                   "the ground truth is 8x8");
    expect_refused(tune({"--budget", "1s", "-r", at("none.####.exr")}, false), 4,
                   "the ground truth has no file for any of the 2 frames");
    // Color without depth and motion.
    test::Arguments color = tune({"--budget", "1s"});
    color[3] = at("truth.####.exr");
    color[2] = "-i";
    expect_refused(color, 4, "motion");
    color = tune({"--budget", "1s"}, false);
    color[3] = at("truth.####.exr");
    expect_refused(color, 4, "motion");
}

// With a truth for one of the frames, that one is measured.
TEST_F(Tune, MeasuresTheFramesThatHaveATruth) {
    fs::remove(at("truth.0001.exr"));
    const auto outcome = test::run(tune({"--budget", "100s", "--max-chains", "1"}));
    EXPECT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_THAT(test::read_text(tuned()), HasSubstr(", frames 2 (64x40)\n"));
}

TEST_F(Tune, AFullDiskLeavesNothing) {
    const auto outcome =
        test::run(tune({"--budget", "100s", "--max-chains", "1"}), {.file_bytes = 100});
    EXPECT_EQ(outcome.code, 5) << outcome.text();
    EXPECT_TRUE(fs::is_empty(at("out")));
}

TEST_F(Tune, TerminationLeavesNothing) {
    test::Arguments arguments = tune({"--budget", "100s", "--progress", "openjd"});
    for (auto& word : arguments)
        if (word == "1") word = "10000";  // --repeats
    test::Process process(test::with_command(arguments), {.stdout_path = at("progress")});
    while (process.running() && test::read_text(at("progress")).empty())
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    process.send(SIGTERM);
    const auto outcome = process.wait();
    EXPECT_EQ(outcome.code, 143) << outcome.text();
    EXPECT_THAT(outcome.err, HasSubstr("no chain is written; run the same command again"));
    EXPECT_TRUE(fs::is_empty(at("out")));
}

}  // namespace
}  // namespace postchain

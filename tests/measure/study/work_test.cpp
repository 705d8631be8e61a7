// The work on a study: what is measured, what fails, and what is tried again.
#include "tools/measure/study/work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "passes/registry.h"
#include "tests/measure/experiment/support.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/measure/study/study_reader.h"
#include "tools/measure/study/study_report.h"

namespace postchain::study {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class StudyWork : public ::testing::Test {
  protected:
    void SetUp() override {
        test::write_sequence(folder_.path(), 1);
        test::write_truth(folder_.path(), 1, 1, 0.125f);
    }
    Study study(const std::string& head, const std::string& truth) const {
        StudyFile file = read_study("postchain_study: 1\n" + head +
                                        "\nsettings: {repeats: 1, stability_frames: 0}\nscenes:\n"
                                        "  - {name: s, input: 'in.####.exr'" +
                                        truth + "}\n",
                                    folder_.path("study.yaml"), builtin_passes(),
                                    paths_beside(folder_.path("study.yaml")), "1");
        EXPECT_EQ(text_of(file.diagnostics), "");
        return std::move(file.study);
    }
    StudyFolder open(const Study& study) const {
        return test::must(StudyFolder::open(study, folder_.path("out"), io::OnExisting::skip));
    }
    Result<WorkDone> work(const Study& study, const std::atomic<bool>* stop = nullptr) const {
        const Machine machine{test::executor(), "device", true, [] { return Status(); }, {}, 1, {}};
        return work_on_tasks(study, open(study), {1, 1}, machine, {}, stop);
    }
    TaskResult result(const Study& study, size_t task) const {
        return *test::must(open(study).result(study, tasks_of(study)[task]));
    }
    test::TempFolder folder_;
};

// There is no camera for the lens.
TEST_F(StudyWork, IsTriedAgainWhereItFailedAlone) {
    const Study pairs = study(
        "chains: {one: [fxaa], two: [fxaa: {preset: 39}], lens: [depth_of_field]}\n"
        "questions: [[two, one], [one, lens]]",
        ", truth: 'truth.####.exr'");
    const std::atomic<bool> stop = true;
    EXPECT_EQ(work(pairs, &stop).status().code(), StatusCode::canceled);
    EXPECT_THAT(test::error_of(read_report(pairs, open(pairs))), HasSubstr("is not complete"));
    for (const size_t made : {2, 1}) {
        const WorkDone done = test::must(work(pairs));
        EXPECT_EQ(done.made, made);
        EXPECT_EQ(done.tasks, 2u);
        EXPECT_TRUE(done.complete());
    }
    const TaskResult good = result(pairs, 0), bad = result(pairs, 1);
    EXPECT_EQ(good.failure, "");
    EXPECT_EQ(good.renderer, "device");
    EXPECT_EQ(good.truth, "truth.####.exr");
    EXPECT_EQ(good.frames, std::vector<int>{1});
    EXPECT_EQ(good.width, 64);
    EXPECT_EQ(good.height, 40);
    ASSERT_EQ(good.variants.size(), 2u);
    EXPECT_EQ(good.variants[0].name, "two");
    EXPECT_GT(good.variants[1].time_ms, 0);
    EXPECT_EQ(good.variants[1].metrics.at("hdr_flip").size(), 1u);
    EXPECT_THAT(bad.failure, StartsWith("lens: frame 1: "));
    EXPECT_THAT(bad.variants, IsEmpty());
    EXPECT_EQ(test::must(read_report(pairs, open(pairs))).failures(), 1u);
}

TEST_F(StudyWork, OfABenchNeedsAGroundTruthAndAFolder) {
    const Study bench = study("kind: bench\nchains: {one: [fxaa], two: [fxaa: {preset: 39}]}", "");
    EXPECT_EQ(test::must(work(bench)).made, 1u);
    EXPECT_THAT(result(bench, 0).failure, StartsWith("has no ground truth: "));
    std::filesystem::remove_all(folder_.path("out/scenes"));
    test::write_text(folder_.path("out/scenes"), "");
    EXPECT_EQ(work(bench).status().code(), StatusCode::output);
}

}  // namespace
}  // namespace postchain::study

// Study files: what is read, and what is refused at which place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "passes/registry.h"
#include "tools/measure/study/study_reader.h"

namespace postchain::study {
namespace {

using ::testing::HasSubstr;

const std::string kHead =
    "postchain_study: 1\n"
    "chains: {one: paper, two: dof_first, three: balanced}\n";
const std::string kScene = "  - {name: s, input: 'a.####.exr', truth: 'b.####.exr'}\n";

StudyFile read(const std::string& text) {
    return read_study(text, "shots/study.yaml", builtin_passes(), paths_beside("shots/study.yaml"),
                      "1.2.3");
}

std::string refused(const std::string& text) {
    const StudyFile file = read(text);
    EXPECT_FALSE(file.status().ok()) << text;
    return text_of(file.diagnostics);
}

TEST(StudyFile, EveryPairIsAskedAndPathsAreBesideTheFile) {
    const StudyFile file = read(kHead + "settings: {repeats: 2}\nscenes:\n" + kScene +
                                "  - {name: t, family: f, input: '/x/a.####.exr', truth: "
                                "'b.####.exr', frames: 10, repeats: 3}\n");
    ASSERT_TRUE(file.status().ok()) << text_of(file.diagnostics);
    const Study& study = file.study;
    EXPECT_EQ(study.title, "study");
    ASSERT_EQ(study.pairs.size(), 3u);
    EXPECT_EQ(study.pairs[2], (std::pair<size_t, size_t>(1, 2)));
    const auto tasks = tasks_of(study);
    ASSERT_EQ(tasks.size(), 6u);
    EXPECT_EQ(tasks[4].name, "t.one_vs_three");
    EXPECT_EQ(study.scenes[0].family, "s");
    EXPECT_EQ(study.scenes[1].family, "f");
    EXPECT_EQ(study.scenes[0].measured.run.input.color().text(), "shots/a.####.exr");
    EXPECT_EQ(study.scenes[1].measured.run.input.color().text(), "/x/a.####.exr");
    EXPECT_EQ(study.scenes[0].measured.truth, "shots/b.####.exr");
    EXPECT_EQ(study.scenes[0].measured.repeats, 2);
    EXPECT_EQ(study.scenes[1].measured.repeats, 3);
    EXPECT_EQ(study.scenes[1].measured.run.frames->frames, std::vector<int>{10});
    EXPECT_EQ(study.scenes[0].measured.run.version, "1.2.3");
}

TEST(StudyFile, ALayerBehindIsBesideTheFileToo) {
    const auto behind_of = [](const std::string& more) {
        const StudyFile file = read(kHead +
                                    "scenes:\n  - {name: s, input: 'a.####.exr', truth: "
                                    "'b.####.exr'" +
                                    more + "}\n");
        EXPECT_TRUE(file.status().ok()) << text_of(file.diagnostics);
        const auto& patterns = file.study.scenes.at(0).measured.run.input.patterns;
        const auto found = patterns.find(Role::behind);
        return found == patterns.end() ? "" : found->second.text();
    };
    EXPECT_EQ(behind_of(""), "");
    EXPECT_EQ(behind_of(", behind: 'c.####.exr'"), "shots/c.####.exr");
    EXPECT_THAT(refused(kHead + "scenes:\n  - {name: s, input: 'a.####.exr', truth: 'b.####.exr', "
                                "behind: 'c.##.##.exr'}\n"),
                HasSubstr("scenes[0].behind: "));
}

TEST(StudyFile, QuestionsNameThePairs) {
    const StudyFile file = read(kHead + "questions: [[three, one]]\nscenes:\n" + kScene);
    ASSERT_TRUE(file.status().ok()) << text_of(file.diagnostics);
    ASSERT_EQ(file.study.pairs.size(), 1u);
    EXPECT_EQ(tasks_of(file.study)[0].name, "s.three_vs_one");
    EXPECT_THAT(refused(kHead + "questions: [[one, four]]\nscenes:\n" + kScene),
                HasSubstr("study.yaml:3:19: error: questions[0]: unknown chain 'four'"));
    EXPECT_THAT(refused(kHead + "questions: [[one, two], [two, one]]\nscenes:\n" + kScene),
                HasSubstr("is asked twice"));
}

const std::string kSampled =
    "postchain_study: 1\nkind: bench\nchains:\n"
    "  joint: [joint_blur: {samples: 32}, fxaa]\n"
    "  lens: [depth_of_field: {samples: 17}, motion_blur: {samples: 15}]\n"
    "  more: [depth_of_field: {samples: 18}, motion_blur: {samples: 15}]\n";

TEST(StudyFile, QuestionsSayWhatIsEqual) {
    const StudyFile file = read(kSampled +
                                "questions:\n  - {pair: [lens, joint], equal: samples}\n"
                                "  - {pair: [more, joint], equal: time}\n  - [lens, more]\n"
                                "margins: {hdr_flip: 0.003, psnr: 1}\nscenes:\n" +
                                kScene);
    ASSERT_TRUE(file.status().ok()) << text_of(file.diagnostics);
    EXPECT_EQ(file.study.equal, (std::vector<Equal>{Equal::samples, Equal::time, Equal::unsaid}));
    EXPECT_EQ(file.study.margins,
              (std::map<std::string, double>{{"hdr_flip", 0.003}, {"psnr", 1}}));
    // Each chain is measured once.
    EXPECT_EQ(tasks_of(file.study).size(), 1u);
    EXPECT_EQ(file.study.variants.size(), 3u);
    const std::string end = "\nscenes:\n" + kScene;
    EXPECT_THAT(
        refused(kSampled + "questions: [{pair: [more, joint], equal: samples}]" + end),
        HasSubstr("study.yaml:7:13: error: questions[0]: says equal samples, but the passes "
                  "of more take 33 and those of joint 32; change samples of a pass"));
    // The lens of the report takes no samples, whatever the row's default is.
    EXPECT_THAT(
        refused("postchain_study: 1\nkind: bench\nchains:\n"
                "  report: [motion_blur: {mode: guertin}, depth_of_field: {method: gilham}]\n"
                "  joint: [joint_blur: {samples: 57}]\n"
                "questions: [{pair: [report, joint], equal: samples}]" +
                end),
        HasSubstr("the passes of report take 25 and those of joint 57"));
    EXPECT_THAT(refused("postchain_study: 1\nkind: bench\nchains:\n"
                        "  few: [joint_blur: {samples: 32}]\n"
                        "  adaptive: [joint_blur: {samples: 32, max_samples: 64}]\n"
                        "questions: [{pair: [few, adaptive], equal: samples}]" +
                        end),
                HasSubstr("says equal samples, but adaptive samples adaptively"));
    EXPECT_THAT(refused(kSampled + "questions: [{pair: [more, joint], equal: price}]" + end),
                HasSubstr("questions[0].equal: is samples or time"));
    EXPECT_THAT(refused(kSampled + "questions: [{pair: [more, joint], equa: time}]" + end),
                HasSubstr("unknown key 'equa' (did you mean 'equal'?)"));
    EXPECT_THAT(refused(kSampled + "margins: {hdr_flp: 1}" + end),
                HasSubstr("unknown metric 'hdr_flp' (did you mean 'hdr_flip'?)"));
    EXPECT_THAT(refused(kSampled + "margins: {psnr: 0}" + end),
                HasSubstr("margins.psnr: is a number above 0"));
    EXPECT_THAT(refused(kSampled + "sweep: ['fxaa.preset=12,39']" + end),
                HasSubstr("unknown key 'sweep'"));
}

TEST(StudyFile, AChainMayBeAListOfPasses) {
    const StudyFile file = read(
        "postchain_study: 1\nchains:\n"
        "  alone: [depth_of_field: {samples: 24, neighbors: none}, fxaa]\n"
        "  block:\n    - motion_blur:\n        neighbors: \"none\"\n"
        "scenes:\n" +
        kScene);
    ASSERT_TRUE(file.status().ok()) << text_of(file.diagnostics);
    const auto& chains = file.study.chains;
    ASSERT_EQ(chains.size(), 2u);
    EXPECT_THAT(write_chain(chains[0].chain), HasSubstr("samples: 24"));
    EXPECT_THAT(write_chain(chains[0].chain), HasSubstr("- fxaa"));
    EXPECT_THAT(write_chain(chains[1].chain), HasSubstr("neighbors: none"));
    EXPECT_THAT(
        refused("postchain_study: 1\nchains:\n  one: paper\n  two: [fxa]\nscenes:\n" + kScene),
        HasSubstr("study.yaml:4:9: error: passes[0]: unknown pass 'fxa'"));
    EXPECT_THAT(
        refused("postchain_study: 1\nchains: {one: paper, two: {fxaa: {}}}\nscenes:\n" + kScene),
        HasSubstr("is not a chain's name, file or list of passes"));
}

TEST(StudyFile, ABenchComparesWithItsFirstVariant) {
    const StudyFile file = read(
        "postchain_study: 1\nkind: bench\nchain: paper\nsweep: ['motion_blur.samples=5,9,13']\n"
        "scenes:\n  - {name: s, input: 'a.####.exr', split_frames: 0}\n");
    ASSERT_TRUE(file.status().ok()) << text_of(file.diagnostics);
    ASSERT_EQ(file.study.pairs.size(), 2u);
    EXPECT_EQ(file.study.pairs[1], (std::pair<size_t, size_t>(0, 2)));
    EXPECT_EQ(tasks_of(file.study).size(), 1u);
    EXPECT_EQ(file.study.names()[1], "motion_blur.samples=9");
}

TEST(StudyFile, FaultsAreNamedAtTheirPlaces) {
    EXPECT_THAT(refused(kHead + "scenes:\n" + kScene + kScene),
                HasSubstr("shots/study.yaml:5:12: error: scenes[1].name: two scenes are named s"));
    EXPECT_THAT(refused(kHead + "scenes:\n  - {name: s, input: 'a.####.exr'}\n"),
                HasSubstr("scenes[0].truth: is missing"));
    EXPECT_THAT(refused(kHead + "scenes:\n  - {name: ../s, input: a.exr, truth: b.exr}\n"),
                HasSubstr("scenes[0].name: a scene has a name of letters"));
    EXPECT_THAT(refused(kHead + "scenes:\n  - {name: s, input: a.exr, truth: b.exr, camera: "
                                "none.json}\n"),
                HasSubstr("shots/none.json"));
    EXPECT_THAT(refused(kHead + "scenes:\n  - {name: s, input: a.exr, truth: b.exr, repeat: 1}\n"),
                HasSubstr("unknown key 'repeat' (did you mean 'repeats'?)"));
    EXPECT_THAT(refused(kHead + "settings: {repeats: 0}\nscenes:\n" + kScene),
                HasSubstr("settings.repeats: 0"));
    EXPECT_THAT(refused(kHead + "settings: {output: x}\nscenes:\n" + kScene),
                HasSubstr("unknown key 'output'"));
    EXPECT_THAT(refused("postchain_study: 1\nchains: {one: papr, two: fast}\nscenes:\n" + kScene),
                HasSubstr("unknown chain 'papr' (did you mean 'paper'?)"));
    EXPECT_THAT(refused("postchain_study: 2\nchains: {one: paper, two: fast}\nscenes:\n" + kScene),
                HasSubstr("postchain_study: is 1"));
    EXPECT_THAT(refused("[]"), HasSubstr("a study is a map"));
    EXPECT_THAT(refused(kHead), HasSubstr("scenes: is a list"));
}

// A path that a service does not allow is refused, with its line and column.
TEST(StudyFile, EveryPathIsAskedFor) {
    std::vector<std::string> asked;
    const StudyPaths paths = {[&](const std::string& path) -> Result<std::string> {
                                  asked.push_back(path);
                                  return Status(StatusCode::usage, path + " is outside");
                              },
                              [&](const io::PathPattern& pattern) -> Result<io::PathPattern> {
                                  asked.push_back(pattern.text());
                                  return Status(StatusCode::usage, pattern.text() + " is outside");
                              }};
    const StudyFile file = read_study(
        "postchain_study: 1\nchains: {one: paper, two: ./own.yaml}\nscenes:\n"
        "  - {name: s, input: 'color=a.exr,depth=z.exr', truth: b.exr, camera: c.json}\n",
        "study.yaml", builtin_passes(), paths, "1");
    EXPECT_THAT(asked, ::testing::IsSupersetOf({"./own.yaml", "a.exr", "b.exr", "c.json"}));
    EXPECT_FALSE(file.status().ok());
}

}  // namespace
}  // namespace postchain::study

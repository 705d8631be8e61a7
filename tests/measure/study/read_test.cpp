// Study files: what is read, and what is refused at which place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chain/base/printable.h"
#include "passes/registry.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/measure/study/study_reader.h"

namespace postchain::study {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kHead =
    "postchain_study: 1\n"
    "chains: {one: paper, two: dof_first, three: balanced}\n";
const std::string kScene = "  - {name: s, input: 'a.####.exr', truth: 'b.####.exr'}\n";

StudyFile read(const std::string& text) {
    return read_study(text, "shots/study.yaml", builtin_passes(), paths_beside("shots/study.yaml"),
                      "1.2.3");
}

Study study_of(const std::string& text) {
    StudyFile file = read(text);
    EXPECT_EQ(text_of(file.diagnostics), "");
    return std::move(file.study);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    if (const size_t at = text.find(what); at != text.npos) text.replace(at, what.size(), by);
    return text;
}

// Each text is refused with the whole messages in expected.NAME.
void expect_refused(const std::string& name, const std::vector<std::string>& texts) {
    std::string transcript;
    for (const std::string& text : texts) {
        const StudyFile file = read(text);
        EXPECT_FALSE(file.status().ok()) << text;
        transcript += printable(replaced(replaced(text, kHead, "(head) "), kScene, "(scene)")) +
                      "\n" + text_of(file.diagnostics);
    }
    test::expect_text_of(POSTCHAIN_SOURCE_DIR "/tests/measure/study/expected." + name, transcript);
}

TEST(StudyFile, EveryPairIsAskedAndPathsAreBesideTheFile) {
    const Study study =
        study_of(kHead + "settings: {repeats: 2}\nscenes:\n" + kScene +
                 "  - {name: t, family: f, input: '/x/a.####.exr', truth: 'b.####.exr', "
                 "behind: 'c.####.exr', frames: 10, repeats: 3}\n");
    EXPECT_EQ(study.title, "study");
    ASSERT_EQ(study.pairs.size(), 3u);
    EXPECT_EQ(study.pairs[2], (std::pair<size_t, size_t>(1, 2)));
    const auto tasks = tasks_of(study);
    ASSERT_EQ(tasks.size(), 6u);
    EXPECT_EQ(tasks[4].name, "t.one_vs_three");
    const Scene &s = study.scenes[0], &t = study.scenes[1];
    EXPECT_EQ(s.family, "s");
    EXPECT_EQ(t.family, "f");
    EXPECT_EQ(s.measured.run.input.color().text(), "shots/a.####.exr");
    EXPECT_EQ(s.measured.run.source.color_frames->text(), "shots/a.####.exr");
    EXPECT_EQ(t.measured.run.input.color().text(), "/x/a.####.exr");
    EXPECT_EQ(s.measured.truth, "shots/b.####.exr");
    EXPECT_FALSE(s.measured.run.input.patterns.contains(Role::behind));
    EXPECT_EQ(t.measured.run.input.patterns.at(Role::behind).text(), "shots/c.####.exr");
    EXPECT_EQ(s.measured.repeats, 2);
    EXPECT_EQ(t.measured.repeats, 3);
    const std::string frames = "settings: {frames: 7}\nscenes:\n";
    const std::string none =
        "  - {name: s, input: 'a.####.exr', truth: 'b.####.exr', frames: null}\n";
    EXPECT_TRUE(study_of(kHead + frames + kScene).scenes[0].measured.run.frames);
    EXPECT_FALSE(study_of(kHead + frames + none).scenes[0].measured.run.frames);
    EXPECT_EQ(t.measured.run.frames->frames, std::vector<int>{10});
    EXPECT_EQ(s.measured.run.version, "1.2.3");
}

TEST(StudyFile, QuestionsNameThePairs) {
    const Study study = study_of(kHead + "questions: [[three, one]]\nscenes:\n" + kScene);
    ASSERT_EQ(study.pairs.size(), 1u);
    EXPECT_EQ(tasks_of(study)[0].name, "s.three_vs_one");
    const auto asking = [](const std::string& questions) {
        return kHead + "questions: " + questions + "\nscenes:\n" + kScene;
    };
    expect_refused("questions", {
                                    asking("[[one, four]]"),
                                    asking("[[four, one]]"),
                                    asking("[[one, [two]]]"),
                                    asking("[[one, two], [two, one]]"),
                                    asking("[[one, two], [one, two]]"),
                                    asking("[[two, two]]"),
                                    asking("[]"),
                                    asking("{one: two}"),
                                    asking("[[one, two, three]]"),
                                    asking("[one]"),
                                    asking("[{equal: time}]"),
                                });
}

const std::string kSampled =
    "postchain_study: 1\nkind: bench\nchains:\n"
    "  joint: [joint_blur: {samples: 32}, fxaa]\n"
    "  lens: [depth_of_field: {samples: 17}, motion_blur: {samples: 15}]\n"
    "  more: [depth_of_field: {samples: 18}, motion_blur: {samples: 15}]\n";

TEST(StudyFile, QuestionsSayWhatIsEqual) {
    const Study study =
        study_of(kSampled +
                 "questions:\n  - {pair: [lens, joint], equal: samples}\n"
                 "  - {pair: [more, joint], equal: time}\n  - {pair: [lens, more]}\n"
                 "margins: {hdr_flip: 0.003, psnr: 1}\nscenes:\n" +
                 kScene);
    EXPECT_EQ(study.equal, (std::vector<Equal>{Equal::samples, Equal::time, Equal::unsaid}));
    EXPECT_EQ(study.margins, (std::map<std::string, double>{{"hdr_flip", 0.003}, {"psnr", 1}}));
    // Each chain is measured once.
    EXPECT_EQ(tasks_of(study).size(), 1u);
    EXPECT_EQ(study.chains.size(), 3u);
}

TEST(StudyFile, WhatIsNotEqualIsRefused) {
    const std::string end = "\nscenes:\n" + kScene;
    const std::string bench = "postchain_study: 1\nkind: bench\nchains:\n";
    expect_refused(
        "equal",
        {
            kSampled + "questions: [{pair: [more, joint], equal: samples}]" + end,
            // The lens of the report takes no samples, whatever the row's default is.
            bench +
                "  report: [motion_blur: {mode: guertin}, depth_of_field: {method: gilham}]\n"
                "  joint: [joint_blur: {samples: 57}]\n"
                "questions: [{pair: [report, joint], equal: samples}]" +
                end,
            kSampled + "questions: [{pair: [more, joint], equal: price}]" + end,
            kSampled + "questions: [{pair: [more, joint], equal: [time]}]" + end,
            kSampled + "questions: [{pair: [more, joint], equa: time}]" + end,
            kSampled + "margins: {hdr_flp: 1}" + end,
            kSampled + "margins: [psnr]" + end,
            kSampled + "margins: {psnr: 0}" + end,
            kSampled + "margins: {psnr: -1.5}" + end,
            kSampled + "margins: {psnr: .inf}" + end,
            kSampled + "margins: {psnr: much}" + end,
            kSampled + "margins: {psnr: [1]}" + end,
            kSampled + "sweep: ['fxaa.preset=12,39']" + end,
        });
}

TEST(StudyFile, AChainMayBeAListOfPasses) {
    const Study study = study_of(
        "postchain_study: 1\nchains:\n"
        "  alone: [depth_of_field: {samples: 24, neighbors: none}, fxaa]\n"
        "  block:\n    - motion_blur:\n        neighbors: \"none\"\n"
        "scenes:\n" +
        kScene);
    ASSERT_EQ(study.chains.size(), 2u);
    EXPECT_THAT(write_chain(study.chains[0].chain),
                AllOf(HasSubstr("samples: 24"), HasSubstr("- fxaa")));
    EXPECT_THAT(write_chain(study.chains[1].chain), HasSubstr("neighbors: none"));
}

std::string sweeping(const std::string& keys) {
    return "postchain_study: 1\nkind: bench\n" + keys + "\nscenes:\n" + kScene;
}

TEST(StudyFile, ABenchComparesWithItsFirstVariant) {
    const Study study = study_of(
        "postchain_study: 1\nkind: bench\nchain: paper\nsweep: ['motion_blur.samples=5,9,13']\n"
        "scenes:\n  - {name: s, input: 'a.####.exr', split_frames: 0}\n");
    ASSERT_EQ(study.pairs.size(), 2u);
    EXPECT_EQ(study.pairs[1], (std::pair<size_t, size_t>(0, 2)));
    EXPECT_EQ(tasks_of(study).size(), 1u);
    EXPECT_EQ(study.names()[1], "motion_blur.samples=9");
    EXPECT_EQ(study.chain_name, "paper");
    EXPECT_EQ(
        study_of(sweeping("chain: paper\nmax_variants: 3\nsweep: ['motion_blur.samples=5,9,13']"))
            .chains.size(),
        3u);
}

TEST(StudyFile, ASweepThatCannotBeMadeIsRefused) {
    const std::string sweep = "\nsweep: ['motion_blur.samples=5,9,13']";
    expect_refused("sweeps",
                   {
                       sweeping("sweep: ['motion_blur.samples=5,9']"),
                       sweeping("chain: papr" + sweep),
                       sweeping("chain: [fxa]" + sweep),
                       sweeping("chain: paper"),
                       sweeping("chain: paper\nsweep: []"),
                       sweeping("chain: paper\nsweep: 'motion_blur.samples=5,9'"),
                       sweeping("chain: paper\nsweep: [samples]"),
                       sweeping("chain: paper\nsweep: ['motion_blur.sample=5,9']"),
                       sweeping("chain: paper\nsweep: ['camera.aperture_image=a.png,b.png']"),
                       sweeping("chain: paper\nsweep: ['motion_blur.samples=5']"),
                       sweeping("chain: paper\nmax_variants: 2" + sweep),
                       sweeping("chain: paper\nmax_variants: 0" + sweep),
                       sweeping("chain: paper\nmax_variants: 100001" + sweep),
                       sweeping("chain: paper\nmax_variants: 2.5" + sweep),
                       sweeping("chain: paper\nmax_variants: [3]" + sweep),
                   });
}

TEST(StudyFile, FaultsAreNamedAtTheirPlaces) {
    const std::string one = "scenes:\n  - {name: s, input: a.exr, truth: b.exr, ";
    const auto chains = [](const std::string& given) {
        return "postchain_study: 1\nchains: " + given + "\nscenes:\n" + kScene;
    };
    expect_refused(
        "places",
        {
            kHead + "scenes:\n" + kScene + kScene,
            kHead + "scenes:\n  - {name: s, input: 'a.####.exr'}\n",
            kHead + "scenes:\n  - {name: ../s, input: a.exr, truth: b.exr}\n",
            kHead + one + "camera: none.json}\n",
            kHead + one + "frames: 3-}\n",
            kHead + one + "profile: cycle}\n",
            kHead + "settings: {profile: cycle}\nscenes:\n" + kScene,
            kHead + "settings: {camera: none.json}\nscenes:\n" + kScene,
            kHead + one + "behind: 'c.##.##.exr'}\n",
            kHead + one + "repeat: 1}\n",
            kHead + "settings: {repeats: 0}\nscenes:\n" + kScene,
            kHead + "settings: {output: x}\nscenes:\n" + kScene,
            chains("{one: papr, two: fast}"),
            chains("{one: paper, two: [fxa]}"),
            chains("{one: paper, two: {fxaa: {}}}"),
            chains("{one: paper, two: ''}"),
            chains("{one: paper, 'two!': fast}"),
            chains("{one: paper, " + std::string(65, 'a') + ": fast}"),
            chains("{one: paper}"),
            chains("[paper, fast]"),
            "postchain_study: 1\nscenes:\n" + kScene,
            kHead + "kind: both\nscenes:\n" + kScene,
            kHead + "title: [a]\nscenes:\n" + kScene,
            kHead + "title: ''\nscenes:\n" + kScene,
            kHead + "title: \"a\\0b\"\nscenes:\n" + kScene,
            kHead + "settings: [repeats]\nscenes:\n" + kScene,
            kHead + "settings: {repeats: [1]}\nscenes:\n" + kScene,
            kHead + "settings: {repeats: 0x}\nscenes:\n" + kScene,
            kHead + "settings: {camera: ''}\nscenes:\n" + kScene,
            kHead + "scenes: {a: b}\n",
            kHead + "scenes: []\n",
            kHead + "scenes: [a]\n",
            kHead + "scenes:\n  - {name: s, truth: b.exr}\n",
            kHead + "scenes:\n  - {input: a.exr, truth: b.exr}\n",
            kHead + "scenes:\n  - {name: s, input: 'a.##.##.exr', truth: b.exr}\n",
            kHead + "scenes:\n  - {name: s, input: a.exr, truth: 'color=a.exr,depth=b.exr'}\n",
            kHead + "scenes: [\n",
            "postchain_study: 2\nchains: {one: paper, two: fast}\nscenes:\n" + kScene,
            "[]",
            kHead,
        });
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

// The pictures of a chain's and a camera's apertures, a profile and a color configuration are files
// too.
TEST(StudyFile, EveryPathInAFileIsAskedFor) {
    const test::TempFolder folder;
    test::write_text(folder.path("chain.yaml"),
                     "postchain: 1\ncamera: {aperture_image: chain.png}\npasses: [fxaa]\n");
    test::write_text(
        folder.path("camera.json"),
        R"({"aperture_image": "camera.png", "frames": {"3": {"aperture_image": "frame.png"}}})");
    const StudyPaths paths = {
        [&](const std::string& path) -> Result<std::string> {
            if (path == "chain.yaml" || path == "camera.json" || path == "bad.json")
                return folder.path(path);
            return Status(StatusCode::usage, path + " is outside");
        },
        [](const io::PathPattern& pattern) { return Result(pattern); }};
    test::write_text(folder.path("bad.json"), "{\"f_stop\": -1,\n\"f_stp\": 2}");
    const auto said = [&](const std::string& chain, const std::string& setting) {
        return text_of(read_study("postchain_study: 1\nchains: {one: paper, two: " + chain +
                                      "}\nscenes:\n  - {name: s, input: a.exr, truth: b.exr" +
                                      setting + "}\n",
                                  "study.yaml", builtin_passes(), paths, "1")
                           .diagnostics);
    };
    EXPECT_EQ(said("fast", ""), "");
    EXPECT_THAT(said("chain.yaml", ""), HasSubstr("chains.two: its aperture_image: "));
    EXPECT_THAT(said("fast", ", camera: camera.json"),
                AllOf(HasSubstr("camera.png is outside"), HasSubstr("frame.png is outside")));
    EXPECT_EQ(
        replaced(said("fast", ", camera: bad.json"), folder.path("bad.json"), "bad.json"),
        "study.yaml:4:51: error: scenes[0].camera: bad.json:1:12: error: f_stop: -1 is out of "
        "range; f_stop is a number > 0\n");
    EXPECT_THAT(said("fast", ", ocio: config.ocio"), HasSubstr("config.ocio is outside"));
    EXPECT_THAT(said("fast", ", profile: ./own.yaml"), HasSubstr("./own.yaml is outside"));
    EXPECT_EQ(said("fast", ", profile: cycles"), "");
}

TEST(StudyFile, HasALimitedNumberOfTasks) {
    constexpr size_t kChains = 20, kPairs = kChains * (kChains - 1) / 2;
    const auto scenes = [](size_t count) {
        std::string text = "postchain_study: 1\nchains:\n";
        for (size_t i = 0; i < kChains; ++i) text += concat("  c", i, ": paper\n");
        text += "scenes:\n";
        for (size_t i = 0; i < count; ++i)
            text += concat("  - {name: s", i, ", input: a.exr, truth: b.exr}\n");
        return text;
    };
    EXPECT_EQ(text_of(read(scenes(kMaxTasks / kPairs)).diagnostics), "");
    EXPECT_THAT(text_of(read(scenes(kMaxTasks / kPairs + 1)).diagnostics),
                HasSubstr("has more than 10000 tasks"));
}

}  // namespace
}  // namespace postchain::study

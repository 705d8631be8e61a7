// Patterns, ranges, missing and existing frames, splits.

#include "tests/command/fixture.h"

namespace postchain::test::sequence_test {
namespace {

namespace fs = std::filesystem;
using SequenceTest = CommandTest;
using Names = std::vector<std::string>;

TEST_F(SequenceTest, EveryPatternNamesTheSameFrames) {
    write_sequence(at(""), {1, 2, 12});
    for (const char* pattern : {"in.####.exr", "in.@@@@.exr", "in.%04d.exr", "in.$F4.exr"}) {
        const auto outcome = run({"run", at("fxaa.yaml"), "-i", at(pattern), "-o",
                                  at("out/o.%d.exr"), "--on-existing", "overwrite"});
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        EXPECT_EQ(outputs(), Names({"o.1.exr", "o.12.exr", "o.2.exr"})) << pattern;
        for (const auto& name : outputs()) fs::remove(at("out/" + name));
    }
}

TEST_F(SequenceTest, OneFrameTakesTheNumberOfItsName) {
    write_frame(at("shot2.0107.exr"), make_planes(48, 32));
    const auto outcome =
        run({"run", at("fxaa.yaml"), "-i", at("shot2.0107.exr"), "-o", out(), "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_EQ(outputs(), Names({"o.0107.exr"}));
    EXPECT_EQ(sidecar(107)["frame"], 107);
    // A single file to a single file needs no pattern.
    EXPECT_EQ(
        run({"run", at("fxaa.yaml"), "-i", at("shot2.0107.exr"), "-o", at("out/one.exr")}).code, 0);
    EXPECT_EQ(read_color(at("out/one.exr")).data, read_color(out(107)).data);
}

TEST_F(SequenceTest, NegativeAndThousandBasedNumbersAndSteps) {
    write_sequence(at(""), {-2, -1, 0, 1, 1001, 1002, 1003, 1004, 1005});
    EXPECT_EQ(filter("fxaa", {"--frames", "-2--1"}).code, 0);
    EXPECT_EQ(outputs(), Names({"o.-001.exr", "o.-002.exr"}));
    EXPECT_EQ(filter("fxaa", {"--frames=-1-1,1001-1005x2", "--on-existing", "overwrite"}).code, 0);
    EXPECT_EQ(outputs(), Names({"o.-001.exr", "o.-002.exr", "o.0000.exr", "o.0001.exr",
                                "o.1001.exr", "o.1003.exr", "o.1005.exr"}));
}

TEST_F(SequenceTest, PartsOfASequenceAreTheWhole) {
    write_sequence(at(""), {1, 2, 3, 5, 8});
    ASSERT_EQ(filter("fxaa", {"--chunk", "1/3"}).code, 0);
    EXPECT_EQ(outputs(), Names({"o.0001.exr"}));
    ASSERT_EQ(filter("fxaa", {"--chunk", "2/3"}).code, 0);
    EXPECT_EQ(outputs(), Names({"o.0001.exr", "o.0002.exr", "o.0003.exr"}));
    ASSERT_EQ(filter("fxaa", {"--chunk", "3/3"}).code, 0);
    EXPECT_EQ(outputs(),
              Names({"o.0001.exr", "o.0002.exr", "o.0003.exr", "o.0005.exr", "o.0008.exr"}));
    // An empty part is not a failure: a farm's last tasks may have nothing to do.
    const auto empty = filter("fxaa", {"--chunk", "1/9", "--frames", "5"});
    EXPECT_EQ(empty.code, 0) << empty.text();
    EXPECT_TRUE(contains(empty.err, "0 written of 0 frames")) << empty.err;
    for (const char* chunk : {"0/3", "4/3", "3", "x"}) {
        const auto outcome = filter("fxaa", {"--chunk", chunk});
        EXPECT_EQ(outcome.code, 2) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "--chunk")) << outcome.err;
    }
}

TEST_F(SequenceTest, AFolderIsMadeWhereItIsAskedFor) {
    write_sequence(at(""), {1});
    const auto into = [&](const std::string& folder, const Arguments& more) {
        Arguments arguments = {"run", at("fxaa.yaml"), "-i", in(1), "-o", at(folder + "/o.exr")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    const auto missing = into("new/deep", {});
    EXPECT_EQ(missing.code, 5);
    EXPECT_TRUE(contains(missing.err, "--mkdir")) << missing.err;
    EXPECT_FALSE(exists(at("new")));
    const auto made = into("new/deep", {"--mkdir"});
    EXPECT_EQ(made.code, 0) << made.text();
    EXPECT_TRUE(exists(at("new/deep/o.exr")));
    // A file in its place is never replaced.
    const auto file = into("fxaa.yaml", {"--mkdir"});
    EXPECT_EQ(file.code, 5);
    EXPECT_TRUE(contains(file.err, "is not a folder")) << file.err;
    EXPECT_EQ(into("fxaa.yaml/below", {"--mkdir"}).code, 5);
}

TEST_F(SequenceTest, BadRangesAreUsageErrors) {
    write_sequence(at(""), {1, 2});
    for (const char* range : {"1:2", "2-1", "1-", "1-2x0", "1,,2", "", "1.5", "x", "1-2 ",
                              "0-99999999", "99999999999999999999"}) {
        const auto outcome = filter("fxaa", {"--frames", range});
        EXPECT_EQ(outcome.code, 2) << range << ": " << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "--frames")) << outcome.err;
    }
    EXPECT_TRUE(contains(filter("fxaa", {"--frames", "1:2"}).err, "1-10x2"));
    EXPECT_EQ(outputs(), Names());
}

TEST_F(SequenceTest, BadArgumentsAreUsageErrors) {
    write_sequence(at(""), {1});
    for (const Arguments& more : {Arguments{"--on-existing", "maybe"},
                                  {"--missing", "no"},
                                  {"--on-error", "x"},
                                  {"--precision", "fp64"},
                                  {"--threads", "0"},
                                  {"--threads", "two"},
                                  {"--profile", "maya"},
                                  {"--device", "first"},
                                  {"--no-such-option"},
                                  {"--set", "fxaa.presett=12"},
                                  {"--set", "passes[7].preset=12"},
                                  {"--set", "fxaa.preset"},
                                  {"--set", "fxaa.preset=9"},
                                  {"--set", "motion_blur.samples=5"},
                                  {"--set", ""},
                                  {"--no-elide=no_rule"},
                                  {"--view", "left"},
                                  {"--layer", "no_layer"},
                                  {"--log-format", "xml"},
                                  {"extra"}}) {
        const auto outcome = filter("fxaa", more);
        EXPECT_EQ(outcome.code, 2) << more[0] << ": " << outcome.text();
        EXPECT_NE(outcome.err, "") << more[0];
    }
    write_text(at("twice.yaml"), "postchain: 1\npasses: [fxaa, fxaa]\n");
    EXPECT_EQ(filter("twice", {"--set", "fxaa.preset=12"}).code, 2);
    EXPECT_EQ(run({}).code, 2);
    EXPECT_EQ(run({"filter"}).code, 2);
    EXPECT_EQ(run({"run", "paper", "-i", in()}).code, 2);
    EXPECT_EQ(run({"passes", "--json", "--markdown"}).code, 2);
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", at("a.##.##.exr"), "-o", out()}).code, 2);
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", "depth=" + in(), "-o", out()}).code, 2);
    EXPECT_EQ(outputs(), Names());
}

TEST_F(SequenceTest, OutputThatIsTheInputIsRefused) {
    write_sequence(at(""), {1, 2});
    const std::string before = read_text(in(1));
    for (const auto& output : {in(), at("in.%04d.exr"), at("out/../in.####.exr")}) {
        const auto outcome =
            run({"run", at("fxaa.yaml"), "-i", in(), "-o", output, "--on-existing", "overwrite"});
        EXPECT_EQ(outcome.code, 2) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "input")) << outcome.err;
    }
    // Also through a link.
    fs::create_directory_symlink(folder_.path(), at("link"));
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", in(), "-o", at("link/in.####.exr"),
                   "--on-existing", "overwrite"})
                  .code,
              2);
    EXPECT_TRUE(read_text(in(1)) == before);
}

TEST_F(SequenceTest, OneNameForManyFramesIsRefused) {
    write_sequence(at(""), {1, 2});
    const auto outcome = run({"run", at("fxaa.yaml"), "-i", in(), "-o", at("out/o.exr")});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(contains(outcome.err, "####")) << outcome.err;
    const auto gif = run({"run", at("fxaa.yaml"), "-i", in(), "-o", at("out/o.####.gif")});
    EXPECT_EQ(gif.code, 2);
    EXPECT_TRUE(contains(gif.err, ".exr")) << gif.err;
}

TEST_F(SequenceTest, MissingFramesUnderEachPolicy) {
    write_sequence(at(""), {1, 2, 5});
    const auto error = filter("fxaa", {"--frames", "1-5"});
    EXPECT_EQ(error.code, 4) << error.text();
    EXPECT_TRUE(contains(error.err, in(3)) && contains(error.err, "3-4")) << error.err;
    EXPECT_EQ(outputs(), Names());

    const auto skip = filter("fxaa", {"--frames", "1-5", "--missing", "skip"});
    EXPECT_EQ(skip.code, 1) << skip.text();
    EXPECT_EQ(outputs(), Names({"o.0001.exr", "o.0002.exr", "o.0005.exr"}));
    EXPECT_TRUE(contains(skip.err, in(4))) << skip.err;

    const auto hold =
        filter("fxaa", {"--frames", "0-5", "--missing", "hold", "--on-existing", "overwrite"});
    EXPECT_EQ(hold.code, 1) << hold.text();
    EXPECT_EQ(outputs().size(), 6u);
    EXPECT_EQ(read_color(out(0)).data, read_color(out(1)).data);  // no earlier frame: the next
    EXPECT_EQ(read_color(out(3)).data, read_color(out(2)).data);
    EXPECT_EQ(read_color(out(4)).data, read_color(out(2)).data);
    EXPECT_NE(read_color(out(5)).data, read_color(out(2)).data);
    EXPECT_EQ(sidecar(4)["held_from"], 2);

    // No frames at all: never 0.
    for (const char* policy : {"error", "skip", "hold"}) {
        const auto none = run({"run", at("fxaa.yaml"), "-i", at("no.####.exr"), "-o",
                               at("out/none.####.exr"), "--frames", "1-2", "--missing", policy});
        EXPECT_EQ(none.code, 4) << policy << none.text();
    }
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", at("no.####.exr"), "-o", out()}).code, 4);
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", at("no.exr"), "-o", out()}).code, 4);
}

// A held frame is the same whether or not the frame it is held from was requested.
TEST_F(SequenceTest, HoldingDoesNotDependOnTheRange) {
    write_sequence(at(""), {1, 2, 5});
    EXPECT_EQ(filter("fxaa", {"--frames", "3-5", "--missing", "hold"}).code, 1);
    EXPECT_EQ(sidecar(3)["held_from"], 2);
    EXPECT_EQ(sidecar(4)["held_from"], 2);
}

TEST_F(SequenceTest, HolesThatNobodyAskedForAreSaid) {
    write_sequence(at(""), {1, 2, 5});
    const auto outcome = filter("fxaa");
    EXPECT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, "3-4")) << outcome.err;
}

TEST_F(SequenceTest, MissingPlaneOfItsOwnFileIsNamed) {
    write_sequence(at(""), {1, 2});
    write_frame(at("z.0001.exr"), make_planes(48, 32));
    const auto outcome = run(
        {"run", at("all.yaml"), "-i", "color=" + in() + ",depth=" + at("z.####.exr"), "-o", out()});
    EXPECT_EQ(outcome.code, 4) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, at("z.0002.exr"))) << outcome.err;
    EXPECT_FALSE(contains(outcome.err, in(2))) << outcome.err;
}

TEST_F(SequenceTest, AFrameThatFailsUnderStopAndContinue) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6});
    write_text(in(4), read_text(in(4)).substr(0, 3000));
    // Stop: writes all frames before it and none after it, however far ahead frames are read.
    const auto stop = filter("fxaa");
    EXPECT_EQ(stop.code, 1) << stop.text();
    EXPECT_TRUE(contains(stop.err, in(4))) << stop.err;
    EXPECT_EQ(outputs(), Names({"o.0001.exr", "o.0002.exr", "o.0003.exr"}));
    const auto go_on = filter("fxaa", {"--on-error", "continue", "--on-existing", "overwrite"});
    EXPECT_EQ(go_on.code, 1) << go_on.text();
    EXPECT_EQ(outputs().size(), 5u);
    EXPECT_FALSE(exists(out(4)));
    EXPECT_TRUE(contains(go_on.err, "5 written, 1 failed of 6 frames")) << go_on.err;
    // With a single frame, the exit code is that of the cause.
    EXPECT_EQ(filter("fxaa", {"--frames", "4"}).code, 4);
}

TEST_F(SequenceTest, ExistingOutputsUnderEachPolicy) {
    write_sequence(at(""), {1, 2, 3});
    ASSERT_EQ(filter("fxaa", {"--frames", "2"}).code, 0);
    const std::string second = read_text(out(2));

    const auto refused = filter("fxaa");
    EXPECT_EQ(refused.code, 5) << refused.text();
    EXPECT_TRUE(contains(refused.err, out(2)) && contains(refused.err, "--on-existing"));
    EXPECT_EQ(outputs(), Names({"o.0002.exr"}));  // nothing is started
    const auto partly = filter("fxaa", {"--on-error", "continue"});
    EXPECT_EQ(partly.code, 1);
    EXPECT_EQ(outputs().size(), 3u);
    EXPECT_TRUE(read_text(out(2)) == second);

    ASSERT_EQ(filter("motion_blur", {"--on-existing", "overwrite"}).code, 0);
    EXPECT_FALSE(read_text(out(2)) == second);
}

TEST_F(SequenceTest, SkipIsForCompleteOutputsOfTheSameWork) {
    write_sequence(at(""), {1});
    const auto skip = [&](const std::string& chain, const Arguments& more = {}) {
        Arguments all = {"--on-existing", "skip", "--json"};
        all.insert(all.end(), more.begin(), more.end());
        const auto outcome = filter(chain, all);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        return json_lines(outcome.out).at(0)["outcome"].get<std::string>();
    };
    EXPECT_EQ(skip("fxaa"), "written");
    const std::string bytes = read_text(out(1));
    EXPECT_EQ(skip("fxaa"), "skipped");
    EXPECT_EQ(skip("fxaa", {"--threads", "1"}), "skipped");  // does not affect pixels
    EXPECT_TRUE(read_text(out(1)) == bytes);

    EXPECT_EQ(skip("motion_blur"), "written");  // another chain
    EXPECT_EQ(skip("motion_blur", {"--set", "motion_blur.samples=7"}), "written");
    EXPECT_EQ(skip("motion_blur"), "written");
    EXPECT_EQ(skip("motion_blur"), "skipped");
    EXPECT_EQ(skip("motion_blur", {"--precision", "fp16"}), "written");
    write_text(at("camera.json"), "{\"shutter_frames\": 0.25}");
    EXPECT_EQ(skip("motion_blur"), "written");
    EXPECT_EQ(skip("motion_blur", {"--camera", at("camera.json")}), "written");

    EXPECT_EQ(skip("fxaa"), "written");
    fs::last_write_time(in(1), fs::last_write_time(in(1)) + std::chrono::seconds(5));
    EXPECT_EQ(skip("fxaa"), "written");  // the input was touched
    for (size_t keep : {size_t(0), size_t(100), bytes.size() / 2, bytes.size() - 1}) {
        write_text(out(1), read_text(out(1)).substr(0, keep));
        EXPECT_EQ(skip("fxaa"), "written") << keep << " bytes were left";
    }
    EXPECT_EQ(skip("fxaa"), "skipped");
    fs::remove(out(1) + ".json");
    EXPECT_EQ(skip("fxaa"), "written");
    write_text(out(1) + ".json", "{\"work\": \"another\"}");  // of another image
    EXPECT_EQ(skip("fxaa"), "written");
    EXPECT_EQ(skip("fxaa", {"--png"}), "written");  // the preview does not exist yet
    EXPECT_EQ(skip("fxaa", {"--png"}), "skipped");
    const std::string preview = fs::path(out(1)).replace_extension(".png");
    const std::string shown = read_text(preview);
    for (size_t keep : {size_t(0), size_t(100), shown.size() - 1}) {
        write_text(preview, shown.substr(0, keep));
        EXPECT_EQ(skip("fxaa", {"--png"}), "written") << keep << " bytes were left of the preview";
        EXPECT_TRUE(read_text(preview) == shown);
    }
    // A preview of another chain, whose output has since been replaced without one.
    EXPECT_EQ(skip("motion_blur"), "written");
    EXPECT_EQ(skip("motion_blur", {"--png"}), "written");
    EXPECT_FALSE(read_text(preview) == shown);
    EXPECT_EQ(skip("motion_blur", {"--png"}), "skipped");
    EXPECT_EQ(skip("fxaa"), "written");
    write_text(out(1), "not a picture");
    EXPECT_EQ(skip("fxaa"), "written");
}

// Without --strict a NaN is replaced and the frame is written, which does not guarantee its values.
TEST_F(SequenceTest, SkipUnderStrictLooksAtTheValues) {
    Planes planes = make_planes(48, 32);
    planes.color.at(3, 2, 1) = NAN;
    write_frame(in(1), planes);
    write_frame(in(2), make_planes(48, 32, 2));
    const auto skip = [&](const Arguments& more) {
        Arguments all = {"--on-existing", "skip", "--json", "--on-error", "continue"};
        all.insert(all.end(), more.begin(), more.end());
        return filter("fxaa", all);
    };
    for (const Arguments& more : {Arguments{}, {"--no-sidecar"}}) {
        ASSERT_EQ(skip(more).code, 0);
        const std::string first = read_text(out(1)), second = read_text(out(2));
        EXPECT_EQ(json_lines(skip(more).out).at(0)["outcome"], "skipped");
        Arguments strict = more;
        strict.push_back("--strict");
        const auto found = skip(strict);
        EXPECT_EQ(found.code, 7) << found.text();
        EXPECT_TRUE(contains(found.err, in(1)) && contains(found.err, "non-finite")) << found.err;
        EXPECT_TRUE(read_text(out(1)) == first);
        // Once checked, a valid frame is kept with and without --strict.
        EXPECT_EQ(read_color(out(2)).data.size(), size_t(48 * 32 * 4));
        for (const Arguments& again : {strict, more})
            EXPECT_EQ(json_lines(skip(again).out).at(1)["outcome"], "skipped");
        for (int frame : {1, 2}) {
            fs::remove(out(frame));
            fs::remove(out(frame) + ".json");
        }
    }
}

TEST_F(SequenceTest, AnySplitOverProcessesGivesTheSamePixels) {
    write_sequence(at(""), {1, 2, 3, 4});
    ASSERT_EQ(filter("all").code, 0);
    std::vector<ImageF> whole;
    for (int frame = 1; frame <= 4; ++frame) whole.push_back(read_color(out(frame)));
    EXPECT_NE(whole[0].data, whole[1].data);
    for (const char* part : {"4", "2-3", "1"})
        ASSERT_EQ(filter("all", {"--frames", part, "--on-existing", "overwrite"}).code, 0);
    for (int frame = 1; frame <= 4; ++frame)
        EXPECT_EQ(read_color(out(frame)).data, whole[size_t(frame - 1)].data) << frame;
}

TEST_F(SequenceTest, TwoProcessesOnOneFolder) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6});
    ASSERT_EQ(filter("all").code, 0);
    std::vector<ImageF> alone;
    for (int frame = 1; frame <= 6; ++frame) alone.push_back(read_color(out(frame)));
    const Arguments arguments = with_command(
        {"run", at("all.yaml"), "-i", in(), "-o", out(), "--on-existing", "overwrite"});
    Process first(arguments), second(arguments);
    EXPECT_EQ(first.wait().code, 0);
    EXPECT_EQ(second.wait().code, 0);
    for (int frame = 1; frame <= 6; ++frame)
        EXPECT_EQ(read_color(out(frame)).data, alone[size_t(frame - 1)].data) << frame;
}

TEST_F(SequenceTest, SizesAndChannelsMayChange) {
    write_frame(in(1), make_planes(48, 32));
    write_frame(in(2), make_planes(64, 24, 2));
    FrameFile nuke;
    nuke.convention = "nuke";
    write_frame(in(3), make_planes(31, 17, 3), nuke);
    const auto outcome = filter("all");
    ASSERT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_EQ(read_color(out(2)).width, 64);
    EXPECT_EQ(read_color(out(3)).height, 17);
    EXPECT_EQ(sidecar(2)["profile"], "cycles");
    EXPECT_EQ(sidecar(3)["profile"], "nuke");
    // Pixels equal those of each frame filtered separately.
    const ImageF third = read_color(out(3));
    ASSERT_EQ(filter("all", {"--frames", "3", "--on-existing", "overwrite"}).code, 0);
    EXPECT_EQ(read_color(out(3)).data, third.data);
    // A frame without vectors in the middle fails, the others do not.
    FrameFile still;
    still.motion = false;
    write_frame(in(2), make_planes(48, 32), still);
    const auto without = filter("all", {"--on-error", "continue", "--on-existing", "overwrite"});
    EXPECT_EQ(without.code, 1);
    EXPECT_TRUE(contains(without.err, in(2)) && contains(without.err, "motion")) << without.err;
    EXPECT_TRUE(contains(without.err, "2 written, 1 failed of 3")) << without.err;
}

}  // namespace
}  // namespace postchain::test::sequence_test

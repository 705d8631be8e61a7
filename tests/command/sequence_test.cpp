// Patterns, ranges, missing and existing frames, splits.

#include "tests/command/fixture.h"

namespace postchain::test::sequence_test {
namespace {

namespace fs = std::filesystem;
using SequenceTest = CommandTest;
using Names = std::vector<std::string>;

TEST_F(SequenceTest, OneFrameTakesTheNumberOfItsName) {
    write_frame(at("shot2.0107.exr"), make_planes(48, 32));
    expect_ends(run({"run", at("fxaa.yaml"), "-i", at("shot2.0107.exr"), "-o", out(), "--json"}),
                0);
    EXPECT_EQ(outputs(), Names({"o.0107.exr"}));
    EXPECT_EQ(sidecar(107)["frame"], 107);
    // A single file to a single file needs no pattern.
    EXPECT_EQ(
        run({"run", at("fxaa.yaml"), "-i", at("shot2.0107.exr"), "-o", at("out/one.exr")}).code, 0);
    EXPECT_EQ(read_color(at("out/one.exr")).data, read_color(out(107)).data);
}

TEST_F(SequenceTest, PartsOfASequenceAreTheWhole) {
    write_sequence(at(""), {1, 2, 3, 5, 8});
    for (const char* chunk : {"1/2", "2/2"}) ASSERT_EQ(filter("fxaa", {"--chunk", chunk}).code, 0);
    EXPECT_EQ(outputs(),
              Names({"o.0001.exr", "o.0002.exr", "o.0003.exr", "o.0005.exr", "o.0008.exr"}));
    // An empty part is not a failure: a farm's last tasks may have nothing to do.
    expect_ends(filter("fxaa", {"--chunk", "1/9", "--frames", "5"}), 0, {"0 written of 0 frames"});
}

TEST_F(SequenceTest, AFolderIsMadeWhereItIsAskedFor) {
    write_sequence(at(""), {1});
    const auto into = [&](const std::string& folder, const Arguments& more) {
        const Arguments arguments =
            joined({"run", at("fxaa.yaml"), "-i", in(1), "-o", at(folder + "/o.exr")}, more);
        return run(arguments);
    };
    expect_ends(into("new/deep", {}), 5, {"--mkdir"});
    EXPECT_FALSE(exists(at("new")));
    expect_ends(into("new/deep", {"--mkdir"}), 0);
    EXPECT_TRUE(exists(at("new/deep/o.exr")));
    // A file in its place is never replaced.
    expect_ends(into("fxaa.yaml", {"--mkdir"}), 5, {"is not a folder"});
    EXPECT_EQ(into("fxaa.yaml/below", {"--mkdir"}).code, 5);
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
                                  {"--frames", "1:2"},
                                  {"--frames", ""},
                                  {"--chunk", "4/3"},
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
    for (const auto& output : {in(), at("in.%04d.exr"), at("out/../in.####.exr")})
        expect_ends(
            run({"run", at("fxaa.yaml"), "-i", in(), "-o", output, "--on-existing", "overwrite"}),
            2, {"input"});
    // Also through a link.
    fs::create_directory_symlink(folder_.path(), at("link"));
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", in(), "-o", at("link/in.####.exr"),
                   "--on-existing", "overwrite"})
                  .code,
              2);
    EXPECT_TRUE(read_text(in(1)) == before);
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
    for (const char* policy : {"error", "skip", "hold"})
        expect_ends(run({"run", at("fxaa.yaml"), "-i", at("no.####.exr"), "-o",
                         at("out/none.####.exr"), "--frames", "1-2", "--missing", policy}),
                    4);
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", at("no.####.exr"), "-o", out()}).code, 4);
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", at("no.exr"), "-o", out()}).code, 4);
}

TEST_F(SequenceTest, HolesThatNobodyAskedForAreSaid) {
    write_sequence(at(""), {1, 2, 5});
    expect_ends(filter("fxaa"), 0, {"3-4"});
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
    expect_ends(filter("fxaa"), 1, {in(4)});
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
    expect_ends(filter("fxaa"), 5, {out(2), "--on-existing"});
    EXPECT_EQ(outputs(), Names({"o.0002.exr"}));  // nothing is started
    EXPECT_EQ(filter("fxaa", {"--on-error", "continue"}).code, 1);
    EXPECT_EQ(outputs().size(), 3u);
    EXPECT_TRUE(read_text(out(2)) == second);
    // tests/run has what makes an output one of the same work.
    EXPECT_TRUE(contains(filter("fxaa", {"--on-existing", "skip"}).err, "3 skipped of 3"));
    EXPECT_TRUE(
        contains(filter("fxaa", {"--on-existing", "skip", "--half"}).err, "3 written of 3"));
    EXPECT_FALSE(read_text(out(2)) == second);
    ASSERT_EQ(filter("fxaa", {"--on-existing", "overwrite"}).code, 0);
    EXPECT_TRUE(read_text(out(2)) == second);
}

TEST_F(SequenceTest, SizesAndChannelsMayChange) {
    write_frame(in(1), make_planes(48, 32));
    write_frame(in(2), make_planes(64, 24, 2));
    FrameFile nuke;
    nuke.convention = "nuke";
    write_frame(in(3), make_planes(31, 17, 3), nuke);
    expect_ends(filter("all"), 0);
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
    expect_ends(filter("all", {"--on-error", "continue", "--on-existing", "overwrite"}), 1,
                {in(2), "motion", "2 written, 1 failed of 3"});
}

}  // namespace
}  // namespace postchain::test::sequence_test

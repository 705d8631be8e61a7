// Patterns, ranges, missing and existing frames, splits.
#include "tests/command/fixture.h"

namespace postchain::test::sequence_test {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class SequenceTest : public CommandTest {
  protected:
    // run fxaa.yaml -i INPUT -o OUTPUT
    Outcome through(const std::string& input, const std::string& output,
                    const Arguments& more = {}) {
        return run(joined({"run", at("fxaa.yaml"), "-i", input, "-o", output}, more));
    }
};

TEST_F(SequenceTest, OneFrameTakesTheNumberOfItsName) {
    write_frame(at("shot2.0107.exr"), make_planes(48, 32));
    expect_ends(through(at("shot2.0107.exr"), out()), 0);
    EXPECT_EQ(outputs(), Names({"o.0107.exr"}));
    EXPECT_EQ(sidecar(107)["frame"], 107);
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
    const std::string output = at("new/deep/o.exr");
    expect_ends(through(in(1), output), 5, {"--mkdir"});
    EXPECT_FALSE(exists(at("new")));
    expect_ends(through(in(1), output, {"--mkdir"}), 0);
    EXPECT_TRUE(exists(output));
    // A file in its place is never replaced.
    expect_ends(through(in(1), at("fxaa.yaml/o.exr"), {"--mkdir"}), 5, {"is not a folder"});
}

TEST_F(SequenceTest, BadArgumentsAreUsageErrors) {
    write_sequence(at(""), {1});
    for (const Arguments& more : {Arguments{"--on-existing", "maybe"},
                                  {"--missing", "no"},
                                  {"--on-error", "x"},
                                  {"--precision", "fp64"},
                                  {"--threads", "0"},
                                  {"--profile", "maya"},
                                  {"--device", "first"},
                                  {"--no-such-option"},
                                  {"--set", "fxaa.presett=12"},
                                  {"--set", "motion_blur.samples=5"},
                                  {"--no-elide=no_rule"},
                                  {"--elide", "still_blocks"},
                                  {"--view", "left"},
                                  {"--view-layer", "no_layer"},
                                  {"--log-format", "xml"},
                                  {"--frames", "1:2"},
                                  {"--chunk", "4/3"},
                                  {"extra"}}) {
        SCOPED_TRACE(more[0]);
        expect_ends(filter("fxaa", more), 2, {"error"});
    }
    for (const Arguments& words : {Arguments{},
                                   {"filter"},
                                   {"run", "paper", "-i", in()},
                                   {"passes", "--json", "--markdown"}})
        expect_ends(run(words), 2);
    for (const std::string& input : {at("a.##.##.exr"), "depth=" + in()})
        expect_ends(through(input, out()), 2);
    EXPECT_EQ(outputs(), Names());
}

TEST_F(SequenceTest, MissingFramesUnderEachPolicy) {
    write_sequence(at(""), {1, 2, 5});
    expect_ends(filter("fxaa", {"--frames", "1-5"}), 4, {in(3), "3-4"});
    EXPECT_EQ(outputs(), Names());
    expect_ends(filter("fxaa", {"--frames", "1-5", "--missing", "skip"}), 1, {in(4)});
    EXPECT_EQ(outputs(), Names({"o.0001.exr", "o.0002.exr", "o.0005.exr"}));
    // Holes that nobody asked for are said, and held too.
    const Arguments overwrite = {"--on-existing", "overwrite"}, hold = {"--missing", "hold"};
    expect_ends(filter("fxaa", overwrite), 0, {"3-4"});
    expect_ends(filter("fxaa", joined(overwrite, hold)), 1);
    EXPECT_EQ(sidecar(3)["held_from"], 2);
    expect_ends(filter("fxaa", joined(joined(overwrite, hold), {"--frames", "0-5"})), 1);
    EXPECT_EQ(outputs().size(), 6u);
    EXPECT_EQ(read_color(out(0)).data, read_color(out(1)).data);  // no earlier frame: the next
    // No frames at all: never 0.
    for (const char* policy : {"error", "skip", "hold"})
        expect_ends(through(at("no.####.exr"), at("out/no.####.exr"),
                            {"--frames", "1-2", "--missing", policy}),
                    4);
    expect_ends(through(at("no.####.exr"), out()), 4);
    // One that has its own file is named by it.
    write_frame(at("z.0001.exr"), make_planes(48, 32));
    const auto outcome = through("color=" + in() + ",depth=" + at("z.####.exr"), out(),
                                 {"--frames", "1-2", "--on-existing", "overwrite"});
    expect_ends(outcome, 4, {at("z.0002.exr")});
    EXPECT_FALSE(contains(outcome.err, in(2))) << outcome.err;
}

TEST_F(SequenceTest, AFrameThatFailsUnderStopAndContinue) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6});
    write_text(in(4), read_text(in(4)).substr(0, 3000));
    expect_ends(filter("fxaa"), 1, {in(4)});
    EXPECT_EQ(outputs(), Names({"o.0001.exr", "o.0002.exr", "o.0003.exr"}));
    expect_ends(filter("fxaa", {"--on-error", "continue", "--on-existing", "overwrite"}), 1,
                {"5 written, 1 failed of 6 frames"});
    EXPECT_FALSE(exists(out(4)));
    // With a single frame, the exit code is that of the cause.
    EXPECT_EQ(filter("fxaa", {"--frames", "4"}).code, 4);
}

// tests/run has what makes an output one of the same work.
TEST_F(SequenceTest, ExistingOutputsUnderEachPolicy) {
    write_sequence(at(""), {1, 2, 3});
    ASSERT_EQ(filter("fxaa", {"--frames", "2"}).code, 0);
    const std::string second = read_text(out(2));
    expect_ends(filter("fxaa"), 5, {out(2), "--on-existing"});
    EXPECT_EQ(outputs(), Names({"o.0002.exr"}));  // nothing is started
    expect_ends(filter("fxaa", {"--on-error", "continue"}), 1);
    EXPECT_EQ(outputs().size(), 3u);
    EXPECT_TRUE(read_text(out(2)) == second);
    expect_ends(filter("fxaa", {"--on-existing", "skip"}), 0, {"3 skipped of 3"});
    expect_ends(filter("fxaa", {"--on-existing", "overwrite"}), 0, {"3 written of 3"});
}

TEST_F(SequenceTest, SizesAndChannelsMayChange) {
    write_frame(in(1), make_planes(48, 32));
    write_frame(in(2), make_planes(64, 24, 2));
    FrameFile nuke;
    nuke.convention = "nuke";
    write_frame(in(3), make_planes(31, 17, 3), nuke);
    expect_ends(filter("all"), 0);
    EXPECT_EQ(read_color(out(2)).width, 64);
    EXPECT_EQ(sidecar(2)["profile"], "cycles");
    EXPECT_EQ(sidecar(3)["profile"], "nuke");
    // Pixels equal those of each frame filtered separately.
    const ImageF third = read_color(out(3));
    ASSERT_EQ(filter("all", {"--frames", "3", "--on-existing", "overwrite"}).code, 0);
    EXPECT_EQ(read_color(out(3)).data, third.data);
}

}  // namespace
}  // namespace postchain::test::sequence_test

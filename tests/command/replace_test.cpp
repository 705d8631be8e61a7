// Which files each subcommand writes or never replaces:
//   new       written
//   foreign   refused under --on-existing fail, and unchanged
//   an input  refused under every --on-existing, and unchanged, whatever its name
#include "tests/command/replace_fixture.h"

namespace postchain::test::replace_test {
namespace {

const char* const kPicture = "P2\n2 2\n255\n255 255\n255 0\n";  // of an aperture

TEST_F(ReplaceTest, Run) {
    const Arguments command = {"run", at("fxaa.yaml"),  "-i",   in(), "--frames", "1",
                               "-o",  to("o.####.exr"), "--png"};
    check({"o.0001.exr", command, option("--camera"), kCamera});
    check({"o.0001.exr.json", command, option("--profile"), kProfile});
    check({"o.0001.png", command, word(1), kFxaa});
}

TEST_F(ReplaceTest, Diff) {
    const Arguments command = {"diff",      in(1),   at("other.0001.exr"),
                               "--metric",  "mse",   "--map",
                               to("m.png"), "--map", to("m.exr")};
    for (const char* file : {"m.png", "m.exr"})
        check({file, command, option("--profile"), kProfile});
}

TEST_F(ReplaceTest, Tune) {
    const Arguments command = {"tune", at("fxaa.yaml"), "-i",       in(),        "-r",
                               in(),   "--frames",      "1",        "--repeats", "1",
                               "-o",   to("t.yaml"),    "--budget", "100s"};
    check({"t.yaml", command, option("--camera"), kCamera});
}

TEST_F(ReplaceTest, Scene) {
    const Arguments command = {"scene", "still",  "-o",    to("s"),           "--frames",
                               "1",     "--size", "32x18", "--truth-samples", "1"};
    for (const char* file : {"s/gbuf.0001.exr", "s/sharp.0001.exr", "s/mb.0001.exr",
                             "s/dof.0001.exr", "s/both.0001.exr"})
        check({file, command});
    write_text(at("heart.pgm"), kPicture);
    const Arguments picture = joined(command, {"--aperture-image", at("heart.pgm")});
    for (const char* file : {"s/aperture.exr", "s/camera.json"})
        check({file, picture, word(picture.size() - 1), kPicture});
}

TEST_F(ReplaceTest, Sheet) {
    check({"s.png", {"sheet", in(), "-o", to("s.png")}, option("--profile"), kProfile});
}

TEST_F(ReplaceTest, Stress) {
    const Arguments command = {"stress", at("fxaa.yaml"), "--only", "/size/1*fp32", "-o", to("s")};
    for (const char* file : {"s/index.html", "s/stress.txt"})
        check({file, command, word(1), kFxaa});
    check({"s/stress.json", command,
           [](const Arguments& words, const std::string& path) {
               return joined(words, {"--set", "camera.aperture_image=" + path});
           },
           kPicture});
}

TEST_F(ReplaceTest, PictureOfTheApertureOfACameraFile) {
    write_text(at("camera.json"), "{\"aperture_image\": \"w/o.0001.png\"}");
    write_text(to("o.0001.png"), kPicture);
    expect_ends(run({"run", at("fxaa.yaml"), "-i", in(), "--frames", "1", "-o", to("o.####.exr"),
                     "--png", "--camera", at("camera.json"), "--on-existing", "overwrite"}),
                2, {"bokeh kernel"});
    EXPECT_EQ(read_text(to("o.0001.png")), kPicture);
}

TEST_F(ReplaceTest, AnotherFramesInput) {
    for (const char* frame : {"9", "10", "11"})
        write_frame(to(std::string("f.") + frame + ".exr"), make_planes(24, 16));
    const std::string ten = read_text(to("f.10.exr"));
    // Frame 0 of f.1#.exr is f.10.exr; its output would be f.0.exr, and frame 1's f.1.exr. With
    // f.1#.exr -> f.#0.exr the output of frame 1 is the input of frame 0.
    const Arguments command = {"run", at("fxaa.yaml"), "-i",       to("f.1#.exr"),
                               "-o",  to("f.#0.exr"),  "--frames", "1"};
    const auto outcome = run(joined(command, {"--on-existing", "overwrite"}));
    expect_ends(outcome, 2, {"f.10.exr"});
    expect_remedy(outcome, "run");
    EXPECT_TRUE(read_text(to("f.10.exr")) == ten);
    EXPECT_EQ(files().size(), 3u);
    // Two digits in, one out: f.9.exr belongs to another sequence and may be written.
    EXPECT_EQ(run(word(5)(command, to("g.#.exr"))).code, 0);
}

TEST_F(ReplaceTest, NoFrameIsAddedToWhatIsRead) {
    for (const char* policy : {"hold", "skip"}) {
        expect_ends(run({"run", at("fxaa.yaml"), "-i", in(), "-o", in(), "--frames", "5",
                         "--missing", policy}),
                    2, {in(5), "frame of the input"});
        EXPECT_FALSE(exists(in(5)));
    }
    // A map beside the compared images.
    expect_ends(run({"diff", in(), in(), "--map", at("in.%04d.exr"), "--on-existing", "overwrite"}),
                2);
    expect_ends(run({"diff", in(1), at("other.####.exr"), "--map", at("other.9999.exr")}), 2);
    EXPECT_FALSE(exists(at("other.9999.exr")));
}

// With --on-error continue each frame is checked separately; inputs are not.
TEST_F(ReplaceTest, OnErrorContinue) {
    write_text(to("o.0001.exr.json"), kStranger);
    const Arguments command = {"run", at("fxaa.yaml"),  "-i",         in(),
                               "-o",  to("o.####.exr"), "--on-error", "continue"};
    const auto outcome = run(command);
    EXPECT_EQ(outcome.code, 1) << outcome.text();
    EXPECT_TRUE(read_text(to("o.0001.exr.json")) == kStranger);
    EXPECT_FALSE(exists(to("o.0001.exr")));
    EXPECT_TRUE(exists(to("o.0002.exr")));
    expect_remedy(outcome, "run");
    fresh();
    write_text(to("o.0001.exr.json"), kCamera);
    EXPECT_EQ(run(joined(command, {"--camera", to("o.0001.exr.json")})).code, 2);
    EXPECT_EQ(files().size(), 1u);
}

}  // namespace
}  // namespace postchain::test::replace_test

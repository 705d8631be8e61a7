// Bad input through the command: exit codes, messages with file, place and remedy, and no
// leftovers.
#include <sys/stat.h>

#include <cmath>

#include "tests/command/fixture.h"

namespace postchain::test::input_test {
namespace {

namespace fs = std::filesystem;

class InputTest : public CommandTest {
  protected:
    // Runs CHAIN over one file and expects failure: the code, the file's name and each of `words`
    // in stderr, no output and no sidecar.
    void expect_refused(int code, Arguments words, const std::string& chain = "fxaa",
                        const Arguments& more = {}) {
        words.push_back(in(1));
        const auto outcome = filter(chain, more);
        expect_ends(outcome, code, words);
        EXPECT_TRUE(fs::is_empty(at("out"))) << outcome.text();
    }
};

#if !POSTCHAIN_SANITIZED  // the address sanitizer reserves terabytes
// Less memory than the frame needs: an error with the file name, whichever allocation fails.
TEST_F(InputTest, TooLittleMemory) {
    ASSERT_TRUE(io::write_planes_exr(in(1), ImageF(8192, 3000, 3, 0.25f), {"R", "G", "B"}).ok());
    for (long mebibytes : {700L, 900L, 1200L}) {
        const auto outcome = filter("fxaa", {"--threads", "1"}, {.memory_bytes = mebibytes << 20});
        EXPECT_TRUE(outcome.code == 1 || outcome.code == 4 || outcome.code == 6)
            << mebibytes << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "memory") || outcome.code == 6) << outcome.err;
        EXPECT_FALSE(contains(outcome.err, "damaged")) << outcome.err;
        EXPECT_TRUE(fs::is_empty(at("out")));
    }
}
#endif

// tests/io has damage of every kind, tests/run the message on a plane that is missing.
TEST_F(InputTest, WhatCannotBeFiltered) {
    write_text(in(1), "no EXR");
    expect_refused(4, {"not an EXR"});
    fs::remove(in(1));
    ASSERT_EQ(mkfifo(in(1).c_str(), 0600), 0);  // never written to
    expect_refused(4, {"not a file"});
    fs::remove(in(1));
    FrameFile file;
    file.convention = "generic";
    file.motion = false;
    write_frame(in(1), make_planes(48, 32), file);
    expect_refused(4, {"needs motion"}, "all");
    expect_refused(4, {"profile cycles", "<layer>.Vector.Z"}, "all", {"--profile", "cycles"});
}

// Also if other frames of the sequence are valid, whichever failed first.
TEST_F(InputTest, NonFiniteValuesAreAnErrorUnderStrict) {
    Planes planes = make_planes(48, 32);
    planes.color.at(20, 3, 0) = NAN;
    write_frame(in(1), planes);
    expect_refused(7, {"1 non-finite", "(20, 3)", "--strict"}, "all", {"--strict"});
    write_frame(in(2), make_planes(48, 32));
    test::write_text(in(0), "no EXR");
    expect_ends(filter("all", {"--strict", "--on-error", "continue"}), 7);
    EXPECT_EQ(outputs(), std::vector<std::string>({"o.0002.exr"}));
}

// tests/io refuses one pixel more.
TEST_F(InputTest, WideAsATexture) {
    write_frame(in(1), make_planes(16384, 2));
    expect_ends(filter("all"), 0);
    EXPECT_EQ(read_color(out(1)).width, 16384);
}

TEST_F(InputTest, TextThatIsNoUtf8) {
    FrameFile file;
    file.attributes["comment"] = std::string("caf\xe9 \xff");
    write_frame(at("caf\xe9.0001.exr"), make_planes(24, 16), file);
    const auto inspected = run({"inspect", at("caf\xe9.0001.exr"), "--json"});
    EXPECT_EQ(inspected.code, 0) << inspected.text();
    EXPECT_EQ(json_lines(inspected.out).size(), 1u);
    const auto filtered = run({"run", at("fxaa.yaml"), "-i", at("caf\xe9.####.exr"), "-o",
                               at("out/caf\xe9.####.exr"), "--json", "--log-format", "json"});
    EXPECT_EQ(filtered.code, 0) << filtered.text();
    EXPECT_EQ(json_lines(filtered.out).size(), 2u);
    json_lines(filtered.err);
    // Also if inspect fails after it has described the file.
    io::PlanesFile planes;
    const ImageF z(8, 8, 1, 1.0f);
    planes.channels = {{"Z", io::PixelType::float32, &z, 0}};
    planes.attributes = file.attributes;
    ASSERT_TRUE(io::write_planes_exr(in(2), planes).ok());
    const auto failed = run({"inspect", in(2), "--json"});
    EXPECT_EQ(failed.code, 4) << failed.text();
    EXPECT_EQ(json_lines(failed.out).size(), 1u);
}

}  // namespace
}  // namespace postchain::test::input_test

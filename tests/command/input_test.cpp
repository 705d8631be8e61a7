// Bad input through the command: exit codes, messages with file, place and remedy, and no
// leftovers.
#include <sys/stat.h>

#include <cmath>
#include <csignal>

#include "tests/command/fixture.h"

namespace postchain::test::input_test {
namespace {

namespace fs = std::filesystem;

class InputTest : public CommandTest {
  protected:
    // Runs CHAIN over one file and expects failure: the code, the file's name and each of `words`
    // in stderr, no output and no sidecar.
    void expect_refused(int code, const std::vector<std::string>& words,
                        const std::string& chain = "fxaa", const Arguments& more = {}) {
        const auto outcome = filter(chain, more);
        EXPECT_EQ(outcome.code, code) << outcome.text();
        EXPECT_EQ(outcome.signal, 0);
        EXPECT_TRUE(contains(outcome.err, in(1))) << outcome.err;
        for (const auto& word : words) EXPECT_TRUE(contains(outcome.err, word)) << outcome.err;
        EXPECT_TRUE(fs::is_empty(at("out"))) << outcome.text();
    }
    // Runs and expects success with each of `words` in stderr.
    void expect_warned(const std::vector<std::string>& words, const std::string& chain = "all",
                       const Arguments& more = {}) {
        const Arguments all = joined({"--on-existing", "overwrite"}, more);
        const auto outcome = filter(chain, all);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        for (const auto& word : words) EXPECT_TRUE(contains(outcome.err, word)) << outcome.err;
    }
};

TEST_F(InputTest, TruncatedAtAnyLength) {
    write_frame(in(1), make_planes(48, 32));
    const std::string bytes = read_text(in(1));
    for (size_t keep : {size_t(0), size_t(60), bytes.size() - 1}) {
        write_text(in(1), bytes.substr(0, keep));
        SCOPED_TRACE(keep);
        expect_refused(4, {keep == 0 ? "empty" : "in.0001.exr"});
    }
}

TEST_F(InputTest, NotAnExr) {
    write_text(in(1), std::string(5000, 'x'));
    expect_refused(4, {"not an EXR"});
    write_text(in(1), "\x89PNG\r\n\x1a\n" + std::string(100, '\0'));
    expect_refused(4, {"not an EXR"});
    fs::remove(in(1));
    fs::create_directory(in(1));
    expect_refused(4, {"not a file"});
    fs::remove(in(1));
    ASSERT_EQ(mkfifo(in(1).c_str(), 0600), 0);  // never written to
    expect_refused(4, {"not a file"});
    fs::remove(in(1));
    fs::create_symlink(in(1), in(1));
    EXPECT_EQ(filter("fxaa", {"--frames", "1"}).code, 4);
}

#if !POSTCHAIN_SANITIZED  // the address sanitizer reserves terabytes
// Less memory than the frame needs: an error with the file name, whichever allocation fails.
TEST_F(InputTest, TooLittleMemory) {
    ASSERT_TRUE(io::write_planes_exr(in(1), ImageF(8192, 3000, 3, 0.25f), {"R", "G", "B"}).ok());
    for (long mebibytes : {700L, 900L, 1200L}) {
        Launch launch;
        launch.memory_bytes = mebibytes << 20;
        const auto outcome = filter("fxaa", {"--threads", "1"}, launch);
        EXPECT_EQ(outcome.signal, 0) << mebibytes << outcome.text();
        EXPECT_TRUE(outcome.code == 1 || outcome.code == 4 || outcome.code == 6)
            << mebibytes << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "memory") || outcome.code == 6) << outcome.err;
        EXPECT_FALSE(contains(outcome.err, "damaged")) << outcome.err;
        EXPECT_TRUE(fs::is_empty(at("out")));
    }
}
#endif

TEST_F(InputTest, MissingPlanesAreNamedWithWhatWasFound) {
    FrameFile file;
    file.convention = "generic";
    file.depth = false;
    write_frame(in(1), make_planes(48, 32), file);
    expect_refused(4, {"inverse_depth", "looked for as Z", "found were", "motion.x"}, "all");
    file.depth = true;
    file.motion = false;
    write_frame(in(1), make_planes(48, 32), file);
    expect_refused(4, {"needs motion", "looked for as motion.x", "found were", " Z"}, "all");
    // So does a named profile that does not fit.
    expect_refused(4, {"profile cycles", "<layer>.Vector.Z"}, "all", {"--profile", "cycles"});
    // plan reports it too, and inspect lists the channels.
    expect_ends(run({"plan", at("all.yaml"), "-i", in(1)}), 4, {"looked for as motion.x"});
    // No color at all.
    ASSERT_TRUE(
        io::write_planes_exr(in(1), ImageF(8, 8, 1, 1.0f), {"Z"}, io::OnExisting::overwrite).ok());
    expect_refused(4, {"color", "Z"});
}

// tests/run counts every kind.
TEST_F(InputTest, NonFiniteValuesAreAnErrorUnderStrict) {
    Planes planes = make_planes(48, 32);
    planes.color.at(20, 3, 0) = NAN;
    planes.motion.at(7, 9, 1) = NAN;
    write_frame(in(1), planes);
    expect_refused(7, {"2 non-finite", "(20, 3)", "--strict"}, "all", {"--strict"});
    // Also if other frames of the sequence are valid, whichever failed first.
    write_frame(in(2), make_planes(48, 32));
    test::write_text(in(0), "no EXR");
    expect_ends(filter("all", {"--strict", "--on-error", "continue"}), 7);
    EXPECT_EQ(outputs(), std::vector<std::string>({"o.0002.exr"}));
}

TEST_F(InputTest, WideAsATexture) {
    write_frame(in(1), make_planes(16384, 2));
    expect_warned({});
    EXPECT_EQ(read_color(out(1)).width, 16384);
    fs::remove(out(1));
    fs::remove(out(1) + ".json");
    write_frame(in(1), make_planes(16385, 2));
    expect_refused(4, {"16385", "16384"}, "all");
    write_frame(in(1), make_planes(2, 16385));
    expect_refused(4, {"16385", "16384"}, "all");
}

TEST_F(InputTest, TextInMetadataThatIsNoUtf8) {
    FrameFile file;
    file.attributes["comment"] = std::string("caf\xe9 \xff");
    write_frame(in(1), make_planes(24, 16), file);
    expect_warned({}, "fxaa");
    const auto inspect = run({"inspect", in(1), "--json"});
    EXPECT_EQ(inspect.code, 0) << inspect.text();
    EXPECT_EQ(json_lines(inspect.out).size(), 1u);
    // Also if inspect fails after it has described the file.
    file.convention = "generic";
    io::PlanesFile planes;
    const ImageF z(8, 8, 1, 1.0f);
    planes.channels = {{"Z", io::PixelType::float32, &z, 0}};
    planes.attributes = file.attributes;
    ASSERT_TRUE(io::write_planes_exr(in(2), planes).ok());
    const auto failed = run({"inspect", in(2), "--json"});
    EXPECT_EQ(failed.code, 4) << failed.text();
    EXPECT_EQ(json_lines(failed.out).size(), 1u);
    // Also in a file name.
    fs::copy_file(in(1), at("caf\xe9.0001.exr"));
    const auto named = run({"run", at("fxaa.yaml"), "-i", at("caf\xe9.####.exr"), "-o",
                            at("out/caf\xe9.####.exr"), "--json", "--log-format", "json"});
    EXPECT_EQ(named.code, 0) << named.text();
    EXPECT_EQ(json_lines(named.out).size(), 1u);
    json_lines(named.err);
}

}  // namespace
}  // namespace postchain::test::input_test

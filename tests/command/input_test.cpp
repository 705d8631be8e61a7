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
        Arguments all = {"--on-existing", "overwrite"};
        all.insert(all.end(), more.begin(), more.end());
        const auto outcome = filter(chain, all);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        for (const auto& word : words) EXPECT_TRUE(contains(outcome.err, word)) << outcome.err;
    }
};

FilePart rgba(Imf::PixelType type = Imf::HALF) {
    FilePart part;
    part.channels = {{"A", type}, {"B", type}, {"G", type}, {"R", type}};
    return part;
}

TEST_F(InputTest, DeepWithoutDepthIsRefused) {
    FilePart part = rgba(Imf::FLOAT);
    part.name = "deep image";
    part.deep = true;
    part.compression = Imf::ZIPS_COMPRESSION;
    write_file(in(1), {part});
    expect_refused(4, {"part 0 'deep image'", "is deep without a channel Z", "flatten"});
}

TEST_F(InputTest, LuminanceChromaIsRefusedByName) {
    FilePart part;
    part.channels = {{"BY", Imf::HALF, 2}, {"RY", Imf::HALF, 2}, {"Y", Imf::HALF, 1}};
    part.data = part.display = {{0, 0}, {15, 15}};
    write_file(in(1), {part});
    expect_refused(4, {"luminance", "chroma"});
}

TEST_F(InputTest, SubsampledIsRefusedByName) {
    FilePart part;
    part.channels = {{"A"}, {"B", Imf::HALF, 2}, {"G"}, {"R"}};
    part.data = part.display = {{0, 0}, {15, 15}};
    write_file(in(1), {part});
    expect_refused(4, {"B", "subsampled"});
}

TEST_F(InputTest, TruncatedAtAnyLength) {
    write_frame(in(1), make_planes(48, 32));
    const std::string bytes = read_text(in(1));
    for (size_t keep : {size_t(0), size_t(1), size_t(4), size_t(9), size_t(60), size_t(400),
                        bytes.size() / 2, bytes.size() - 100, bytes.size() - 1}) {
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

TEST_F(InputTest, DamagedBytesEverywhereNeverCrash) {
    write_frame(in(1), make_planes(24, 16));
    const std::string bytes = read_text(in(1));
    for (size_t i = 0; i < 12; ++i) {
        std::string damaged = bytes;
        for (size_t j = 0; j < 4; ++j) damaged[(8 + i * 97 + j * 13) % bytes.size()] ^= char(0x5a);
        write_text(in(1), damaged);
        const auto outcome = filter("fxaa", {"--on-existing", "overwrite"});
        EXPECT_EQ(outcome.signal, 0) << i << outcome.text();
        EXPECT_TRUE(outcome.code == 0 || outcome.code == 4) << i << outcome.text();
    }
}

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
    const auto plan = run({"plan", at("all.yaml"), "-i", in(1)});
    EXPECT_EQ(plan.code, 4);
    EXPECT_TRUE(contains(plan.err, "looked for as motion.x")) << plan.err;
    // No color at all.
    ASSERT_TRUE(
        io::write_planes_exr(in(1), ImageF(8, 8, 1, 1.0f), {"Z"}, io::OnExisting::overwrite).ok());
    expect_refused(4, {"color", "Z"});
}

TEST_F(InputTest, VectorsThatSayNothingAreWarned) {
    Planes planes = make_planes(48, 32);
    std::fill(planes.motion.data.begin(), planes.motion.data.end(), 0.0f);
    std::fill(planes.back.data.begin(), planes.back.data.end(), 0.0f);
    write_frame(in(1), planes);
    expect_warned({"every motion vector is zero", "Cycles", in(1)});
    std::fill(planes.motion.data.begin(), planes.motion.data.end(), 10000.0f);
    write_frame(in(1), planes);
    expect_warned({"sentinel", "every motion vector"});
    EXPECT_EQ(sidecar(1)["health"]["input_sentinel_motion"], 48 * 32);
}

TEST_F(InputTest, HalfDepthIsWarned) {
    FrameFile file;
    file.depth_type = io::PixelType::half;
    write_frame(in(1), make_planes(48, 32), file);
    expect_warned({"depth is half float", in(1)});
    // No error if no pass reads depth.
    const auto outcome = filter("fxaa", {"--on-existing", "overwrite"});
    EXPECT_FALSE(contains(outcome.err, "half float")) << outcome.err;
}

TEST_F(InputTest, NonFiniteValuesAreCountedAndNamed) {
    Planes planes = make_planes(48, 32);
    planes.color.at(20, 3, 0) = NAN;
    planes.color.at(21, 3, 1) = INFINITY;
    planes.depth.at(5, 2) = NAN;
    planes.depth.at(6, 2) = INFINITY;  // a common value for background
    planes.motion.at(7, 9, 1) = NAN;
    planes.motion.at(8, 9, 0) = -INFINITY;
    planes.depth.at(9, 9) = -1;
    FrameFile file;
    file.origin_x = -10;
    file.origin_y = -4;
    write_frame(in(1), planes, file);
    // Pixel (5, 2) of the planes is (-5, -2) of the file.
    expect_warned({"2 pixels with non-finite color", "1 pixels with non-finite depth",
                   "2 pixels with non-finite motion", "(-5, -2)", "1 pixels with depth <= 0"});
    const auto health = sidecar(1)["health"];
    EXPECT_EQ(health["input_nonfinite_color"], 2);
    EXPECT_EQ(health["input_nonfinite_depth"], 1);
    EXPECT_EQ(health["input_nonfinite_motion"], 2);
    EXPECT_EQ(health["input_negative_depth"], 1);
    EXPECT_EQ(health["input_first_nonfinite"], Json::array({-5, -2}));
    EXPECT_EQ(health["output_nonfinite"], 0);
    for (float value : read_color(out(1)).data) ASSERT_TRUE(std::isfinite(value));

    fs::remove(out(1));
    fs::remove(out(1) + ".json");
    expect_refused(7, {"5 non-finite", "(-5, -2)", "--strict"}, "all", {"--strict"});
    // Also if other frames of the sequence are valid.
    write_frame(in(2), make_planes(48, 32));
    const auto partly = filter("all", {"--strict", "--on-error", "continue"});
    EXPECT_EQ(partly.code, 7) << partly.text();
    EXPECT_EQ(outputs(), std::vector<std::string>({"o.0002.exr"}));
    const auto sound = filter("all", {"--strict", "--frames", "2", "--on-existing", "overwrite"});
    EXPECT_EQ(sound.code, 0) << sound.text();
    // Whichever frame failed first.
    test::write_text(in(0), "no EXR");
    const auto later =
        filter("all", {"--strict", "--on-error", "continue", "--on-existing", "overwrite"});
    EXPECT_EQ(later.code, 7) << later.text();
}

// Negative alpha divides a blurred color by almost zero: the result exceeds half's range.
TEST_F(InputTest, HalfOverflowIsRefusedOrClamped) {
    Planes planes = make_planes(48, 32);
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 48; ++x) {
            const bool odd = x % 2;
            for (int c = 0; c < 3; ++c) planes.color.at(x, y, c) = odd ? 60000.0f : 0.0f;
            planes.color.at(x, y, 3) = odd ? 1.0f : -0.9f;
        }
    }
    FrameFile file;
    file.convention = "generic";
    file.color_type = io::PixelType::half;
    write_frame(in(1), planes, file);
    write_text(at("straight.yaml"),
               "profile: 1\nname: straight\n"
               "color: [{channels: [[R, G, B, A]], unpremultiplied: true}]\n"
               "depth: [{channels: [[Z]]}]\nmotion: [{channels: [[motion.x, motion.y]]}]\n");
    const Arguments profile = {"--profile", at("straight.yaml"), "--on-existing", "overwrite"};
    const auto refused = filter("motion_blur", profile);
    EXPECT_EQ(refused.code, 5) << refused.text();
    EXPECT_TRUE(contains(refused.err, "half") && contains(refused.err, out(1))) << refused.err;
    EXPECT_TRUE(fs::is_empty(at("out")));
    Arguments clamp = profile;
    clamp.insert(clamp.end(), {"--overflow", "clamp"});
    const auto clamped = filter("motion_blur", clamp);
    EXPECT_EQ(clamped.code, 0) << clamped.text();
    EXPECT_GT(sidecar(1)["health"]["output_half_overflow"], 0);
    for (float value : read_color(out(1)).data) ASSERT_LE(std::abs(value), 65504);
}

// Streaks and discs beyond a limit are said to be cut: how many pixels, and the largest.
TEST_F(InputTest, CutsAreSaid) {
    const Planes planes = make_planes(48, 32);
    write_frame(in(1), planes);
    int fast = 0;  // half of a streak above 1 px at half a frame
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 48; ++x)
            fast += std::hypot(planes.motion.at(x, y, 0), planes.motion.at(x, y, 1)) > 4;
    ASSERT_GT(fast, 0);
    const std::string streaks = concat("motion_blur: the half-length of a streak of ", fast,
                                       " pixels is cut to 1 px; the largest is 1.6770");
    expect_warned({streaks, "set max_blur_px"}, "all", {"--set", "motion_blur.max_blur_px=1"});
    EXPECT_TRUE(contains(sidecar(1)["warnings"].dump(), streaks));
    EXPECT_EQ(sidecar(1)["resolved"]["passes"][0]["values"]["longest_streak_px"]["value"],
              2 * 0.25 * std::sqrt(45.0));
    expect_warned({"depth_of_field: the radius of the circle of confusion of ",
                   " pixels is cut to 0.75 px; the largest is ", "set max_radius_px"},
                  "all",
                  {"--set", "depth_of_field.max_radius_px=0.75", "--set",
                   "depth_of_field.method=inverse_warp"});
    const auto whole = filter("all", {"--on-existing", "overwrite"});
    EXPECT_FALSE(contains(whole.err, " is cut to ")) << whole.err;
}

// No mean of such colors would fit a float.
TEST_F(InputTest, FloatColorThatOverflows) {
    Planes planes = make_planes(48, 32);
    for (float& value : planes.color.data) value = (value > 0.5f ? 1.0f : -1.0f) * 3e38f;
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 48; ++x) planes.color.at(x, y, 3) = 1;
    write_frame(in(1), planes);
    for (const char* chain : {"all", "reversed", "motion_blur"}) {
        const auto found = filter(chain, {"--on-existing", "overwrite"});
        EXPECT_EQ(found.code, 0) << found.text();
        EXPECT_TRUE(contains(found.err, "1536 pixels with non-finite color (or beyond 1e34)"))
            << found.err;
        EXPECT_EQ(sidecar(1)["health"]["input_nonfinite_color"], 1536);
        EXPECT_EQ(sidecar(1)["health"]["output_nonfinite"], 0);
        for (float value : read_color(out(1)).data) ASSERT_LE(std::abs(value), 65504.1f);
    }
    EXPECT_EQ(filter("all", {"--strict", "--on-existing", "overwrite"}).code, 7);
}

// A sun that a half cannot hold stays the brightest thing of the image.
TEST_F(InputTest, InfiniteSunIsNotBlack) {
    Planes planes = make_planes(48, 32);
    for (int y = 12; y < 20; ++y)
        for (int x = 20; x < 28; ++x)
            for (int c = 0; c < 3; ++c)
                planes.color.at(x, y, c) = std::numeric_limits<float>::infinity();
    write_frame(in(1), planes);
    EXPECT_EQ(filter("motion_blur", {"--on-existing", "overwrite"}).code, 0);
    const ImageF sun = read_color(out(1));
    EXPECT_GT(*std::max_element(sun.data.begin(), sun.data.end()), 6e4f);
    EXPECT_EQ(filter("motion_blur", {"--nonfinite", "zero", "--on-existing", "overwrite"}).code, 0);
    const ImageF black = read_color(out(1));
    EXPECT_LT(*std::max_element(black.data.begin(), black.data.end()), 10.0f);
}

TEST_F(InputTest, WindowsThatDiffer) {
    FrameFile file;
    file.origin_x = -8;
    file.origin_y = -5;
    file.display = io::Window{0, 0, 31, 21};
    write_frame(in(1), make_planes(48, 32), file);
    expect_warned({});
    const auto output = io::ExrFile::open(out(1));
    ASSERT_TRUE(output.ok());
    EXPECT_EQ(output->parts()[0].data_window, (io::Window{-8, -5, 39, 26}));
    EXPECT_EQ(output->parts()[0].display_window, (io::Window{0, 0, 31, 21}));
    EXPECT_EQ(read_color(out(1)).width, 48);
    // A data window outside the display window and the chain's reach.
    file.origin_x = 300;
    file.origin_y = 40;
    write_frame(in(1), make_planes(48, 32), file);
    expect_warned({}, "fxaa");
    EXPECT_EQ(io::ExrFile::open(out(1))->parts()[0].data_window, (io::Window{299, 39, 347, 71}));
}

TEST_F(InputTest, OnePixel) {
    write_frame(in(1), make_planes(1, 1));
    expect_warned({});
    const ImageF color = read_color(out(1));
    EXPECT_EQ(color.width * color.height, 1);
    expect_warned({}, "reversed");
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

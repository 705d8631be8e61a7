// Frames whose data window is cropped to non-clear pixels: the filtered result equals that of whole
// frames bit for bit, whatever each file leaves out.
#include <gtest/gtest.h>

#include "tests/command/fixture.h"
#include "tools/sequence/exr/part_pixels.h"

namespace postchain::test::cropped_test {
namespace {

using io::Window;

constexpr int kWidth = 120, kHeight = 90, kFrames = 4;
const Window kDisplay = {0, 0, kWidth - 1, kHeight - 1};

// A square moving on a clear background with the distances that Blender writes.
Planes whole_planes(int frame) {
    Planes planes{ImageF(kWidth, kHeight, 4), ImageF(kWidth, kHeight, 1, 1e10f),
                  ImageF(kWidth, kHeight, 2), ImageF(kWidth, kHeight, 2)};
    const int left = 40 + 6 * frame, top = 34 + 3 * frame;
    for (int y = top; y < top + 16; ++y) {
        for (int x = left; x < left + 20; ++x) {
            const bool stripe = (x - left + y - top) % 5 < 2;
            const float color[] = {stripe ? 0.9f : 0.2f, 0.4f, stripe ? 0.1f : 0.6f, 1};
            std::copy_n(color, 4, planes.color.pixel(x, y));
            planes.depth.at(x, y) = 3;
            planes.motion.at(x, y, 0) = planes.back.at(x, y, 0) = 6;
            planes.motion.at(x, y, 1) = planes.back.at(x, y, 1) = 3;
        }
    }
    return planes;
}

// The non-clear pixels, with a margin that differs from frame to frame.
Window crop_of(int frame) {
    const int left = 40 + 6 * frame, top = 34 + 3 * frame;
    return {left - frame, top - 2, left + 19, top + 15 + frame % 2};
}

Planes cropped(const Planes& planes, const Window& to) {
    return {io::placed(planes.color, kDisplay, to), io::placed(planes.depth, kDisplay, to),
            io::placed(planes.motion, kDisplay, to), io::placed(planes.back, kDisplay, to)};
}

Window data_window(const std::string& path) {
    auto file = io::ExrFile::open(path);
    EXPECT_TRUE(file.ok()) << file.status().message();
    return file.ok() ? file->parts()[0].data_window : Window();
}

class CroppedTest : public CommandTest {
  protected:
    void write_both(const std::vector<int>& frames = {1, 2, 3, 4}, FrameFile file = {}) {
        file.object_ids = true;
        file.display = kDisplay;
        std::filesystem::create_directories(at("whole"));
        for (int frame : frames) {
            const Planes planes = whole_planes(frame);
            file.origin_x = file.origin_y = 0;
            write_frame(whole("in", frame), planes, file);
            const Window crop = crop_of(frame);
            file.origin_x = crop.min_x;
            file.origin_y = crop.min_y;
            write_frame(in(frame), cropped(planes, crop), file);
        }
    }
    std::string whole(const std::string& name, int frame) const {
        return at(concat("whole/", name, ".000", frame, ".exr"));
    }
    // Both results are the same image, and the output contains all light.
    void expect_same_image(const std::string& chain, const Arguments& more = {}) {
        SCOPED_TRACE(chain);
        const Arguments options = joined({"--on-existing", "overwrite"}, more);
        expect_ends(run(joined({"run", at(chain + ".yaml"), "-i", at("whole/in.####.exr"), "-o",
                                at("whole/out.####.exr")},
                               options)),
                    0);
        expect_ends(filter(chain, options), 0);
        for (int frame = 1; frame <= kFrames; ++frame) {
            const Window window = data_window(out(frame));
            EXPECT_TRUE(kDisplay.contains(window)) << window.text();
            EXPECT_TRUE(window.contains(crop_of(frame))) << window.text();
            const ImageF expected = read_color(whole("out", frame));
            EXPECT_GT(largest_difference(expected, whole_planes(frame).color), 0);
            EXPECT_EQ(io::placed(read_color(out(frame)), window, kDisplay), expected)
                << "frame " << frame;
        }
    }
};

TEST_F(CroppedTest, TheSamePictureAsOfTheWholeFrame) {
    write_both();
    write_text(at("warp.yaml"),
               "postchain: 1\ncamera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4,"
               " focus_distance: 2, meters_per_unit: 0.05, shutter_frames: 0.7}\n"
               "passes: [joint_blur: {samples: 16}, fxaa: {mode: directional}]\n");
    for (const char* chain : {"all", "warp"}) expect_same_image(chain);
    expect_same_image("all", {"--frames", "1-4", "--precision", "fp16"});
}

TEST_F(CroppedTest, KeptDataWindowsSayWhatIsLost) {
    write_both({2});
    write_text(at("short.yaml"),
               "postchain: 1\npasses: [motion_blur: {mode: guertin, max_blur_px: 10, samples: 5}]");
    // (22 + 22) x (18 + 22) pixels are within reach, 22 x 18 exist.
    expect_ends(filter("short", {"--data-window", "keep"}), 0,
                {"into 1364 pixels", "--data-window grow"});
    EXPECT_EQ(data_window(out(2)), crop_of(2));
    expect_ends(run({"plan", at("short.yaml"), "-i", in(), "--data-window", "keep"}), 0,
                {"into 1364 pixels"});
    EXPECT_FALSE(contains(filter("short", {"--on-existing", "overwrite"}).err, "lost"));
}

TEST_F(CroppedTest, DiffComparesInDisplayCoordinates) {
    write_both();
    // The same reach as for whole frames.
    const auto diff = [](const std::string& a, const std::string& b) {
        return run(
            {"diff", a, b, "--metric", "difference_max", "--metric", "psnr", "--metric", "flip"});
    };
    const auto same = diff(whole("in", 2), in(2));
    expect_ends(same, 0, {"data windows differ"});
    EXPECT_TRUE(contains(same.out, "difference_max   0\n")) << same.out;
    const auto values = [](const Outcome& outcome) {
        return outcome.out.substr(outcome.out.find('\n'));
    };
    const auto of_whole = diff(whole("in", 2), whole("in", 3));
    EXPECT_EQ(values(diff(in(2), in(3))), values(of_whole)) << of_whole.text();
}

}  // namespace
}  // namespace postchain::test::cropped_test

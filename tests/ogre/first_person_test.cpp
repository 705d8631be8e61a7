// A first-person view in OGRE: the weapon is masked, focus is pulled to places of the frame, and
// two sizes of one view look alike.
#include <gtest/gtest.h>

#include <string>

#include "tests/ogre/truth.h"

namespace postchain {
namespace {

constexpr double kPan = 31;  // the camera pans at its fastest
constexpr char kJoint[] = "postchain: 1\npasses: [joint_blur: {samples: 32}]\n";

class View {
  public:
    explicit View(int width = 480, int height = 270)
        : host_({.width = width, .height = height, .first_person = true}) {
        guest().lens.f_stop = 2.8f;
    }
    host::PostchainPass& guest() { return host_.postchain(); }
    pc_chain* set_chain(const char* text) { return postchain::set_chain(guest(), text); }
    ImageF draw(double frame) {
        host_.draw(frame);
        EXPECT_EQ(guest().error(), "");
        return read_texture(host_.plane(0));
    }
    // A frame and the one before it, so that it has motion.
    ImageF draw_moving(const char* chain) {
        set_chain(nullptr);
        host_.draw(kPan - 1);
        set_chain(chain);
        return draw(kPan);
    }
    ImageF plane(size_t index) const { return read_texture(host_.plane(index)); }

  private:
    host::Host host_;
};

// Share of the weapon's pixels whose color differs.
double changed_weapon(const ImageF& a, const ImageF& b, const ImageF& mask) {
    double pixels = 0, changed = 0;
    for (int y = 0; y < mask.height; ++y) {
        for (int x = 0; x < mask.width; ++x) {
            if (mask.at(x, y) < 1) continue;
            ++pixels;
            for (int c = 0; c < 3; ++c) {
                if (a.at(x, y, c) == b.at(x, y, c)) continue;
                ++changed;
                break;
            }
        }
    }
    EXPECT_GT(pixels, 0.01 * mask.width * mask.height);
    return changed / pixels;
}

TEST(FirstPerson, MaskKeepsTheWeapon) {
    View view;
    const ImageF drawn = view.draw_moving(nullptr), mask = view.plane(2);
    const ImageF masked = view.draw_moving(kJoint);
    view.guest().masked = false;
    const ImageF blurred = view.draw_moving(kJoint);
    EXPECT_EQ(changed_weapon(drawn, masked, mask), 0);
    EXPECT_GT(changed_weapon(drawn, blurred, mask), 0.5);
    EXPECT_LT(psnr(masked, drawn), 35) << "the world is not blurred";
}

// Focus goes from the sails to the wall in some frames, and ends where a lens that is set to the
// wall's distance is. The scene stands still.
TEST(FirstPerson, FocusIsPulled) {
    constexpr char kLensAlone[] = "postchain: 1\npasses: [depth_of_field]\n";
    View view(288, 162);
    view.guest().adjust = [](pc_frame& frame) {
        frame.focus_seconds = 0.06f;
        frame.frame_seconds = 1 / 24.0f;
        frame.shutter_frames = 0;
    };
    view.set_chain(nullptr);
    view.draw(kPan);
    // Hyperbolic depth, 0 near and 1 far; the axis of the lens meets the image plane at 1 unit.
    const ImageF depth = view.plane(3);
    const auto distance_at = [&](double x, double y) {
        const double z = depth.at(int(x * depth.width), int(y * depth.height));
        return 0.5 * 60 / (60 - z * (60 - 0.5));
    };
    constexpr double kSails[2] = {0.36, 0.39}, kWall[2] = {0.6, 0.55};
    const double near = distance_at(kSails[0], kSails[1]), far = distance_at(kWall[0], kWall[1]);
    EXPECT_NEAR(near, 4.2, 0.3);
    EXPECT_GT(far, 8);
    const auto fixed = [&](double distance) {
        view.guest().lens.focus_distance = float(distance);
        view.set_chain(kLensAlone);
        return view.draw(kPan);
    };
    const ImageF at_sails = fixed(near), at_wall = fixed(far);

    pc_chain* chain = view.set_chain(kLensAlone);
    const auto focus_at = [&](const double(&place)[2]) {
        EXPECT_EQ(pc_chain_set_point(chain, 0, "focus_at", place[0], place[1]), PC_OK)
            << pc_error();
    };
    focus_at(kSails);
    const ImageF begin = view.draw(kPan);
    EXPECT_GT(psnr(begin, at_sails), 60);
    focus_at(kWall);
    ImageF last = begin;
    double before = psnr(begin, at_wall);
    for (int i = 0; i < 12; ++i) {
        last = view.draw(kPan);
        const double now = psnr(last, at_wall);
        EXPECT_GE(now, before - 0.5) << "frame " << i;
        before = now;
        if (i == 1) {
            EXPECT_LT(now, 45) << "focus is pulled, not cut";
            EXPECT_LT(psnr(last, at_sails), 45);
        }
    }
    EXPECT_GT(before, 60);
}

// Means of 2 x 2 pixels.
ImageF halved(const ImageF& image) {
    ImageF result(image.width / 2, image.height / 2, image.channels, 0.0f);
    for (int y = 0; y < 2 * result.height; ++y)
        for (int x = 0; x < 2 * result.width; ++x)
            for (int c = 0; c < image.channels; ++c)
                result.at(x / 2, y / 2, c) += image.at(x, y, c) / 4;
    return result;
}

// Dynamic resolution: the blur is as long on the screen at half the size, also where its limit
// cuts it, if the limit is a part of the height.
TEST(FirstPerson, TwoSizesLookAlike) {
    const auto at_half_size = [](const std::string& limit) {
        const std::string chain = "postchain: 1\npasses: [motion_blur: {" + limit + "}]\n";
        ImageF large, small;
        {
            View view(480, 270);
            large = view.draw_moving(chain.c_str());
        }
        {
            View view(240, 135);
            small = view.draw_moving(chain.c_str());
        }
        return psnr(halved(large), small);
    };
    const double alike = at_half_size("max_blur_fraction: 0.01");
    const double pixels = at_half_size("max_blur_px: 3");
    std::printf("two sizes: %.2f dB, with a limit in pixels %.2f dB\n", alike, pixels);
    EXPECT_GT(alike, pixels + 1);
}

}  // namespace
}  // namespace postchain

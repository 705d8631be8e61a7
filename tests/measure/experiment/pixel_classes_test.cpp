#include "tools/measure/experiment/pixel_classes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace postchain::experiment::pixel_classes_test {
namespace {

using metrics::PixelClass;
using enum PixelClass;

// A frame of 41 x 9 pixels without motion, at inverse depth 0.25, seen by a lens that is focused
// there: R = 32 (1/4 - w) px.
struct Planes {
    std::map<Role, ImageF> planes = {{Role::inverse_depth, ImageF(41, 9, 1, 0.25f)},
                                     {Role::motion, ImageF(41, 9, 2)},
                                     {Role::motion_back, ImageF(41, 9, 2)}};
    FrameDescription frame;

    Planes() {
        frame.width = 41;
        frame.height = 9;
        frame.display_width = 640;
        frame.camera = {.focal_length_mm = 36,
                        .sensor_width_mm = 36,
                        .f_stop = 0.36,
                        .focus_distance = 4,
                        .shutter_frames = 0.5};
    }
    Image<PixelClass> classes() const {
        return pixel_classes(frame, [&](Role role) {
            const auto found = planes.find(role);
            return found == planes.end() ? nullptr : &found->second;
        });
    }
    size_t count(PixelClass one) const {
        const auto all = classes();
        return size_t(std::count(all.data.begin(), all.data.end(), one));
    }
};

TEST(PixelClasses, AreStillWithoutMotionAndInFocus) {
    EXPECT_EQ(Planes().count(still), 41u * 9);
}

TEST(PixelClasses, MoveByEitherVector) {
    for (const Role role : {Role::motion, Role::motion_back}) {
        Planes planes;
        planes.planes[role].at(3, 4, 1) = -0.07f;  // 1/16 px is the limit
        planes.planes[role].at(5, 4, 0) = 0.06f;
        EXPECT_EQ(planes.classes().at(3, 4), moving);
        EXPECT_EQ(planes.count(still), 41u * 9 - 1);
    }
}

// A radius of 0.5 px is the limit: an inverse depth of 1/4 +- 1/64.
TEST(PixelClasses, AreOutOfFocusByTheLens) {
    for (const double offset : {-1.05, 1.05}) {
        Planes planes;
        planes.planes[Role::inverse_depth] = ImageF(41, 9, 1, float(0.25 + offset / 64));
        planes.planes[Role::motion] = ImageF(41, 9, 2, 5);
        EXPECT_EQ(planes.count(defocused), 41u * 9);
        planes.planes[Role::inverse_depth] = ImageF(41, 9, 1, float(0.25 + offset * 0.9 / 64));
        EXPECT_EQ(planes.count(moving), 41u * 9);
        planes.planes[Role::inverse_depth] = ImageF(41, 9, 1, 0.9f);
        EXPECT_EQ(planes.count(defocused), 41u * 9);
        for (const auto value : {&Camera::focal_length_mm, &Camera::sensor_width_mm,
                                 &Camera::f_stop, &Camera::focus_distance}) {
            Planes without = planes;
            (without.frame.camera.*value).reset();
            EXPECT_EQ(without.count(moving), 41u * 9);
        }
    }
}

// A step between columns 19 and 20. The second difference sees it at both, and the reach of both is
// 2 px and the farther column's blur: a quarter of 8 px, and a lens out of focus by 3 px.
TEST(PixelClasses, AreOutlinesWithinReachOfAStep) {
    const auto width = [](double speed, double inverse_depth) {
        Planes planes;
        for (int y = 0; y < 9; ++y)
            for (int x = 20; x < 41; ++x) {
                planes.planes[Role::inverse_depth].at(x, y) = float(inverse_depth);
                planes.planes[Role::motion].at(x, y) = float(speed);
            }
        const auto classes = planes.classes();
        int pixels = 0;
        for (int x = 0; x < 41; ++x) pixels += classes.at(x, 4) == outline;
        EXPECT_EQ(classes.at(19, 4), outline);
        EXPECT_EQ(classes.at(20, 4), outline);
        return pixels;
    };
    const double out_of_focus = 0.25 + 3.0 / 32;
    EXPECT_EQ(width(0, 0.25 * 0.89), 2 * 3);  // R = 0.88 px
    EXPECT_EQ(width(8, 0.25 * 0.89), 2 * 5);
    EXPECT_EQ(width(8, out_of_focus), 2 * 7);
}

// The most blurred of the three pixels that tell a step counts, on either side of it.
TEST(PixelClasses, HaveAReachByTheLargestBlur) {
    for (const int side : {-1, 1}) {
        Planes planes;
        for (int y = 0; y < 9; ++y)
            for (int x = 0; x < 41; ++x) {
                planes.planes[Role::inverse_depth].at(x, y) =
                    (x - 20) * side > 0 ? 0.25f : 0.25f * 0.89f;
                if ((x - 20) * side > 0) planes.planes[Role::motion].at(x, y) = 12;  // 3 px of blur
            }
        const auto classes = planes.classes();
        for (int x = 0; x < 41; ++x)
            EXPECT_EQ(classes.at(x, 4) == outline, std::abs(2 * (x - 20) * side - 1) < 2 * 5)
                << x << " " << side;
    }
}

// The same between rows 3 and 4.
TEST(PixelClasses, AreOutlinesOfAStepAlongY) {
    Planes planes;
    for (int y = 4; y < 9; ++y)
        for (int x = 0; x < 41; ++x) planes.planes[Role::inverse_depth].at(x, y) = 0.25f * 0.89f;
    const auto classes = planes.classes();
    for (int y = 0; y < 9; ++y) EXPECT_EQ(classes.at(20, y) == outline, y >= 1 && y <= 6) << y;
}

// Inverse depth is linear along a plane, however steep.
TEST(PixelClasses, HaveNoOutlineOnASlope) {
    Planes planes;
    planes.frame.camera = {};
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 41; ++x)
            planes.planes[Role::inverse_depth].at(x, y) = float(0.01 + 0.1 * x + 0.02 * y);
    EXPECT_EQ(planes.count(still), 41u * 9);
    planes.planes.erase(Role::inverse_depth);
    EXPECT_EQ(planes.count(still), 41u * 9);
}

}  // namespace
}  // namespace postchain::experiment::pixel_classes_test

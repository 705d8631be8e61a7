// The sign self-check on images whose motion is known by construction.
#include "chain/frame/sign_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/images.h"

namespace postchain {
namespace {

// now(p) is a smooth texture without a period inside the frame, and next(p + v) = now(p) for the
// constant motion v.
struct Pan {
    FramePlanes planes;
    ImageF next;
};
Pan pan(double vx, double vy, bool back = true) {
    const auto texture = [](double x, double y, int c) {
        if (c == 3) return 1.0;
        return 0.5 + 0.25 * std::sin(0.31 * x + 0.17 * y + c) +
               0.2 * std::cos(0.05 * x * x / 20 - 0.23 * y + 2 * c);
    };
    const ImageF motion = test::constant_image(64, 48, {float(vx), float(vy)});
    Pan made;
    made.planes[Role::color] = test::make_image(64, 48, 4, texture);
    made.planes[Role::motion] = motion;
    if (back) made.planes[Role::motion_back] = motion;
    made.next = test::make_image(64, 48, 4,
                                 [&](int x, int y, int c) { return texture(x - vx, y - vy, c); });
    return made;
}

SignCheck check_of(const Pan& made) {
    return check_signs(made.planes, made.next);
}

TEST(SignCheck, ConfirmsTheTruth) {
    const Pan made = pan(4, -3);
    const SignCheck check = check_of(made);
    ASSERT_EQ(check.candidates.size(), 8u);
    // Pixels with 4 columns and 3 rows to either side: 56 x 42.
    EXPECT_EQ(check.pixels, 56u * 42u);
    // Whole pixels: the warp is exact. motion_back is the same displacement and ties.
    EXPECT_TRUE(check.candidates[0].as_converted());
    EXPECT_LT(check.candidates[0].error, 1e-6);
    EXPECT_EQ(check.candidates[1].text(), "motion_back (+x, +y)");
    EXPECT_FALSE(check.told_apart(check.candidates[1]));
    EXPECT_GT(check.still_error, 0.02);
    EXPECT_GT(check.margin(), 10);
    EXPECT_EQ(check.verdict(), SignVerdict::confirmed);
}

// Between pixels the next frame is interpolated, on either side of a pixel.
TEST(SignCheck, FractionsOfPixels) {
    for (const auto& [vx, vy] : {std::pair(4.75, -3.25), {-2.25, 1.5}}) {
        const SignCheck check = check_of(pan(vx, vy));
        EXPECT_TRUE(check.candidates[0].as_converted());
        EXPECT_LT(check.candidates[0].error, 2e-3) << vx;
        EXPECT_GT(check.still_error, 0.02);
    }
}

TEST(SignCheck, FindsEachWrongSign) {
    for (int sign_x : {1, -1}) {
        for (int sign_y : {1, -1}) {
            Pan made = pan(4, -3, false);
            made.planes[Role::motion] =
                test::constant_image(64, 48, {4.0f * float(sign_x), -3.0f * float(sign_y)});
            const SignCheck check = check_of(made);
            ASSERT_EQ(check.candidates.size(), 4u);
            // The best is the one that takes the flip back.
            EXPECT_EQ(check.candidates[0].sign_x, sign_x);
            EXPECT_EQ(check.candidates[0].sign_y, sign_y);
            EXPECT_EQ(check.candidates[0].text(), std::string("motion (") +
                                                      (sign_x > 0 ? "+x, " : "-x, ") +
                                                      (sign_y > 0 ? "+y)" : "-y)"));
            const bool right = sign_x == 1 && sign_y == 1;
            EXPECT_EQ(check.verdict(), right ? SignVerdict::confirmed : SignVerdict::contradicted);
            EXPECT_EQ(check.remedy(),
                      right ? ""
                            : "use a profile whose `motion` has its `scale` multiplied by (" +
                                  std::to_string(sign_x) + ", " + std::to_string(sign_y) + ")");
        }
    }
}

// The channels of both planes are exchanged, and one sign is wrong.
TEST(SignCheck, FindsTheOtherPlane) {
    Pan made = pan(4, -3);
    made.planes[Role::motion] = test::constant_image(64, 48, {-2, 6});
    made.planes[Role::motion_back] = test::constant_image(64, 48, {4, 3});
    EXPECT_EQ(check_of(made).remedy(),
              "use a profile whose `motion` has the channels of this one's `motion_back`, with "
              "their `scale` multiplied by (1, -1)");
}

// Between pixels the next frame is bilinear; where it goes beyond 0 it is black.
TEST(SignCheck, OfPartsOfAPixel) {
    const SignCheck check = check_of(pan(4.5, -2.5, false));
    EXPECT_TRUE(check.candidates[0].as_converted());
    EXPECT_LT(check.candidates[0].error, 0.004);
    EXPECT_EQ(check_of(pan(1, 0)).pixels, 62u * 48u) << "a pixel is enough";
    Pan black = pan(4, -3);
    for (float& value : black.planes[Role::color].data) value -= 2;
    for (float& value : black.next.data) value -= 2;
    EXPECT_EQ(check_of(black).verdict(), SignVerdict::undecided);
}

// Margins at their limits; of those that are told apart the smallest counts.
TEST(SignCheck, Verdicts) {
    const auto verdict = [](double margin, size_t pixels_apart = 2) {
        SignCheck check;
        check.pixels = 100;
        check.candidates = {{Role::motion, -1, 1, 0, 100, 5},
                            {Role::motion, 1, -1, 0, pixels_apart, margin}};
        return check.verdict();
    };
    EXPECT_EQ(verdict(1.11), SignVerdict::confirmed);
    EXPECT_EQ(verdict(kSignMargin), SignVerdict::undecided);
    EXPECT_EQ(verdict(1 / kSignMargin), SignVerdict::undecided);
    EXPECT_EQ(verdict(0.9), SignVerdict::contradicted);
    EXPECT_EQ(verdict(0.9, 1), SignVerdict::confirmed) << "one pixel in a hundred is too little";
}

// A pan along x does not show the sign of y; it must not make the check undecided.
TEST(SignCheck, APanAlongOneAxis) {
    const Pan made = pan(5, 0);
    const SignCheck check = check_of(made);
    EXPECT_EQ(check.verdict(), SignVerdict::confirmed);
    for (const auto& candidate : check.candidates)
        EXPECT_EQ(check.told_apart(candidate), candidate.sign_x < 0) << candidate.text();
}

TEST(SignCheck, UndecidedWhereNothingTells) {
    Pan flat = pan(4, -3);
    std::fill(flat.next.data.begin(), flat.next.data.end(), 0.5f);
    flat.planes[Role::color] = flat.next;
    const SignCheck check = check_of(flat);
    EXPECT_EQ(check.verdict(), SignVerdict::undecided);
    EXPECT_DOUBLE_EQ(check.margin(), 1);
}

TEST(SignCheck, ImpossibleCases) {
    const SignCheck slow = check_of(pan(0.5, 0));
    EXPECT_TRUE(slow.candidates.empty());
    EXPECT_EQ(slow.why_not, "nothing moves by a pixel");
    const SignCheck leaving = check_of(pan(100, 0));
    EXPECT_TRUE(leaving.candidates.empty());
    EXPECT_EQ(leaving.why_not, "each of the 3072 moving pixels leaves the picture");
    EXPECT_DOUBLE_EQ(SignCheck().margin(), 1);
    const Pan made = pan(4, -3);
    for (const auto& [width, height] : {std::pair(63, 48), {64, 47}}) {
        const SignCheck other = check_signs(made.planes, ImageF(width, height, 4));
        EXPECT_TRUE(other.candidates.empty());
        EXPECT_EQ(other.why_not, "this frame is 64x48 pixels, the next one " +
                                     std::to_string(width) + "x" + std::to_string(height));
    }
    EXPECT_EQ(check_signs(made.planes, made.next).verdict(), SignVerdict::confirmed);
    for (const Role role : {Role::color, Role::motion}) {
        FramePlanes without = made.planes;
        without.erase(role);
        EXPECT_EQ(check_signs(without, made.next).why_not, "there are no vectors, or no color");
    }
    EXPECT_EQ(check_signs(made.planes, ImageF(64, 48, 2)).why_not,
              "there are no vectors, or no color");
}

}  // namespace
}  // namespace postchain

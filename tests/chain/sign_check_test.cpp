// The sign self-check on images whose motion is known by construction.
#include "chain/frame/sign_check.h"

#include <gtest/gtest.h>

#include <cmath>

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

// The check of the whole frame as one strip.
SignCheck check_of(const Pan& made) {
    SignChecker checker;
    checker.add(made.planes, Strip::whole(made.next.height), made.next, 0);
    return checker.result();
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
            EXPECT_EQ(check.verdict(), sign_x == 1 && sign_y == 1 ? SignVerdict::confirmed
                                                                  : SignVerdict::contradicted);
        }
    }
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
}

}  // namespace
}  // namespace postchain

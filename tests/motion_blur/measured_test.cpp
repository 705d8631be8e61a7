// Measured properties. The figures are printed; docs/motion_blur.md quotes them with their bounds.

#include <cmath>
#include <cstdio>

#include "tests/motion_blur/support.h"

namespace postchain::test {
namespace {

// Two discs crossing in different directions over still, textured ground, seen through a window
// with corner (left, top).
BlurFrame window(int left, int top) {
    constexpr int kSize = 200;
    BlurFrame frame(kSize, kSize);
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const double px = x + left, py = y + top;
            frame.set_gray(x, y, float(0.2 + 0.1 * std::sin(0.4 * px) * std::cos(0.3 * py)));
            if (std::hypot(px - 90, py - 110) < 28) {
                frame.set_gray(x, y, float(0.8 + 0.1 * std::sin(0.7 * px)));
                frame.set_half_velocity(x, y, 14.35, 5.1);
                frame.depth().at(x, y) = 2;
            } else if (std::hypot(px - 140, py - 90) < 24) {
                frame.set_gray(x, y, 0.5);
                frame.set_half_velocity(x, y, -4.2, 12.7);
                frame.depth().at(x, y) = 1.5;
            }
        }
    }
    return frame;
}

// Moving the image by 1 .. r - 1 px moves the tile grid relative to the content. Measures the
// difference from the unmoved result; 0 would mean no visible grid. Without tile jitter a pixel's
// direction can change with the tile and with it every tap: only the mean has a tight bound.
TEST(Measured, ShiftAgainstTheTileGrid) {
    constexpr int kRadius = 20, kMargin = 40;
    for (const char* mode : {"guertin", "single"}) {
        const Chain chain = plain_blur({{"max_blur_px", int64_t(kRadius)}, {"mode", mode}});
        const ImageF still = blurred(chain, window(0, 0));
        double largest = 0, squares = 0;
        size_t count = 0;
        for (int shift = 1; shift < kRadius; ++shift) {
            const ImageF moved = blurred(chain, window(shift, shift));
            for (int y = kMargin; y < still.height - kMargin; ++y) {
                for (int x = kMargin; x < still.width - kMargin; ++x) {
                    const double d =
                        std::abs(double(still.at(x, y)) - moved.at(x - shift, y - shift));
                    largest = std::max(largest, d);
                    squares += d * d;
                    ++count;
                }
            }
        }
        const double rms = std::sqrt(squares / double(count));
        std::printf("  shift by 1..%d px, %s: rms %.4f (bound 0.01), largest %.3f (bound 0.25)\n",
                    kRadius - 1, mode, rms, largest);
        EXPECT_LE(rms, 0.01) << mode;
        EXPECT_LE(largest, 0.25) << mode;
        EXPECT_GT(largest, 0);  // the measurement detects a grid
    }
}

// A white half plane with half-velocity (L, 0) over still black ground. Exact: the pixel d px
// outside the edge is covered for clamp((L - d) / (2 L)) of the shutter's time.
TEST(Measured, OpacityProfile) {
    for (const char* mode : {"guertin", "single"}) {
        for (const double softness : {1.0, 20.0}) {
            constexpr double kLength = 20.5;
            BlurFrame frame(160, 9);
            for (int y = 0; y < 9; ++y) {
                for (int x = 0; x < 80; ++x) {
                    frame.set_gray(x, y, 1);
                    frame.set_half_velocity(x, y, kLength, 0);
                    frame.depth().at(x, y) = 2;
                }
            }
            const Chain chain = plain_blur(
                {{"samples", int64_t(255)}, {"mode", mode}, {"depth_softness", softness}});
            const ImageF out = blurred(chain, frame);
            double inside = 0, outside = 0;
            for (int x = 40; x < 120; ++x) {
                const double d = x - 79.5;
                const double exact = std::clamp((kLength - d) / (2 * kLength), 0.0, 1.0);
                double& worst = d < 0 ? inside : outside;
                worst = std::max(worst, std::abs(out.at(x, 4) - exact));
            }
            std::printf(
                "  opacity, %s, s = %g: off by %.3f inside the edge, %.3f outside "
                "(bound 0.4)\n",
                mode, softness, inside, outside);
            EXPECT_LE(inside, 0.4);
            EXPECT_LE(outside, 0.4);
        }
    }
}

// Sensitivity to input changes of up to 1e-3 px of half-velocity, or of the depth. Taps round to
// pixels, so with a noise image a tap that jumps changes a pixel by its weight. Still pixels
// differ: w_B is 0 for v_S = 0 and up to 1 for the smallest v_S, so noise on still motion gives
// weight to taps that had none.
TEST(Measured, Continuity) {
    struct Row {
        const char* changed;
        const char* scene;
        bool movers, still, depth;
        double largest, fraction;  // bounds
    };
    const Row rows[] = {
        {"movers", "discs", true, false, false, 0.01, 0},
        {"depth", "discs", false, false, true, 0.01, 0},
        {"still pixels", "discs", false, true, false, 0.3, 0.1},
        {"all", "noise", true, true, true, 0.5, 0.01},
    };
    const BlurFrame discs = window(0, 0), noise = random_frame(120, 120, 12, 1.2f, 51);
    for (const Row& row : rows) {
        const BlurFrame& frame = row.scene == std::string("discs") ? discs : noise;
        BlurFrame nudged = frame;
        const ImageF by = noise_image(frame.width(), frame.color().height, 3, 52, -1e-3f, 1e-3f);
        for (size_t i = 0; i < by.pixels(); ++i) {
            float* m = nudged.motion().data.data() + 2 * i;
            const bool still = m[0] == 0 && m[1] == 0;
            if (still ? row.still : row.movers)
                for (size_t c = 0; c < 2; ++c) m[c] += 4 * by.data[3 * i + c];
            if (row.depth) nudged.depth().data[i] *= 1 + by.data[3 * i + 2];
        }
        const Chain chain = plain_blur();
        const Difference d = compare(blurred(chain, nudged), blurred(chain, frame), 0.01);
        std::printf(
            "  1e-3 on %s, %s: largest change %.2g (bound %g), %.2f %% of the pixels above "
            "0.01 (bound %g %%)\n",
            row.changed, row.scene, d.max, row.largest, 100 * d.fraction, 100 * row.fraction);
        EXPECT_GT(d.max, 0);
        EXPECT_LE(d.max, row.largest) << row.changed;
        EXPECT_LE(d.fraction, row.fraction) << row.changed;
    }
}

}  // namespace
}  // namespace postchain::test

// v -> -v, mirror images and quarter turns, without jitter, at sizes that are multiples of r;
// lengths are equal only if all are. A transformed frame sums the same taps in another order, so
// the bounds are rounding: 1e-5 on the GPU, 1e-12 in the reference.

#include "tests/motion_blur/support.h"

namespace postchain::test::symmetry_test {
namespace {

constexpr int kSize = 48;

// Speeds of 3 px and more: w_c is each pixel's own direction and no sign of w_p matters.
BlurFrame brisk_frame() {
    BlurFrame frame = random_frame(kSize, kSize, 12, 1.4f, 21);
    for (float& m : frame.motion().data) m += m < 0 ? -12.0f : 12.0f;
    return frame;
}

// All pixels slow, and along v_max: neither side of it is closer.
BlurFrame slow_pan() {
    BlurFrame frame = random_frame(kSize, kSize, 12, 1.4f, 22);
    frame.set_all_half_velocities(1.013, 0.471);
    return frame;
}

// Pixel (x, y) of the result is pixel source(x, y) of the frame, with its motion rotated by `turn`.
using Place = std::array<int, 2>;
using Vector = std::array<float, 2>;
struct Transform {
    const char* name;
    Place (*source)(int x, int y);
    Vector (*turn)(float vx, float vy);
};

BlurFrame apply(const Transform& t, const BlurFrame& frame) {
    BlurFrame out = frame;
    const auto& in = frame.planes;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const auto [sx, sy] = t.source(x, y);
            for (int c = 0; c < 4; ++c) out.color().at(x, y, c) = in.at(Role::color).at(sx, sy, c);
            out.depth().at(x, y) = in.at(Role::inverse_depth).at(sx, sy);
            const ImageF& m = in.at(Role::motion);
            const auto turned = t.turn(m.at(sx, sy, 0), m.at(sx, sy, 1));
            for (int c = 0; c < 2; ++c) out.motion().at(x, y, c) = turned[size_t(c)];
        }
    }
    return out;
}

template <class T>
Image<T> apply(const Transform& t, const Image<T>& image) {
    Image<T> out = image;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            for (int c = 0; c < image.channels; ++c)
                out.at(x, y, c) = image.at(t.source(x, y)[0], t.source(x, y)[1], c);
    return out;
}

TEST(Symmetry, ReversalMirrorsAndTurns) {
    constexpr int kLast = kSize - 1;
    const Transform transforms[] = {
        {"v -> -v",
         [](int x, int y) {
             return Place{x, y};
         },
         [](float vx, float vy) {
             return Vector{-vx, -vy};
         }},
        {"mirror in x",
         [](int x, int y) {
             return Place{kLast - x, y};
         },
         [](float vx, float vy) {
             return Vector{-vx, vy};
         }},
        {"mirror in y",
         [](int x, int y) {
             return Place{x, kLast - y};
         },
         [](float vx, float vy) {
             return Vector{vx, -vy};
         }},
        {"quarter turn",
         [](int x, int y) {
             return Place{y, kLast - x};
         },
         [](float vx, float vy) {
             return Vector{-vy, vx};
         }},
        {"transpose",
         [](int x, int y) {
             return Place{y, x};
         },
         [](float vx, float vy) {
             return Vector{vy, vx};
         }},
    };
    for (const BlurFrame& frame : {brisk_frame(), slow_pan()})
        for (const char* mode : {"guertin", "single"}) {
            for (const char* split : {"even", "variance"}) {
                for (const char* border : {"skip", "clamp"}) {
                    const Chain chain = plain_blur({{"mode", mode},
                                                    {"sample_split", split},
                                                    {"border", border},
                                                    {"max_blur_px", int64_t(16)}});
                    const ImageF gpu = blurred(chain, frame);
                    const ImageD cpu = reference_stages_of(chain, frame)["color"];
                    for (const Transform& t : transforms) {
                        // floor((i+1)u) > floor(iu) is not the same read backwards, and v -> -v
                        // reads the taps backwards.
                        const bool reversal = &t == &transforms[0];
                        if (reversal && split == std::string("variance")) continue;
                        const BlurFrame other = apply(t, frame);
                        const Difference g = compare(blurred(chain, other), apply(t, gpu), 1e-5);
                        EXPECT_EQ(g.fraction, 0) << mode << " " << split << " " << border << " "
                                                 << t.name << ": " << g.text;
                        const Difference r = compare(reference_stages_of(chain, other)["color"],
                                                     apply(t, cpu), 1e-12);
                        EXPECT_EQ(r.fraction, 0) << "reference " << t.name << ": " << r.text;
                    }
                }
            }
        }
}

}  // namespace
}  // namespace postchain::test::symmetry_test

// v -> -v, a mirror image and an exchange of x and y, without jitter, at sizes that are multiples
// of r; lengths are equal only if all are. A transformed frame sums the same taps in another order,
// so the bounds are rounding: 1e-5 on the GPU, 1e-12 in the reference.

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

enum class Transform { reversal, mirror, transpose };

template <class T>
Image<T> apply(Transform t, const Image<T>& image) {
    Image<T> out = image;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            for (int c = 0; c < image.channels; ++c)
                out.at(x, y, c) = t == Transform::reversal ? image.at(x, y, c)
                                  : t == Transform::mirror ? image.at(kSize - 1 - x, y, c)
                                                           : image.at(y, x, c);
    return out;
}

BlurFrame apply(Transform t, const BlurFrame& frame) {
    BlurFrame out = frame;
    for (auto& [role, plane] : out.planes) plane = apply(t, plane);
    ImageF& motion = out.motion();
    for (size_t i = 0; i < motion.data.size(); i += 2) {
        if (t == Transform::transpose) std::swap(motion.data[i], motion.data[i + 1]);
        if (t != Transform::transpose) motion.data[i] *= -1;
        if (t == Transform::reversal) motion.data[i + 1] *= -1;
    }
    return out;
}

void expect_symmetric(const Chain& chain, const BlurFrame& frame, bool reversible) {
    const ImageF gpu = blurred(chain, frame);
    const ImageD cpu = reference_stages_of(chain, frame)["color"];
    for (const Transform t : {Transform::reversal, Transform::mirror, Transform::transpose}) {
        if (t == Transform::reversal && !reversible) continue;
        SCOPED_TRACE(concat("transform ", int(t), ", ", chain.text()));
        const BlurFrame other = apply(t, frame);
        const Difference g = compare(blurred(chain, other), apply(t, gpu), 1e-5);
        EXPECT_EQ(g.fraction, 0) << g.text;
        const Difference r =
            compare(reference_stages_of(chain, other)["color"], apply(t, cpu), 1e-12);
        EXPECT_EQ(r.fraction, 0) << "reference: " << r.text;
    }
}

TEST(Symmetry, OfReversalMirrorAndTranspose) {
    for (const BlurFrame& frame : {brisk_frame(), slow_pan()})
        for (const std::string mode : {"guertin", "single"})
            for (const std::string split : {"even", "variance"})
                for (const std::string border : {"skip", "clamp"})
                    // floor((i+1)u) > floor(iu) is not the same read backwards, and v -> -v reads
                    // the taps backwards.
                    expect_symmetric(plain_blur({{"mode", mode},
                                                 {"sample_split", split},
                                                 {"border", border},
                                                 {"max_blur_px", int64_t(16)}}),
                                     frame, split == "even");
}

}  // namespace
}  // namespace postchain::test::symmetry_test

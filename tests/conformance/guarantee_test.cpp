// Every pass keeps what it guarantees (chain/pass/guarantees.h), and one that guarantees too much
// is found. Constants: variant_test.cpp. Mirrors, turns and light are measured by the stability
// matrix (tests/stress).
#include <climits>
#include <cstring>

#include "tests/conformance/conformance.h"

namespace postchain::guarantee_test {
namespace {

using test::TestFrame;

// Pixels, both ends included.
struct Box {
    int x0 = INT_MAX, y0 = INT_MAX, x1 = -1, y1 = -1;
    void add(int x, int y) {
        x0 = std::min(x0, x), x1 = std::max(x1, x);
        y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
    void add(const Box& o) {
        if (o.x1 < 0) return;
        add(o.x0, o.y0);
        add(o.x1, o.y1);
    }
    bool contains(const Box& o) const {
        return o.x1 < 0 || (o.x0 >= x0 && o.y0 >= y0 && o.x1 <= x1 && o.y1 <= y1);
    }
    Box grown(int px) const { return x1 < 0 ? *this : Box{x0 - px, y0 - px, x1 + px, y1 + px}; }
    std::string text() const { return concat(x0, ",", y0, " to ", x1, ",", y1); }
};

Box changed(const ImageF& a, const ImageF& b) {
    Box box;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            if (std::memcmp(a.pixel(x, y), b.pixel(x, y), sizeof(float) * size_t(a.channels)) != 0)
                box.add(x, y);
    return box;
}

Box not_finite(const ImageF& image) {
    Box box;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < image.channels; ++c)
                if (!std::isfinite(image.at(x, y, c))) box.add(x, y);
    return box;
}

class GuaranteeTest : public Conformance {
  protected:
    static ImageF color_of(const Chain& chain, const FrameDescription& frame,
                           const FramePlanes& planes) {
        return test::filter(chain, frame, planes, everything()).at(Role::color);
    }

    // The facts and the size of these planes, with the camera of `frame`.
    static FrameDescription described(const FramePlanes& planes, const FrameDescription& frame) {
        FrameDescription anew = test::describe(planes);
        anew.camera = frame.camera;
        anew.display_width = frame.display_width;
        return anew;
    }

    // Each of these returns a description of the broken guarantee; empty: it is kept.

    static std::string wrong_range(const Chain& chain, double tolerance) {
        for (const auto& [width, height] : kSizes) {
            TestFrame frame = moving_frame(width, height);
            ImageF& color = frame.planes[Role::color];
            color = test::noise_image(width, height, 4, 3, -2.0f, 50.0f);
            const ImageF out = color_of(chain, frame.description, frame.planes);
            for (size_t c = 0; c < 4; ++c) {
                float low = INFINITY, high = -INFINITY;
                for (size_t i = c; i < color.data.size(); i += 4) {
                    low = std::min(low, color.data[i]);
                    high = std::max(high, color.data[i]);
                }
                const float more = float(tolerance) * std::max(std::abs(low), std::abs(high));
                for (size_t i = c; i < out.data.size(); i += 4)
                    if (!(out.data[i] >= low - more && out.data[i] <= high + more))
                        return concat(out.data[i], " of ", low, " to ", high, " at ", width);
            }
        }
        return "";
    }

    // A finite change of one pixel changes none beyond the reach. A value that is not finite, which
    // an engine may hand in, spoils no more pixels than that; it may change those around them too,
    // because steps compare pixels with those next to them.
    static std::string wrong_reach(const Chain& chain, std::optional<double> claimed = {}) {
        const int width = 141, height = 101;  // more than what the passes reach from the middle
        const TestFrame frame = moving_frame(width, height);
        const double reach = claimed.value_or(chain.reach(frame.description).depends_px);
        const ImageF before = color_of(chain, frame.description, frame.planes);
        for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
            // In the near layer, on its border, in the far one.
            for (const auto& [x, y] : {std::array{width / 2, height / 2},
                                       std::array{width / 4, height / 2}, std::array{2, 3}}) {
                const auto with = [&, x = x, y = y](float value) {
                    FramePlanes planes = frame.planes;
                    for (int c = 0; c < planes[role].channels; ++c)
                        planes[role].at(x, y, c) = value;
                    return color_of(chain, frame.description, planes);
                };
                const std::string where = concat(name_of(role), " at ", x, ",", y);
                Box reached;
                for (const float value : {0.0f, 97.0f, -97.0f, 60000.0f})
                    reached.add(changed(with(value), before));
                const int most = int(std::min(reach, double(width)));
                if (!Box{x, y, x, y}.grown(most).contains(reached))
                    return concat(where, " changes ", reached.text(), "; guaranteed: ", reach);
                for (const float value : {NAN, INFINITY, -INFINITY}) {
                    const ImageF out = with(value);
                    const Box spoiled = not_finite(out), box = changed(out, before);
                    if (!reached.contains(spoiled) || !reached.grown(1).contains(box))
                        return concat(where, ", ", value, ": spoils ", spoiled.text(), ", changes ",
                                      box.text(), " beyond ", reached.text());
                }
            }
        return "";
    }

    // One bright pixel in black, under one long motion and out of focus.
    static std::string wrong_spread(const Chain& chain, std::optional<double> claimed = {}) {
        TestFrame frame = moving_frame(1, 1);
        frame.description.display_width = 640;
        const double spread = claimed.value_or(chain.reach(frame.description).spreads_px);
        if (std::isinf(spread)) return "";
        const int middle = int(spread) + 8, side = 2 * middle + 1;
        FramePlanes planes;
        const ImageF black = planes[Role::color] = test::constant_image(side, side, {0, 0, 0, 0});
        planes[Role::inverse_depth] = test::constant_image(side, side, {0.5f});
        planes[Role::motion] = test::constant_image(side, side, {500, 300});
        for (int c = 0; c < 4; ++c) planes[Role::color].at(middle, middle, c) = 7;
        const Box lit =
            changed(color_of(chain, described(planes, frame.description), planes), black);
        if (Box{middle, middle, middle, middle}.grown(int(spread)).contains(lit)) return "";
        return concat("light of ", middle, ",", middle, " at ", lit.text(),
                      "; guaranteed: ", spread, " px");
    }

    // Two windows on a larger frame, one lattice apart: far from their borders both show the same.
    static std::string wrong_shift(const Chain& chain, int lattice,
                                   std::optional<int> claimed = {}) {
        if (lattice < 1) return "guaranteed without a lattice";
        FrameDescription camera = moving_frame(1, 1).description;
        camera.display_width = 640;
        const int reach = claimed ? *claimed : int(std::ceil(chain.reach(camera).depends_px));
        const int side = 2 * reach + lattice + 16;
        const TestFrame large =
            test::layered_frame(side + lattice, side + lattice, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
        const auto window = [&](int x, int y) {
            FramePlanes planes;
            for (const auto& [role, plane] : large.planes) {
                ImageF& to = planes[role] = ImageF(side, side, plane.channels);
                for (int row = 0; row < side; ++row)
                    std::copy_n(plane.pixel(x, y + row), side * plane.channels, to.pixel(0, row));
            }
            return color_of(chain, described(planes, camera), planes);
        };
        const ImageF still = window(0, 0);
        for (const bool along_x : {true, false}) {
            const int dx = along_x ? lattice : 0, dy = along_x ? 0 : lattice;
            const ImageF moved = window(dx, dy);
            for (int y = lattice + reach; y < side - reach; ++y)
                for (int x = lattice + reach; x < side - reach; ++x)
                    if (std::memcmp(still.pixel(x, y), moved.pixel(x - dx, y - dy), 16) != 0)
                        return concat("after a move by ", dx, ",", dy, " px ", x, ",", y,
                                      " is another");
        }
        return "";
    }

    // Quiet planes at the limit of the guarantee; the other planes stay busy.
    static std::string wrong_quiet(const Chain& chain, RoleSet driven_by) {
        if (driven_by.empty()) return "";
        TestFrame frame = moving_frame(67, 41);
        frame.description.camera.shutter_frames = 1;
        if (driven_by.has(Role::color))
            for (float& value : frame.planes[Role::color].data)
                value = 0.5f * (1 + float(kQuietContrast) * (value - 0.5f));
        if (driven_by.has(Role::inverse_depth))
            frame.planes[Role::inverse_depth] = ImageF(67, 41, 1, 0.1f);  // the plane in focus
        if (driven_by.has(Role::motion)) {
            ImageF& motion = frame.planes[Role::motion];
            for (size_t i = 0; i < motion.data.size(); i += 2) {
                motion.data[i] = float(2 * kQuietSpeedPx * 0.5999);
                motion.data[i + 1] = float(2 * kQuietSpeedPx * (i % 3 ? -0.8 : 0.8));
            }
        }
        const ImageF out =
            color_of(chain, described(frame.planes, frame.description), frame.planes);
        const bool same = test::equal_bits(out, frame.planes.at(Role::color));
        return same ? "" : "acts where " + driven_by.text() + " are quiet";
    }
};

TEST_P(GuaranteeTest, ColorsStayInTheRangeOfTheInput) {
    const auto convex =
        chain().that_guarantees([](const Guarantees& one) { return one.convex.has_value(); });
    if (convex) {
        EXPECT_EQ(wrong_range(*convex, *convex->guarantees().convex), "");
    }
}
TEST_P(GuaranteeTest, NothingFartherThanTheReachCounts) {
    EXPECT_EQ(wrong_reach(short_chain()), "");
}
TEST_P(GuaranteeTest, LightGoesNoFartherThanItsSpread) {
    EXPECT_EQ(wrong_spread(short_chain()), "");
}
TEST_P(GuaranteeTest, MovesWithThePictureByItsLattice) {
    const auto moved = short_chain().that_guarantees(
        [](const Guarantees& one) { return one.symmetries.count(Symmetry::shift) > 0; });
    if (moved) {
        EXPECT_EQ(wrong_shift(*moved, moved->guarantees().lattice_px), "");
    }
}
TEST_P(GuaranteeTest, DoesNothingWhereWhatDrivesItIsQuiet) {
    EXPECT_EQ(wrong_quiet(chain(), chain().guarantees().driven_by), "");
}

FOR_EVERY_PASS(GuaranteeTest);

class Boasts : public GuaranteeTest {};

// Each check finds a pass that does not keep what it is said to guarantee.
TEST_F(Boasts, AreFound) {
    using test::chain_of;
    EXPECT_NE(wrong_range(chain_of("echo"), 0), "");
    EXPECT_NE(wrong_shift(chain_of("fxaa"), 0), "") << "no lattice";
    EXPECT_NE(wrong_shift(chain_of("vignette"), 1, 0), "");
    EXPECT_NE(wrong_shift(chain_of("motion_blur"), 1, 150), "");
    EXPECT_NE(wrong_reach(chain_of("fxaa"), 0), "");
    EXPECT_NE(wrong_spread(chain_of("motion_blur"), 0), "");
    for (const Role role : {Role::color, Role::inverse_depth, Role::motion}) {
        EXPECT_NE(wrong_quiet(chain_of("vignette"), {role}), "") << name_of(role);
    }
}

}  // namespace
}  // namespace postchain::guarantee_test

// The guest gives the pixels of the command, whatever form the host's textures have.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/guest/host.h"
#include "tests/support/gpu.h"

namespace postchain::test::pixels_test {
namespace {

class Pixels : public SharedScene {};

double changed(const ImageF& a, const ImageF& b) {
    return compare(a, b, 1e-3).fraction;
}

TEST_F(Pixels, CanonicalTexturesGiveTheCommandsBits) {
    const ImageF found = filtered(made(), host().frame);
    expect_equal(found, expected());
    EXPECT_GT(changed(found, plane(Role::color)), 0.2);
    // Nothing is imported or exported, and running without elision changes no pixel.
    EXPECT_THAT(pc::explain(guest().get()), ::testing::Not(::testing::HasSubstr("import.comp")));
    pc_frame whole = host().frame;
    whole.flags |= PC_NO_ELISION;
    expect_equal(filtered(made(), whole), expected());
}

// The frame before alone, and both. Each in place, and in conventions of its own.
TEST_F(Pixels, NeighborsGiveTheCommandsBits) {
    const auto made = chain("joint_blur");
    const HostNeighbor before = neighbor_of(host(), Neighbor::before),
                       after = neighbor_of(host(), Neighbor::after);
    TestFrame test = host().test;
    pc_frame frame = host().frame;
    ImageF alone = by_executor(test, "joint_blur");

    test = with_neighbor(std::move(test), before, Neighbor::before);
    frame.before = &before.frame;
    const ImageF with_before = by_executor(test, "joint_blur");
    EXPECT_GT(changed(with_before, alone), 0.01);
    expect_equal(filtered(made, frame), with_before);

    test = with_neighbor(std::move(test), after, Neighbor::after);
    const ImageF with_both = by_executor(test, "joint_blur");
    EXPECT_GT(changed(with_both, with_before), 0.01);
    // Rows from the bottom in a rectangle, a distance, vectors in parts of a pixel with a jitter,
    // and brighter color than the frame's. Factors are powers of two, so that nothing is rounded.
    ImageF color = after.planes.at(Role::color), distance = after.planes.at(Role::inverse_depth),
           motion = with_y_up(after.planes.at(Role::motion));
    for (size_t i = 0; i < color.data.size(); ++i)
        if (i % 4 != 3) color.data[i] *= 4;
    for (float& value : distance.data) value = 1 / value;
    for (size_t i = 0; i < motion.data.size(); ++i)
        motion.data[i] = (motion.data[i] + (i % 2 ? 0.25f : -0.5f)) / 2;
    const auto at = [](unsigned format, const ImageF& plane, int x, int y) {
        return HostTexture::inside(format, upside_down(plane), 128, 80, x, y);
    };
    const HostTexture own_color = at(GL_RGBA32F, color, 5, 7),
                      own_depth = at(GL_R32F, distance, 1, 2),
                      own_motion = at(GL_RG32F, motion, 32, 20);
    pc_frame turned = after.frame;
    turned.flags = PC_BOTTOM_LEFT | PC_MOTION_JITTERED | PC_MOTION_TO_NEXT | PC_NO_ELISION;
    turned.width = kWidth;
    turned.height = kHeight;
    turned.color = own_color;
    turned.depth = own_depth;
    turned.motion = own_motion;
    turned.depth_encoding = PC_DEPTH_LINEAR;
    turned.pre_exposure = 4;
    turned.motion_scale[0] = turned.motion_scale[1] = 2;
    turned.jitter_px[0] = 0.5f;
    turned.other_jitter_px[1] = 0.25f;
    frame.after = &turned;
    expect_equal(filtered(made, frame), with_both);
    EXPECT_THAT(pc::explain(guest().get()), ::testing::HasSubstr("import_after"));

    // Each frame has an exposure of its own.
    const auto times = [](ImageF image, float factor) {
        for (size_t i = 0; i < image.data.size(); ++i)
            if (i % 4 != 3) image.data[i] *= factor;
        return image;
    };
    const HostTexture half(GL_RGBA32F, times(plane(Role::color), 0.5f)),
        quarter(GL_RGBA32F, times(before.planes.at(Role::color), 0.25f)),
        two(GL_R32F, ImageF(1, 1, 1, 2)), four(GL_R32F, ImageF(1, 1, 1, 4));
    pc_frame earlier = before.frame;
    earlier.color = quarter;
    earlier.exposure = four;
    frame = host().frame;
    frame.color = half;
    frame.exposure = two;
    frame.before = &earlier;
    expect_equal(times(filtered(made, frame), 2), with_before);

    // The output may be a plane of a neighbor, which is then read before. The last step of this
    // pass reads it.
    const HostNeighbor overwritten = neighbor_of(host(), Neighbor::before);
    frame = host().frame;
    frame.before = &overwritten.frame;
    frame.output = overwritten.color;
    expect_equal(filtered(chain("motion_blur"), frame),
                 by_executor(with_neighbor(host().test, before, Neighbor::before), "motion_blur"));
}

// At cuts, with another size, at half resolution and under a mask.
TEST_F(Pixels, NeighborsThatAreNotUsed) {
    const auto made = chain("joint_blur");
    const HostNeighbor before = neighbor_of(host(), Neighbor::before);
    const HostTexture output(GL_RGBA32F, kWidth, kHeight),
        mask(GL_R32F, ImageF(kWidth, kHeight, 1));
    const std::function<void(pc_frame&, pc_frame&)> changes[] = {
        [](pc_frame& f, pc_frame&) { f.flags |= PC_CAMERA_CUT; },
        [](pc_frame&, pc_frame& neighbor) { neighbor.flags |= PC_CAMERA_CUT; },
        [](pc_frame&, pc_frame& neighbor) { neighbor.width = kWidth - 1; },
        [&](pc_frame& f, pc_frame&) { f.flags |= PC_HALF_RESOLUTION; },
        [&](pc_frame& f, pc_frame&) { f.mask = mask; }};
    for (const auto& change : changes) {
        SCOPED_TRACE(&change - changes);
        pc_frame frame = host().frame, neighbor = before.frame;
        frame.output = output;
        change(frame, neighbor);
        const ImageF expected = filtered(made, frame);
        frame.before = &neighbor;
        expect_equal(filtered(made, frame), expected);
    }
}

TEST_F(Pixels, FastMathChangesRoundingAlone) {
    for (const char* passes : {kPasses, "joint_blur,fxaa"}) {
        const auto made = chain(passes);
        pc_frame fast = host().frame;
        fast.flags |= PC_FAST_MATH;
        EXPECT_LT(changed(filtered(made, fast), filtered(made, host().frame)), 0.01) << passes;
    }
}

// debug_view "fill": what the frame does not show, behind the moving square and beyond the border,
// is red.
TEST_F(Pixels, TheFillViewIsTheFillMask) {
    TestFrame masked = host().test;
    masked.planes[Role::layers] = constant_image(kWidth, kHeight, {1, 0, 0, 0});
    masked.description.planes.add(Role::layers);
    masked.description.layers = 1;
    masked.description.fill_layer = 0;
    for (const char* passes : {"motion_blur", "fxaa,motion_blur,depth_of_field", "fxaa"}) {
        const auto made = chain(passes);
        pc_frame frame = host().frame;
        const ImageF result = filtered(made, frame);
        frame.debug_view = "fill";
        const ImageF view = filtered(made, frame);
        const ImageF mask = by_executor(masked, passes, Precision::fp32, Role::layers);
        double filled = 0;
        for (size_t i = 0; i < view.pixels(); ++i) {
            ASSERT_EQ(view.data[4 * i], mask.data[4 * i + 2]) << passes;
            ASSERT_EQ(view.data[4 * i + 1], 0) << passes;
            filled += double(view.data[4 * i]);
        }
        EXPECT_EQ(filled > 10, std::string(passes) != "fxaa") << passes;
        frame.debug_view = nullptr;
        expect_equal(filtered(made, frame), result);
    }
}

// A renderer's halves overflow in a sun, which keeps its light.
TEST_F(Pixels, HalvesInAndHalvesBetween) {
    auto host = canonical_frame(kWidth, kHeight);
    ImageF pixels = host.test.planes.at(Role::color);
    pixels.at(40, 25, 0) = pixels.at(41, 25, 1) = INFINITY;
    const HostTexture color(GL_RGBA16F, pixels);
    host.test.planes[Role::color] = read(color, kWidth, kHeight);  // rounded
    for (float& value : host.test.planes[Role::color].data) value = std::min(value, 65504.0f);
    host.test.description.bounds.color_is_half = true;
    pc_frame frame = host.frame;
    frame.color = color;
    frame.flags |= PC_HALF_PLANES;
    const pc_texture result = prepare_and_run(guest(), made(), frame);
    EXPECT_EQ(result.internal_format, unsigned(GL_RGBA16F));
    expect_equal(read(result, kWidth, kHeight), by_executor(host.test, kPasses, Precision::fp16));
}

TEST_F(Pixels, PixelAspect) {
    auto host = canonical_frame(kWidth, kHeight);
    host.test.description.pixel_aspect = 2;
    pc_frame frame = host.frame;
    frame.pixel_aspect = 2;
    const ImageF wide = filtered(made(), frame);
    expect_equal(wide, by_executor(host.test, kPasses));
    EXPECT_GT(changed(wide, expected()), 0.05);
}

// Rows from the bottom with their vectors, and a rectangle in larger textures, give the same image
// bit for bit, because a scale of 1 or -1 does not round.
TEST_F(Pixels, RowsFromTheBottomAndRectangles) {
    const ImageF up = with_y_up(plane(Role::motion));
    const auto at = [](unsigned format, const ImageF& plane, int x, int y) {
        return HostTexture::inside(format, upside_down(plane), 128, 80, x, y);
    };
    const HostTexture color = at(GL_RGBA32F, plane(Role::color), 5, 7);
    const HostTexture depth = at(GL_R32F, plane(Role::inverse_depth), 32, 20);
    const HostTexture motion = at(GL_RG32F, up, 0, 1);
    const HostTexture output(GL_RGBA32F, ImageF(128, 80, 4, 55));
    pc_frame frame = host().frame;
    frame.flags = PC_MOTION_TO_NEXT;
    frame.width = kWidth;
    frame.height = kHeight;
    frame.color = color;
    frame.depth = depth;
    frame.motion = motion;
    const pc_texture own = prepare_and_run(guest(), made(), frame);
    expect_equal(upside_down(read(own, kWidth, kHeight)), expected());

    frame.output = output;
    frame.output.x = 11;
    frame.output.y = 13;
    const pc_texture result = prepare_and_run(guest(), made(), frame);
    EXPECT_EQ(result.name, output.texture().name);
    expect_equal(upside_down(read(result, kWidth, kHeight)), expected());
    const ImageF all = read(output, 128, 80);
    EXPECT_EQ(all.at(10, 13), 55) << "beside the rectangle";
    EXPECT_EQ(all.at(11 + kWidth, 13 + kHeight - 1), 55);
    EXPECT_EQ(all.at(11, 12), 55);
}

// A window that becomes wider, then higher. Textures have the largest size from the start.
TEST_F(Pixels, FramesOfOneChangedSide) {
    auto info = pc::create_info();
    info.max_width = 57;
    info.max_height = 41;
    const pc::Instance guest = pc::create(info);
    const auto made = chain("fxaa");
    for (const auto& [width, height] :
         {std::pair(40, 24), {57, 24}, {57, 41}, {40, 41}, {40, 24}}) {
        const auto host = canonical_frame(width, height);
        expect_equal(read(prepare_and_run(guest, made, host.frame), width, height),
                     by_executor(host.test, "fxaa"));
    }
}

// Views in turn, beside and below each other in one texture, to which the last step writes: none
// writes into another one's part.
TEST_F(Pixels, ViewsShareAnOutput) {
    const auto made = chain("fxaa");
    const ImageF expected = filtered(made, host().frame);
    const HostTexture output(GL_RGBA32F, 2 * kWidth, 2 * kHeight);
    const auto at = [&](int view) {
        pc_frame frame = host().frame;
        frame.width = kWidth;
        frame.height = kHeight;
        frame.output = output;
        frame.output.x = view % 2 * kWidth;
        frame.output.y = view / 2 * kHeight;
        if (view == 3) frame.debug_view = "input.color";
        return frame;
    };
    for (const int view : {0, 1, 2, 3, 0}) prepare_and_run(guest(), made, at(view));
    for (const int view : {0, 1, 2}) expect_equal(read(at(view).output, kWidth, kHeight), expected);
    expect_equal(read(at(3).output, kWidth, kHeight), plane(Role::color));
}

// A vector's hue is its direction, as a color's on the wheel, from red along x; a number's sign is
// warm or cool.
TEST_F(Pixels, ViewsOfVectorsAndNumbers) {
    const struct {
        float x, y;
        std::array<float, 3> color;
    } vectors[] = {{0, 0, {0, 0, 0}},        {32, 0, {1, 0, 0}},        {-32, 0, {0, 1, 1}},
                   {0, 8, {0.25f, 0.5f, 0}}, {0, -8, {0.25f, 0, 0.5f}}, {128, 0, {1, 1, 1}}};
    const HostTexture motion(GL_RG32F, make_image(kWidth, kHeight, 2, [&](int x, int, int c) {
                                 return c ? vectors[x / 16].y : vectors[x / 16].x;
                             }));
    pc_frame frame = host().frame;
    frame.motion = motion;
    frame.debug_view = "host.motion";
    const ImageF view = filtered(made(), frame);
    for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(view.at(x, 7, c), vectors[x / 16].color[size_t(c)], 1e-4) << x << " " << c;
    // The square is in front of the focus: its radii are negative.
    frame.motion = host().frame.motion;
    frame.focus_distance = 4;
    frame.debug_view = "1.depth_of_field.coc";
    const ImageF radii = filtered(paper_chain("motion_blur,depth_of_field"), frame);
    const float* near = radii.pixel(kWidth / 2, kHeight / 2);
    EXPECT_GT(near[2], 0.1);
    EXPECT_NEAR(near[0], 0.2f * near[2], 1e-4);
    EXPECT_NEAR(near[1], 0.5f * near[2], 1e-4);
    const float* far = radii.pixel(2, 2);
    EXPECT_GT(far[0], 0.1);
    EXPECT_NEAR(far[1], 0.6f * far[0], 1e-4);
    EXPECT_NEAR(far[2], 0.2f * far[0], 1e-4);
}

TEST_F(Pixels, OutputsOfEveryKind) {
    const struct {
        unsigned format;
        double tolerance;
    } cases[] = {{GL_RGBA32F, 0}, {GL_RGBA16F, 6e-4}, {GL_RGBA16, 1e-5}, {GL_RGBA8, 2.5e-3}};
    for (const auto& [format, tolerance] : cases) {
        const HostTexture output(format, kWidth, kHeight);
        pc_frame frame = host().frame;
        frame.output = output;
        const pc_texture result = prepare_and_run(guest(), made(), frame);
        EXPECT_EQ(result.name, output.texture().name);
        expect_near(read(output, kWidth, kHeight), expected(), tolerance);
    }
    // Into the color itself, which the only pass reads around each pixel.
    const HostTexture color(GL_RGBA32F, plane(Role::color));
    pc_frame frame = host().frame;
    frame.color = frame.output = color;
    prepare_and_run(guest(), chain("fxaa"), frame);
    expect_equal(read(color, kWidth, kHeight), by_executor(host().test, "fxaa"));
}

// A closed shutter, or a cut. 0 is closed only if the frame says that it counts. The default is
// half open.
TEST_F(Pixels, AChainThatDoesNothingHandsColorThrough) {
    const auto made = chain("motion_blur");
    const std::pair<float, uint32_t> closed[] = {
        {-1.0f, 0}, {0.0f, PC_CAMERA_CUT}, {0.0f, PC_GIVEN_SHUTTER}};
    for (const auto& [shutter, flag] : closed) {
        pc_frame frame = host().frame;
        frame.shutter_frames = shutter;
        frame.flags |= flag;
        EXPECT_EQ(prepare_and_run(guest(), made, frame).name, frame.color.name) << flag;
        const HostTexture output(GL_RGBA32F, kWidth, kHeight);
        frame.output = output;
        expect_equal(filtered(made, frame), plane(Role::color));
    }
    pc_frame frame = host().frame;
    frame.shutter_frames = 0;  // the default
    const ImageF half_open = filtered(made, frame);
    for (const uint32_t flag : {0u, uint32_t(PC_GIVEN_SHUTTER)}) {
        frame.shutter_frames = 0.5f;
        frame.flags |= flag;
        expect_equal(filtered(made, frame), half_open);
    }
}

// Every encoding of depth, from its own formula. Those that have the sky's depth with a sky.
TEST_F(Pixels, DepthEncodings) {
    const double n = 0.1, f = 400;
    TestFrame below_sky = host().test;
    std::fill_n(below_sky.planes.at(Role::inverse_depth).data.begin(), 6 * kWidth, 0.0f);
    const ImageF with_sky = by_executor(below_sky, kPasses);
    for (const pc_depth encoding : {PC_DEPTH_LINEAR, PC_DEPTH_FORWARD, PC_DEPTH_FORWARD_INFINITE,
                                    PC_DEPTH_REVERSE, PC_DEPTH_REVERSE_INFINITE}) {
        const bool sky =
            encoding != PC_DEPTH_FORWARD && encoding != PC_DEPTH_REVERSE;  // without a far end
        ImageF stored = (sky ? below_sky.planes : host().test.planes).at(Role::inverse_depth);
        for (float& value : stored.data) {
            const double w = double(value);
            const double a = f / (f - n), b = -a * n;  // z = a + b w
            double z = 0;
            if (encoding == PC_DEPTH_LINEAR) z = w > 0 ? 1 / w : 0;
            if (encoding == PC_DEPTH_FORWARD) z = a + b * w;
            if (encoding == PC_DEPTH_REVERSE) z = 1 - (a + b * w);
            if (encoding == PC_DEPTH_FORWARD_INFINITE) z = 1 - n * w;
            if (encoding == PC_DEPTH_REVERSE_INFINITE) z = n * w;
            value = float(z);
        }
        const bool window = encoding != PC_DEPTH_LINEAR;
        const HostTexture depth(window ? GL_DEPTH_COMPONENT32F : GL_R32F, stored);
        pc_frame frame = host().frame;
        frame.depth = depth;
        frame.depth_encoding = encoding;
        frame.near_clip = float(n);
        frame.far_clip = float(f);
        const ImageF found = filtered(made(), frame);
        // Depth is coarse near 1, which changes a decision in a few pixels.
        const Difference difference = compare(found, sky ? with_sky : expected(), 2e-3);
        EXPECT_LT(difference.fraction, 2e-3) << "encoding " << encoding << ": " << difference.text;
    }
}

// A depth buffer with stencil, and from glTexImage2D(), gives the bits of one without.
TEST_F(Pixels, DepthBesideStencil) {
    ImageF stored = plane(Role::inverse_depth);
    for (float& value : stored.data) value *= 0.1f;
    pc_frame frame = host().frame;
    frame.depth_encoding = PC_DEPTH_REVERSE_INFINITE;
    frame.near_clip = 0.1f;
    const auto with_depth = [&](const pc_texture& depth) {
        frame.depth = depth;
        return filtered(made(), frame);
    };
    const HostTexture alone24(GL_DEPTH_COMPONENT24, stored), alone32(GL_DEPTH_COMPONENT32F, stored);
    const ImageF expected24 = with_depth(alone24), expected32 = with_depth(alone32);

    constexpr uint32_t kStencil = 200;
    std::vector<uint32_t> both24(stored.pixels()), both32;
    glGetTextureImage(alone24.texture().name, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT,
                      GLsizei(4 * both24.size()), both24.data());
    for (uint32_t& value : both24) value = (value & ~uint32_t(255)) | kStencil;
    for (const float value : stored.data) {
        both32.push_back(std::bit_cast<uint32_t>(value));
        both32.push_back(kStencil);
    }
    const auto with = [&](GLenum format, GLenum type, const std::vector<uint32_t>& texels) {
        pc_texture texture = alone24;
        texture.internal_format = format;
        glGenTextures(1, &texture.name);
        glBindTexture(GL_TEXTURE_2D, texture.name);
        glTexImage2D(GL_TEXTURE_2D, 0, GLint(format), kWidth, kHeight, 0, GL_DEPTH_STENCIL, type,
                     texels.data());
        const ImageF result = with_depth(texture);
        glDeleteTextures(1, &texture.name);
        return result;
    };
    EXPECT_TRUE(equal_bits(with(GL_DEPTH24_STENCIL8, GL_UNSIGNED_INT_24_8, both24), expected24));
    EXPECT_TRUE(equal_bits(with(GL_DEPTH32F_STENCIL8, GL_FLOAT_32_UNSIGNED_INT_24_8_REV, both32),
                           expected32));
}

TEST_F(Pixels, MotionConventions) {
    const ImageF& motion = plane(Role::motion);
    const auto with = [&](const auto& store, pc_frame frame) {
        ImageF stored = motion;
        for (size_t i = 0; i < motion.pixels(); ++i)
            for (int c = 0; c < 2; ++c)
                stored.data[2 * i + size_t(c)] = store(motion.data[2 * i + size_t(c)], c);
        const HostTexture texture(GL_RG32F, stored);
        frame.motion = texture;
        return filtered(made(), frame);
    };
    // Normalized device coordinates, y up, with a bias; a power of 2 does not round.
    pc_frame frame = host().frame;
    frame.motion_scale[0] = 64;
    frame.motion_scale[1] = -32;
    frame.motion_bias[0] = 0.5f;
    frame.motion_bias[1] = -0.25f;
    expect_near(with([](float v, int c) { return c ? -v / 32 - 0.25f : v / 64 + 0.5f; }, frame),
                expected(), 1e-4);
    // Jitter in the vectors.
    frame = host().frame;
    frame.flags = PC_TOP_LEFT | PC_MOTION_JITTERED;  // this minus previous
    frame.jitter_px[0] = 0.25f;
    frame.jitter_px[1] = -0.5f;
    frame.other_jitter_px[0] = -0.25f;
    const auto add = [](float v, int c) { return v + (c ? -0.5f : 0.5f); };
    expect_near(with(add, frame), expected(), 1e-4);
    frame.flags &= ~uint32_t(PC_MOTION_JITTERED);
    EXPECT_GT(changed(with(add, frame), expected()), 0.02) << "jitter that is not taken out shows";
    // Rows from the bottom: vectors and jitter point up.
    const HostTexture color(GL_RGBA32F, plane(Role::color), true),
        depth(GL_R32F, plane(Role::inverse_depth), true);
    ImageF up = with_y_up(motion);
    for (size_t i = 0; i < up.data.size(); ++i) up.data[i] = add(up.data[i], int(i % 2));
    const HostTexture jittered(GL_RG32F, up, true);
    frame.flags = PC_MOTION_JITTERED;
    frame.color = color;
    frame.depth = depth;
    frame.motion = jittered;
    expect_near(upside_down(filtered(made(), frame)), expected(), 1e-4);
}

// Passes see color times exposure / pre-exposure, and the result is as bright as color: FXAA finds
// the edges of a dark image that its exposure makes bright.
TEST_F(Pixels, ExposureDecidesWhatFxaaSees) {
    auto host = canonical_frame(kWidth, kHeight);
    const ImageF expected = by_executor(host.test, "fxaa");
    ASSERT_GT(changed(expected, host.test.planes.at(Role::color)), 0.02);
    ImageF dark = host.test.planes.at(Role::color);
    for (size_t i = 0; i < dark.data.size(); ++i)
        if (i % 4 != 3) dark.data[i] /= 4096;
    const HostTexture color(GL_RGBA32F, dark),
        exposure = HostTexture::inside(GL_R32F, ImageF(1, 1, 1, 2048), 3, 4, 1, 2);
    pc_frame frame = host.frame;
    frame.color = color;
    frame.exposure = exposure;
    frame.pre_exposure = 0.5f;
    ImageF found = filtered(chain("fxaa"), frame);
    for (size_t i = 0; i < found.data.size(); ++i)
        if (i % 4 != 3) found.data[i] *= 4096;
    expect_equal(found, expected);
    // Values that are no exposure count as 1.
    frame.pre_exposure = 1 / 1024.0f;
    frame.exposure = {};
    const ImageF without = filtered(chain("fxaa"), frame);
    EXPECT_FALSE(equal_bits(without, dark));
    for (const float none : {0.0f, -2.0f, NAN, INFINITY}) {
        const HostTexture invalid(GL_R32F, ImageF(1, 1, 1, none));
        frame.exposure = invalid;
        expect_equal(filtered(chain("fxaa"), frame), without);
    }
}

TEST_F(Pixels, ValuesThatAreNotFiniteAreReplaced) {
    ImageF color = plane(Role::color), depth = plane(Role::inverse_depth),
           motion = plane(Role::motion);
    const float nan = std::nanf(""), inf = INFINITY;
    TestFrame clean = host().test;
    color.at(30, 20, 1) = nan;
    color.at(31, 20, 0) = inf;
    depth.at(10, 10) = -inf;
    motion.at(50, 30, 0) = nan;
    clean.planes[Role::color].at(30, 20, 1) = 0;
    clean.planes[Role::color].at(31, 20, 0) = 65504;
    clean.planes[Role::inverse_depth].at(10, 10) = 0;
    clean.planes[Role::motion].at(50, 30, 0) = clean.planes[Role::motion].at(50, 30, 1) = 0;
    const auto turned = [](const ImageF& plane) { return HostTexture(GL_RGBA32F, plane, true); };
    const ImageF up = with_y_up(motion);
    const HostTexture c = turned(color), d(GL_R32F, depth, true), m(GL_RG32F, up, true);
    pc_frame frame = host().frame;
    frame.flags = PC_MOTION_TO_NEXT;
    frame.color = c;
    frame.depth = d;
    frame.motion = m;
    expect_equal(upside_down(filtered(made(), frame)), by_executor(clean, kPasses));
}

// A camera turns by 3 degrees about y and rolls by 1. The sky moves as in a pinhole camera.
TEST_F(Pixels, SkyWithoutVectorsMovesWithTheCamera) {
    auto host = canonical_frame(kWidth, kHeight);
    ImageF& depth = host.test.planes.at(Role::inverse_depth);
    ImageF& motion = host.test.planes.at(Role::motion);
    const double focal = 80, turn = 3 * std::numbers::pi / 180,
                 roll = std::numbers::pi / 180;  // pixels, radians
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            if (y >= 24) continue;
            depth.at(x, y) = 0;
            // The pixel's direction, rotated back by the camera's motion and projected again.
            const double dx = x + 0.5 - kWidth / 2.0, dy = -(y + 0.5 - kHeight / 2.0);
            const double ax = dx * std::cos(roll) + dy * std::sin(roll);
            const double ay = -dx * std::sin(roll) + dy * std::cos(roll);
            const double bx = ax * std::cos(turn) - focal * std::sin(turn);
            const double bz = ax * std::sin(turn) + focal * std::cos(turn);
            motion.at(x, y, 0) = float(focal * bx / bz - dx);
            motion.at(x, y, 1) = float(-(focal * ay / bz - dy));
        }
    const ImageF expected = by_executor(host.test, kPasses);
    ImageF stored = motion;
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < kWidth; ++x) stored.at(x, y, 0) = stored.at(x, y, 1) = 0;
    const HostTexture d(GL_R32F, depth), m(GL_RG32F, stored);
    pc_frame frame = host.frame;
    frame.depth = d;
    frame.motion = m;
    // Columns of projection times view; the camera looks along -z.
    const double px = 2 * focal / kWidth, py = 2 * focal / kHeight;
    const auto put = [&](float(&to)[16], const double(&rows)[3][3]) {
        for (int column = 0; column < 3; ++column) {
            to[4 * column + 0] = float(px * rows[0][column]);
            to[4 * column + 1] = float(py * rows[1][column]);
            to[4 * column + 2] = 0;
            to[4 * column + 3] = float(-rows[2][column]);
        }
        to[14] = 0.1f;
    };
    const double here[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double c = std::cos(turn), s = std::sin(turn), cr = std::cos(roll), sr = std::sin(roll);
    // Roll, then turn, as above with z = -focal.
    const double there[3][3] = {{c * cr, c * sr, s}, {-sr, cr, 0}, {-s * cr, -s * sr, c}};
    put(frame.view_projection, here);
    put(frame.other_view_projection, there);
    const ImageF found = filtered(made(), frame);
    const Difference difference = compare(found, expected, 2e-3);
    EXPECT_LT(difference.fraction, 2e-3) << difference.text;
    // Rows from the bottom; a jitter is in vectors alone.
    ImageF up = with_y_up(stored);
    for (int y = 24; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            up.at(x, y, 0) -= 0.5f;
            up.at(x, y, 1) += 0.25f;
        }
    const HostTexture color_up(GL_RGBA32F, host.test.planes.at(Role::color), true),
        depth_up(GL_R32F, depth, true), motion_up(GL_RG32F, up, true);
    pc_frame turned = frame;
    turned.flags = PC_MOTION_TO_NEXT | PC_MOTION_JITTERED;
    turned.jitter_px[0] = 0.5f;
    turned.other_jitter_px[1] = 0.25f;
    turned.color = color_up;
    turned.depth = depth_up;
    turned.motion = motion_up;
    expect_near(upside_down(filtered(made(), turned)), expected, 2e-3, 2e-3);
    // The other frame is the one before, and its motion continues.
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int axis = 0; axis < 2; ++axis) motion.at(x, y, axis) *= -1;
    frame.flags = PC_TOP_LEFT;
    expect_near(filtered(made(), frame), by_executor(host.test, kPasses), 2e-3, 2e-3);
    // Without matrices the sky stands still.
    frame.flags |= PC_MOTION_TO_NEXT;
    for (float& value : frame.other_view_projection) value = 0;
    EXPECT_GT(changed(filtered(made(), frame), expected), 0.1);
}

// A plan is kept for frames like its own. Any value that differs has an effect at once.
TEST_F(Pixels, NothingOfAFrameBeforeStays) {
    constexpr int kAcross = 48, kDown = 30;
    const auto host = canonical_frame(kAcross, kDown);
    const HostTexture half(GL_RGBA16F, host.test.planes.at(Role::color)),
        exposure(GL_R32F, ImageF(1, 1, 1, 8)), mask(GL_R32F, ImageF(kAcross, kDown, 1, 0.25f)),
        bytes(GL_RGBA8, kAcross, kDown), large(GL_RGBA32F, 2 * kAcross, 2 * kDown);
    const auto earlier = neighbor_of(host, Neighbor::before),
               later = neighbor_of(host, Neighbor::after);
    const HostTexture up(GL_RGBA32F, host.test.planes.at(Role::color), true);
    using Change = std::function<void(pc_frame&)>;
    const std::vector<Change> changes = {
        [](pc_frame& f) { f.focus_distance *= 1.5f; },
        [](pc_frame& f) { f.f_stop *= 0.5f; },
        [](pc_frame& f) { f.focal_length_mm *= 1.2f; },
        [](pc_frame& f) { f.sensor_width_mm *= 0.8f; },
        [](pc_frame& f) { f.meters_per_unit = 0.5f; },
        [](pc_frame& f) { f.shutter_frames = 0.9f; },
        [](pc_frame& f) { f.flags |= PC_CAMERA_CUT; },
        [](pc_frame& f) { f.flags |= PC_HALF_PLANES; },
        [](pc_frame& f) { f.flags &= ~uint32_t(PC_TOP_LEFT); },
        [](pc_frame& f) { f.flags |= PC_NO_ELISION; },
        [](pc_frame& f) { f.flags |= PC_FAST_MATH; },
        [](pc_frame& f) { f.max_speed_px = 0.1f; },
        [](pc_frame& f) { f.nearest = 0.01f; },
        [](pc_frame& f) { f.depth_encoding = PC_DEPTH_LINEAR; },
        [](pc_frame& f) { f.motion_scale[0] = 2; },
        [](pc_frame& f) { f.motion_bias[1] = 3; },
        [](pc_frame& f) { f.pre_exposure = 0.01f; },
        [](pc_frame& f) { f.motion.name = 0, f.flags |= PC_CAMERA_CUT; },
        [&](pc_frame& f) { f.exposure = exposure; },
        [&](pc_frame& f) { f.color = half; },
        [&](pc_frame& f) { f.color = up; },
        [&](pc_frame& f) { f.mask = mask; },
        [&](pc_frame& f) { f.before = &earlier.frame; },
        [&](pc_frame& f) { f.after = &later.frame; },
        [](pc_frame& f) { f.debug_view = "input.motion"; },
        [&](pc_frame& f) { f.output = bytes; },
        [&](pc_frame& f) { f.width = kAcross, f.height = kDown, f.output = large; },
        [&](pc_frame& f) {
            f.width = kAcross, f.height = kDown, f.output = large;
            f.output.x = kAcross, f.output.y = 1;
        },
        [](pc_frame& f) { f.width = f.color.width - 7; },
        [](pc_frame& f) { f.height = f.color.height - 7, f.color.y = 3; }};
    const auto made = chain("motion_blur,depth_of_field,fxaa");
    const auto guest = instance();
    const ImageF plain = read(prepare_and_run(guest, made, host.frame), kAcross, kDown);
    for (size_t i = 0; i < changes.size(); ++i) {
        SCOPED_TRACE(concat("change ", i));
        pc_frame frame = host.frame;
        changes[i](frame);
        const int width = frame.width ? frame.width : kAcross;
        const int height = frame.height ? frame.height : kDown;
        const auto fresh = instance();
        pc_texture result = {}, expected = {};
        const pc_result code = pc_prepare(guest.get(), made.get(), &frame, 1);
        ASSERT_EQ(pc_prepare(fresh.get(), made.get(), &frame, 1), code);
        const pc_result ran = pc_run(guest.get(), made.get(), &frame, &result);
        const ImageF found = read(result, width, height);  // the output, before it is written again
        ASSERT_EQ(pc_run(fresh.get(), made.get(), &frame, &expected), ran);
        expect_equal(found, read(expected, width, height));
        EXPECT_EQ(pc::explain(guest.get()), pc::explain(fresh.get()));
        expect_equal(read(run(guest, made, host.frame), kAcross, kDown), plain);
    }
}

TEST_F(Pixels, TheFrameNumberTurnsAnimatedNoiseAlone) {
    auto made = chain("motion_blur");
    const auto at = [&](uint64_t number) {
        pc_frame frame = host().frame;
        frame.frame_number = number;
        return filtered(made, frame);
    };
    expect_equal(at(3), at(4));
    set(made, 0, "animate_noise", 1);
    const ImageF three = at(3);
    EXPECT_GT(changed(three, at(4)), 0.01);
    EXPECT_GT(changed(three, at(3 + (1 << 16))), 0.01);
    expect_equal(at(3), three);
}

}  // namespace
}  // namespace postchain::test::pixels_test

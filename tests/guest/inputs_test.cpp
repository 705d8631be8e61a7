// Textures as engines have them: layers and levels, planes of lower resolution, depth ranges, a
// mask, outputs that hold less than color.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "tests/guest/host.h"
#include "tests/support/gpu.h"

namespace postchain::test::inputs_test {
namespace {

class Inputs : public SharedScene {};

GLenum external(int channels) {
    return channels == 1 ? GL_RED : channels == 2 ? GL_RG : GL_RGBA;
}

// An array of three layers and two levels, 5 everywhere but in layer 2 of level 1.
class ArrayTexture {
  public:
    static constexpr pc_slice kSlice = {GL_TEXTURE_2D_ARRAY, 2, 1};

    ArrayTexture(unsigned format, const ImageF& pixels) : channels_(pixels.channels) {
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture_.name);
        glTextureStorage3D(texture_.name, 2, format, 2 * pixels.width, 2 * pixels.height, 3);
        const float five[] = {5, 5, 5, 5};
        for (int level = 0; level < 2; ++level)
            glClearTexImage(texture_.name, level, GL_RGBA, GL_FLOAT, five);
        glTextureSubImage3D(texture_.name, 1, 0, 0, 2, pixels.width, pixels.height, 1,
                            external(channels_), GL_FLOAT, pixels.data.data());
        texture_.internal_format = format;
        texture_.width = pixels.width;
        texture_.height = pixels.height;
    }
    ~ArrayTexture() { glDeleteTextures(1, &texture_.name); }
    ArrayTexture(const ArrayTexture&) = delete;
    operator pc_texture() const { return texture_; }

    ImageF layer(int level, int index) const {
        const int times = level == 0 ? 2 : 1;
        ImageF pixels(texture_.width * times, texture_.height * times, channels_);
        glGetTextureSubImage(texture_.name, level, 0, 0, index, pixels.width, pixels.height, 1,
                             external(channels_), GL_FLOAT,
                             GLsizei(pixels.data.size() * sizeof(float)), pixels.data.data());
        return pixels;
    }

  private:
    int channels_;
    pc_texture texture_ = {};
};

// One eye of two, at a lower level: the bits of textures of their own, and nothing else is written.
TEST_F(Inputs, LayersAndLevels) {
    const ArrayTexture color(GL_RGBA32F, plane(Role::color)),
        depth(GL_R32F, plane(Role::inverse_depth)), motion(GL_RG32F, plane(Role::motion));
    const ArrayTexture output(GL_RGBA32F, ImageF(kWidth, kHeight, 4, 9));
    for (const pc_state state : {PC_STATE_LEAVE, PC_STATE_RESTORE}) {
        const auto guest = instance(PC_VALIDATE, state);
        pc_frame all = host().frame;
        const auto use = [](pc_frame& frame, const ArrayTexture& texture, pc_texture pc_frame::*of,
                            pc_slice pc_frame::*slice) {
            frame.*of = texture;
            frame.*slice = ArrayTexture::kSlice;
        };
        // Each of them alone, beside planes that are read in place, and all.
        const std::tuple<const ArrayTexture&, pc_texture pc_frame::*, pc_slice pc_frame::*>
            inputs[] = {{color, &pc_frame::color, &pc_frame::color_slice},
                        {depth, &pc_frame::depth, &pc_frame::depth_slice},
                        {motion, &pc_frame::motion, &pc_frame::motion_slice}};
        for (const auto& [texture, of, slice] : inputs) {
            pc_frame one = host().frame;
            use(one, texture, of, slice);
            use(all, texture, of, slice);
            expect_equal(read(prepare_and_run(guest, made(), one), kWidth, kHeight), expected());
        }
        expect_equal(read(prepare_and_run(guest, made(), all), kWidth, kHeight), expected());
        use(all, output, &pc_frame::output, &pc_frame::output_slice);
        prepare_and_run(guest, made(), all);
        expect_equal(output.layer(1, 2), expected());
        expect_equal(output.layer(1, 1), ImageF(kWidth, kHeight, 4, 5));
        expect_equal(output.layer(0, 2), ImageF(2 * kWidth, 2 * kHeight, 4, 5));
    }
}

// Focus at a place of a layer's depth, in turn with one of a texture of its own.
TEST_F(Inputs, FocusInALayer) {
    const ImageF near_left = make_image(
        kWidth, kHeight, 1, [](int x, int, int) { return x < kWidth / 2 ? 0.25 : 0.05; });
    const HostTexture plain(GL_R32F, near_left);
    const ArrayTexture layer(GL_R32F, near_left);
    const auto guest = instance(PC_VALIDATE);
    const auto made = focused(0.2, 0.5);
    pc_frame frame = host().frame, in_layer = frame;
    frame.depth = plain;
    frame.f_stop = in_layer.f_stop = 0.1f;
    in_layer.depth = layer;
    in_layer.depth_slice = ArrayTexture::kSlice;
    prepare(guest, made, in_layer);
    const ImageF expected = read(prepare_and_run(guest, made, frame), kWidth, kHeight);
    for (const uint32_t cut : {0u, uint32_t(PC_CAMERA_CUT)})
        for (pc_frame* one : {&in_layer, &frame}) {
            one->flags |= cut;
            glFinish();
            expect_equal(read(run(guest, made, *one), kWidth, kHeight), expected);
        }
}

TEST_F(Inputs, ViewsOfLayers) {
    const ImageF covered = make_image(
        kWidth, kHeight, 1, [](int x, int y, int) { return 0.25 * (x % 3) + 0.125 * (y % 2); });
    const HostTexture mask(GL_R32F, covered);
    const ArrayTexture layers[] = {{GL_RGBA32F, plane(Role::color)},
                                   {GL_R32F, plane(Role::inverse_depth)},
                                   {GL_RG32F, plane(Role::motion)},
                                   {GL_R32F, covered}};
    // And parts of larger textures.
    constexpr int kAcross = kWidth + 20, kDown = kHeight + 20;
    const HostTexture parts[] = {
        HostTexture::inside(GL_RGBA32F, plane(Role::color), kAcross, kDown, 3, 11),
        HostTexture::inside(GL_R32F, plane(Role::inverse_depth), kAcross, kDown, 13, 1),
        HostTexture::inside(GL_RG32F, plane(Role::motion), kAcross, kDown, 5, 17),
        HostTexture::inside(GL_R32F, covered, kAcross, kDown, 2, 19)};
    const std::tuple<const char*, pc_texture pc_frame::*, pc_slice pc_frame::*> views[] = {
        {"host.color", &pc_frame::color, &pc_frame::color_slice},
        {"host.depth", &pc_frame::depth, &pc_frame::depth_slice},
        {"host.motion", &pc_frame::motion, &pc_frame::motion_slice},
        {"host.mask", &pc_frame::mask, &pc_frame::mask_slice}};
    for (size_t i = 0; i < std::size(views); ++i) {
        const auto& [view, of, slice] = views[i];
        pc_frame frame = host().frame;
        frame.mask = mask;
        frame.debug_view = view;
        const ImageF expected = filtered(made(), frame);
        frame.*of = layers[i];
        frame.*slice = ArrayTexture::kSlice;
        expect_equal(filtered(made(), frame), expected);
        frame.*slice = {};
        frame.width = kWidth;
        frame.height = kHeight;
        frame.*of = parts[i];
        expect_equal(filtered(made(), frame), expected);
    }
}

// A plan for neighbors of one form is not that for another one, whichever came before.
TEST_F(Inputs, NeighborsOfEveryFormInTurn) {
    const auto shared = chain("motion_blur");
    const ArrayTexture own_color(GL_RGBA32F, plane(Role::color));
    size_t different = 0;
    for (const Neighbor neighbor : kNeighbors) {
        const HostNeighbor beside = neighbor_of(host(), neighbor);
        const ImageF& picture = beside.planes.at(Role::color);
        const HostTexture half(GL_RGBA16F, picture);
        const ArrayTexture color(GL_RGBA32F, picture),
            depth(GL_R32F, beside.planes.at(Role::inverse_depth)),
            motion(GL_RG32F, beside.planes.at(Role::motion));
        using F = pc_frame&;
        const std::function<void(F, F)> forms[] = {
            [](F, F) {},
            [](F f, F) { f.pre_exposure = 2; },
            [](F f, F) { f.depth_encoding = PC_DEPTH_LINEAR; },
            [](F f, F) { f.motion_scale[0] = -1; },
            [](F f, F) {
                for (int i = 0; i < 4; ++i) f.view_projection[5 * i] = 1;
                std::copy_n(f.view_projection, 16, f.other_view_projection);
                f.view_projection[11] = f.other_view_projection[11] = -1;
            },
            [&](F f, F) { f.color = half; },
            [](F f, F own) { own.pre_exposure = f.pre_exposure = 2; },
            [&](F f, F own) {
                own.pre_exposure = f.pre_exposure = 2;
                own.color = own_color, own.color_slice = ArrayTexture::kSlice;
            },
            [&](F f, F own) {
                own.pre_exposure = f.pre_exposure = 2;
                f.color = color, f.color_slice = ArrayTexture::kSlice;
            },
            [&](F f, F) { f.depth = depth, f.depth_slice = ArrayTexture::kSlice; },
            [&](F f, F) { f.motion = motion, f.motion_slice = ArrayTexture::kSlice; },
            [](F f, F) { f.motion_size[0] = kWidth / 2, f.motion_size[1] = kHeight / 2; }};
        std::vector<ImageF> all = {{}};
        for (const auto& change : forms) {
            pc_frame other = beside.frame, frame = host().frame;
            change(other, frame);
            (neighbor == Neighbor::before ? frame.before : frame.after) = &other;
            const ImageF expected = filtered(chain("motion_blur"), frame);
            expect_equal(filtered(shared, frame), expected);
            different += !equal_bits(expected, all.back());
            all.push_back(expected);
        }
        // Layers of an array have the values of the textures.
        for (const auto& [array, texture] : {std::pair(8, 7), {9, 7}, {10, 1}, {11, 1}})
            expect_equal(all.at(size_t(array)), all.at(size_t(texture)));
    }
    EXPECT_GE(different, 10u);
}

// The color's own layer as output, and another layer of it.
TEST_F(Inputs, OneTextureInAndOut) {
    for (const int layer : {2, 0}) {
        const ArrayTexture both(GL_RGBA32F, plane(Role::color));
        pc_frame frame = host().frame;
        frame.color = frame.output = both;
        frame.color_slice = frame.output_slice = ArrayTexture::kSlice;
        frame.output_slice.layer = layer;
        prepare_and_run(guest(), made(), frame);
        expect_equal(both.layer(1, layer), expected());
        if (layer == 2) continue;
        expect_equal(both.layer(1, 2), plane(Role::color));
        // Where the chain has nothing to do, the other layer gets the color.
        frame.flags |= PC_CAMERA_CUT;
        prepare_and_run(guest(), chain("motion_blur"), frame);
        expect_equal(both.layer(1, layer), plane(Role::color));
    }
    // The first layer and level after others, by the same plan.
    const ArrayTexture output(GL_RGBA32F, ImageF(kWidth, kHeight, 4, 9));
    pc_frame frame = host().frame;
    frame.output = output;
    frame.output_slice = ArrayTexture::kSlice;
    prepare_and_run(guest(), made(), frame);
    frame.output.width *= 2;
    frame.output.height *= 2;
    frame.output_slice = {GL_TEXTURE_2D_ARRAY, 0, 0};
    prepare_and_run(guest(), made(), frame);
    const ImageF all = output.layer(0, 0);
    expect_equal(
        make_image(kWidth, kHeight, 4, [&](int x, int y, int c) { return all.at(x, y, c); }),
        expected());
}

// Another rectangle of color's texture, which overlaps it: also where the chain has nothing to do.
TEST_F(Inputs, OutputThatOverlapsColor) {
    auto host = canonical_frame(kWidth, kHeight);
    const ImageF& picture = host.test.planes.at(Role::color);
    const auto made = chain("motion_blur");
    for (const auto& [cut, x, y] : {std::tuple(0u, 9, 11),
                                    {uint32_t(PC_CAMERA_CUT), 9, 11},
                                    {uint32_t(PC_CAMERA_CUT), 4, 11},
                                    {uint32_t(PC_CAMERA_CUT), 9, 5}}) {
        pc_frame frame = host.frame;
        frame.flags |= cut;
        const ImageF expected = cut ? picture : by_executor(host.test, "motion_blur");
        const auto both = HostTexture::inside(GL_RGBA32F, picture, kWidth + 20, kHeight + 20, 4, 5);
        frame.color = frame.output = both;
        frame.width = kWidth;
        frame.height = kHeight;
        pc_frame closed = frame;
        closed.flags |= PC_GIVEN_SHUTTER;
        prepare_and_run(guest(), made, closed);  // stays where it is
        frame.output.x = x;
        frame.output.y = y;
        const pc_texture result = prepare_and_run(guest(), made, frame);
        expect_equal(read(result, kWidth, kHeight), expected);
        frame.debug_view = "host.color";
        expect_error(pc_run(guest().get(), made.get(), &frame, nullptr), PC_ERROR_ARGUMENT,
                     "debug_view: host.color cannot be drawn into another");
    }
}

TEST_F(Inputs, SlicesThatAreNotThere) {
    const ArrayTexture color(GL_RGBA32F, plane(Role::color));
    const auto made = chain("fxaa");
    const auto refuses = [&](const pc_texture& texture, pc_slice slice, const char* text) {
        pc_frame frame = host().frame;
        frame.color = texture;
        frame.color_slice = slice;
        prepare_and_run(guest(), made, host().frame);
        pc_prepare(guest().get(), made.get(), &frame, 1);
        expect_error(pc_run(guest().get(), made.get(), &frame, nullptr), PC_ERROR_INPUT, text);
        EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)) << text;
    };
    constexpr GLenum kArray = GL_TEXTURE_2D_ARRAY;
    refuses(color, {GL_TEXTURE_3D, 0, 0}, "color_slice.target: 0x806f is not GL_TEXTURE_2D_ARRAY");
    refuses(color, {GL_TEXTURE_2D, 1, 0}, "color_slice.layer: 1; set target to");
    refuses(color, {kArray, -1, 0}, "color_slice.layer: -1 is below 0");
    refuses(color, {kArray, 0, 31}, "color_slice.level: 31 is not within 0 and 30");
    refuses(color, {kArray, 3, 1}, "has 3 layers, and color_slice.layer is 3");
    refuses(color, {kArray, 0, 2}, "has no level 2; set color_slice.level to one");
    refuses(color, {kArray, 0, 30}, "has no level 30;");  // beyond those of any texture
    // A level that GL does not reach reads as black.
    glTextureParameteri(static_cast<pc_texture>(color).name, GL_TEXTURE_MAX_LEVEL, 0);
    refuses(color, {kArray, 0, 1}, "has GL_TEXTURE_MAX_LEVEL 0, below color_slice.level 1;");
    refuses(color, {}, "is a GL_TEXTURE_2D_ARRAY; set color_slice.target to it");
    refuses(host().color, {kArray, 0, 0}, "is a GL_TEXTURE_2D; set color_slice.target to it");
}

// Depth and motion of fewer texels, each for 3 x 2 or 1.5 x 1.5 pixels, are the planes in which a
// pixel has the texel at its center.
TEST_F(Inputs, PlanesOfLowerResolution) {
    for (const auto& [across, down] : {std::pair(kWidth / 3, kHeight / 2), {64, 40}}) {
        auto host = canonical_frame(kWidth, kHeight);
        const auto lowered = [&, width = across, height = down](Role role) {
            ImageF& plane = host.test.planes[role];
            const ImageF small =
                make_image(width, height, plane.channels, [&](int x, int y, int c) {
                    return plane.at(x * kWidth / width, y * kHeight / height, c);
                });
            plane = make_image(kWidth, kHeight, plane.channels, [&](int x, int y, int c) {
                return small.at((2 * x + 1) * width / (2 * kWidth),
                                (2 * y + 1) * height / (2 * kHeight), c);
            });
            return small;
        };
        const ImageF depths = lowered(Role::inverse_depth), vectors = lowered(Role::motion);
        const HostTexture depth(GL_R32F, depths), motion(GL_RG32F, vectors);
        const ImageF expected = by_executor(host.test, kPasses);
        pc_frame frame = host.frame;
        frame.depth = depth;
        frame.motion = motion;
        frame.depth_size[0] = frame.motion_size[0] = across;
        frame.depth_size[1] = frame.motion_size[1] = down;
        expect_equal(filtered(made(), frame), expected);
        // Rows from the bottom.
        const HostTexture color_up(GL_RGBA32F, host.test.planes.at(Role::color), true),
            depth_up(GL_R32F, depths, true), motion_up(GL_RG32F, with_y_up(vectors), true);
        frame.flags &= ~uint32_t(PC_TOP_LEFT);
        frame.color = color_up;
        frame.depth = depth_up;
        frame.motion = motion_up;
        expect_equal(upside_down(filtered(made(), frame)), expected);
    }
}

// Vectors of half the resolution, one of each 2 x 2 pixels, beside depth of the full resolution.
// The edges of the surfaces are within texels, but every pixel gets the vector of its surface.
TEST_F(Inputs, MotionOfLowerResolutionFollowsTheDepth) {
    auto host = canonical_frame(kWidth, kHeight);
    ImageF& inverse_depth = host.test.planes[Role::inverse_depth];
    ImageF& vectors = host.test.planes[Role::motion];
    const auto surface = [](int x, int y) {
        return x > 20 && x < 61 && y > 12 && y < 43 ? 1 : x > 40 && y < 33 ? 2 : 0;
    };
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const int which = surface(x, y);
            inverse_depth.at(x, y) = which == 1 ? 0.5f : which == 2 ? 0.25f : 0.1f;
            vectors.at(x, y, 0) = which == 1 ? 9.0f : which == 2 ? -5.0f : 0.0f;
            vectors.at(x, y, 1) = which == 2 ? 4.0f : 0.0f;
        }
    const HostTexture depth(GL_R32F, inverse_depth);
    const ImageF expected = by_executor(host.test, kPasses);
    for (const int first : {0, 1}) {  // the pixel of the four that the texel has its vector from
        ImageF small(kWidth / 2, kHeight / 2, 2);
        for (int y = 0; y < small.height; ++y)
            for (int x = 0; x < small.width; ++x)
                for (int c = 0; c < 2; ++c)
                    small.at(x, y, c) = vectors.at(2 * x + first, 2 * y + first, c);
        const HostTexture motion(GL_RG32F, small);
        pc_frame frame = host.frame;
        frame.depth = depth;
        frame.motion = motion;
        frame.motion_size[0] = kWidth / 2;
        frame.motion_size[1] = kHeight / 2;
        expect_equal(filtered(made(), frame), expected);
    }
}

// Depths 0 to 1 in another range; what is stored beyond an end counts as the end.
TEST_F(Inputs, DepthRange) {
    const float near = 0.1f;
    pc_frame frame = host().frame;
    frame.depth_encoding = PC_DEPTH_REVERSE_INFINITE;
    frame.near_clip = near;
    const auto with = [&](const auto& store, float first, float last) {
        ImageF stored = plane(Role::inverse_depth);
        for (size_t i = 0; i < stored.data.size(); ++i)
            stored.data[i] = store(near * stored.data[i], i);
        const HostTexture depth(GL_R32F, stored);
        frame.depth = depth;
        frame.depth_range[0] = first;
        frame.depth_range[1] = last;
        return filtered(made(), frame);
    };
    const ImageF expected = with([](float z, size_t) { return z; }, 0, 0);
    expect_near(with([](float z, size_t) { return 0.25f + z / 2; }, 0.25f, 0.75f), expected, 1e-3,
                2e-3);
    expect_near(with([](float z, size_t) { return 0.75f - z / 2; }, 0.75f, 0.25f), expected, 1e-3,
                2e-3);
    const auto some = [](float even, float odd) {
        return [=](float z, size_t i) { return i % 7 ? z : i % 2 ? odd : even; };
    };
    expect_equal(with(some(-0.5f, 1.5f), 0, 1), with(some(0, 1), 0, 1));
}

// Color beyond the range of the output is the end of that range, not an infinity.
TEST_F(Inputs, OutputsThatHoldLess) {
    auto host = canonical_frame(kWidth, kHeight);
    ImageF bright = host.test.planes.at(Role::color);
    for (size_t i = 0; i < bright.data.size(); ++i)
        bright.data[i] *= i / 4 % kWidth < kWidth / 2 ? 1e6f : -1e6f;
    const HostTexture color(GL_RGBA32F, bright);
    for (const char* passes : {"motion_blur,fxaa", "fxaa"})
        for (const unsigned format : {GL_RGBA16F, GL_R11F_G11F_B10F}) {
            const HostTexture output(format, kWidth, kHeight);
            pc_frame frame = host.frame;
            frame.color = color;
            frame.output = output;
            const ImageF result = filtered(chain(passes), frame);
            const auto [least, most] = std::minmax_element(result.data.begin(), result.data.end());
            EXPECT_EQ(*most, format == GL_RGBA16F ? 65504 : 64512) << passes;
            EXPECT_EQ(*least, format == GL_RGBA16F ? -65504 : 0) << passes;
        }
}

// At half resolution what is not blurred is kept up to rounding, and what is blurred is nearer to
// the result at full resolution than the frame. Its texture changes from pixel to pixel, across the
// motion too, which half the resolution loses.
TEST_F(Inputs, HalfResolution) {
    constexpr int width = kWidth - 1;
    auto host = canonical_frame(width, kHeight);
    const HostTexture output(GL_RGBA32F, width, kHeight);
    pc_frame frame = host.frame;
    frame.output = output;
    frame.flags |= PC_HALF_RESOLUTION;
    const auto run = [&](const char* passes) {
        return read(prepare_and_run(guest(), chain(passes), frame), width, kHeight);
    };
    const ImageF& color = host.test.planes.at(Role::color);
    frame.flags |= PC_GIVEN_SHUTTER;  // closed
    frame.shutter_frames = 0;
    EXPECT_LE(compare(run("motion_blur"), color, 0).max, 1e-6);
    frame.shutter_frames = 0.5f;
    const ImageF half = run("motion_blur"), full = by_executor(host.test, "motion_blur");
    const auto error = [&](const ImageF& image) {
        double sum = 0;
        for (size_t i = 0; i < image.data.size(); ++i)
            sum += std::pow(double(image.data[i]) - double(full.data[i]), 2);
        return std::sqrt(sum / double(image.data.size()));
    };
    EXPECT_LT(error(half), 0.7 * error(color)) << error(half) << " of " << error(color);
    EXPECT_GT(error(half), 0);
    // The ground beside a masked object is filtered, the object is not.
    ImageF mask(width, kHeight, 1, 0);
    for (int y = 20; y < 40; ++y)
        for (int x = 30; x < 60; ++x) mask.at(x, y) = 1;
    const HostTexture object(GL_R8, mask);
    frame.mask = object;
    const ImageF masked = run("motion_blur");
    for (int y = 22; y < 38; ++y)
        for (int x = 32; x < 58; ++x)
            for (int c = 0; c < 4; ++c)
                ASSERT_NEAR(masked.at(x, y, c), color.at(x, y, c), 1e-6) << x << ", " << y;
}

// PC_HALF_RESOLUTION by its definition: the chain filters means of 2 x 2 pixels, with the depth and
// half the motion of the nearest of them. Where a layer of 1 and -1 in turn stays as it was,
// nothing is blurred, and the frame's detail comes back.
ImageF by_halves(const TestFrame& frame, const ImageF* mask) {
    const ImageF& color = frame.planes.at(Role::color);
    const int width = color.width, height = color.height;
    const int across = (width + 1) / 2, down = (height + 1) / 2;
    ImageF mean(across, down, 4), depth(across, down, 1), motion(across, down, 2),
        matte(across, down, 1), start(across, down, 4);
    for (int y = 0; y < down; ++y)
        for (int x = 0; x < across; ++x) {
            start.at(x, y, 0) = (x + y) % 2 ? -1.0f : 1.0f;
            for (int i = 0; i < 4; ++i) {
                const int from_x = std::min(2 * x + i % 2, width - 1);
                const int from_y = std::min(2 * y + i / 2, height - 1);
                for (int c = 0; c < 4; ++c) mean.at(x, y, c) += 0.25f * color.at(from_x, from_y, c);
                if (mask) matte.at(x, y) += 0.25f * mask->at(from_x, from_y);
                const float nearer = frame.planes.at(Role::inverse_depth).at(from_x, from_y);
                if (i > 0 && nearer <= depth.at(x, y)) continue;
                depth.at(x, y) = nearer;
                for (int c = 0; c < 2; ++c)
                    motion.at(x, y, c) = 0.5f * frame.planes.at(Role::motion).at(from_x, from_y, c);
            }
        }
    TestFrame half = frame;
    half.description.width = half.description.display_width = across;
    half.description.height = half.description.display_height = down;
    half.description.bounds = {};
    half.planes = {{Role::color, mean},
                   {Role::inverse_depth, depth},
                   {Role::motion, motion},
                   {Role::layers, start}};
    half.description.planes.add(Role::layers);
    half.description.layers = 1;
    Chain blur = chain_of("motion_blur");
    if (mask) {
        half.planes[Role::mattes] = matte;
        half.description.planes.add(Role::mattes);
        half.description.mattes = {0};
        blur.links[0].matte = "mask";
    }
    const ImageF filtered = by_executor(half, blur);
    const ImageF layer = by_executor(half, blur, Precision::fp32, Role::layers);
    ImageF result = color;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double sharp = 0, up[4] = {}, up_mean[4] = {};
            for (int i = 0; i < 4; ++i) {
                const int from_x = std::clamp(x / 2 + i % 2 * (x % 2 ? 1 : -1), 0, across - 1);
                const int from_y = std::clamp(y / 2 + i / 2 * (y % 2 ? 1 : -1), 0, down - 1);
                const double weight = (i % 2 ? 0.25 : 0.75) * (i / 2 ? 0.25 : 0.75);
                const float kept = start.at(from_x, from_y) * layer.at(from_x, from_y);
                sharp += weight * std::clamp(double(kept), 0.0, 1.0);
                for (int c = 0; c < 4; ++c) {
                    up[c] += weight * double(filtered.at(from_x, from_y, c));
                    up_mean[c] += weight * double(mean.at(from_x, from_y, c));
                }
            }
            for (int c = 0; c < 4; ++c) {
                const double own = double(color.at(x, y, c));
                const double value = up[c] + sharp * (own - up_mean[c]);
                result.at(x, y, c) = float(std::max(value, std::min({0.0, own, up[c]})));
            }
            result.at(x, y, 3) = std::min(result.at(x, y, 3), 1.0f);
        }
    return result;
}

// Odd sizes. Then rows from the bottom, in rectangles and a layer, with an exposure and a mask.
TEST_F(Inputs, HalfResolutionByItsDefinition) {
    constexpr int width = kWidth - 1, height = kHeight - 1;
    auto host = canonical_frame(width, height);
    const ImageF& color = host.test.planes.at(Role::color);
    const HostTexture output(GL_RGBA32F, width, height);
    pc_frame frame = host.frame;
    frame.output = output;
    frame.flags |= PC_HALF_RESOLUTION;
    host.test.description.camera.shutter_frames = frame.shutter_frames = 2;  // at borders too
    const auto made = chain("motion_blur");
    const ImageF plain = by_halves(host.test, nullptr);
    EXPECT_GT(compare(plain, color, 1e-2).fraction, 0.1);
    expect_near(read(prepare_and_run(guest(), made, frame), width, height), plain, 1e-4);

    ImageF mask(width, height, 1, 0);
    for (int y = 11; y < 40; ++y)
        for (int x = 31; x < 62; ++x) mask.at(x, y) = 1;
    const auto inside = [](unsigned format, const ImageF& pixels, int x, int y) {
        return HostTexture::inside(format, upside_down(pixels), 128, 80, x, y);
    };
    const HostTexture larger_color = inside(GL_RGBA32F, color, 5, 7);
    pc_texture whole = larger_color;
    whole.x = whole.y = 0;
    const ArrayTexture color_up(GL_RGBA32F, read(whole, 128, 80));
    const HostTexture depth_up = inside(GL_R32F, host.test.planes.at(Role::inverse_depth), 3, 11),
                      motion_up =
                          inside(GL_RG32F, with_y_up(host.test.planes.at(Role::motion)), 8, 5),
                      mask_up = inside(GL_R32F, mask, 20, 1), larger(GL_RGBA32F, 128, 80),
                      exposure = HostTexture::inside(GL_R32F, ImageF(1, 1, 1, 8), 3, 3, 1, 2);
    frame.flags = PC_BOTTOM_LEFT | PC_MOTION_TO_NEXT | PC_HALF_RESOLUTION;
    frame.width = width;
    frame.height = height;
    frame.color = color_up;
    frame.color.x = 5;
    frame.color.y = 7;
    frame.color_slice = ArrayTexture::kSlice;
    frame.depth = depth_up;
    frame.motion = motion_up;
    frame.mask = mask_up;
    frame.exposure = exposure;
    frame.pre_exposure = 2;
    frame.output = larger;
    frame.output.x = 13;
    frame.output.y = 2;
    const ImageF masked = by_halves(host.test, &mask);
    EXPECT_GT(compare(masked, plain, 1e-2).fraction, 0.02);
    expect_near(upside_down(read(prepare_and_run(guest(), made, frame), width, height)), masked,
                1e-4);
}

// The camera's motion of a sky without vectors, in pixels of the halved planes: a lens that shifts
// moves all of the sky by 6 px to the right and 3 px down.
TEST_F(Inputs, HalfResolutionMovesTheSky) {
    TestFrame moved = host().test;
    for (int y = 0; y < 18; ++y)
        for (int x = 0; x < kWidth; ++x) {
            moved.planes.at(Role::inverse_depth).at(x, y) = 0;
            moved.planes.at(Role::motion).at(x, y, 0) = 6;
            moved.planes.at(Role::motion).at(x, y, 1) = 3;
        }
    ImageF stored = moved.planes.at(Role::motion);
    std::fill_n(stored.data.begin(), 2 * 18 * kWidth, 0.0f);
    const HostTexture depth(GL_R32F, moved.planes.at(Role::inverse_depth)),
        motion(GL_RG32F, stored), output(GL_RGBA32F, kWidth, kHeight);
    pc_frame frame = host().frame;
    frame.depth = depth;
    frame.motion = motion;
    frame.output = output;
    frame.flags |= PC_HALF_RESOLUTION;
    frame.view_projection[0] = frame.view_projection[5] = 1;
    frame.view_projection[11] = -1;
    frame.view_projection[14] = 0.1f;
    std::copy_n(frame.view_projection, 16, frame.other_view_projection);
    frame.other_view_projection[8] = -6.0f / (kWidth / 2);
    frame.other_view_projection[9] = 3.0f / (kHeight / 2);
    // The last bit of a vector may move a tap.
    expect_near(filtered(chain("motion_blur"), frame), by_halves(moved, nullptr), 1e-4, 2e-3);
}

// Negative color of wide gamuts, and alpha beyond 1, are no overshoot of the detail.
TEST_F(Inputs, HalfResolutionKeepsTheRangeOfTheFrame) {
    const ImageF color = make_image(kWidth, kHeight, 4, [](int x, int, int c) {
        return std::array{-0.25f, 0.5f, 2.0f, x % 2 ? 1.5f : -0.5f}[size_t(c)];
    });
    const HostTexture given(GL_RGBA32F, color), output(GL_RGBA32F, kWidth, kHeight);
    pc_frame frame = host().frame;
    frame.color = given;
    frame.output = output;
    frame.flags |= PC_HALF_RESOLUTION | PC_GIVEN_SHUTTER;
    frame.shutter_frames = 0;
    expect_near(filtered(chain("motion_blur"), frame), color, 1e-6);
}

TEST_F(Inputs, HalfResolutionNeedsAnOutputOfItsOwn) {
    const auto made = chain("fxaa");
    pc_frame frame = host().frame;
    frame.flags |= PC_HALF_RESOLUTION;
    expect_error(pc_prepare(guest().get(), made.get(), &frame, 1), PC_ERROR_INPUT,
                 "output: PC_HALF_RESOLUTION needs one");
    frame.output = frame.color;
    EXPECT_EQ(pc_prepare(guest().get(), made.get(), &frame, 1), PC_ERROR_INPUT);
    const HostTexture output(GL_RGBA32F, kWidth, kHeight);
    frame.output = output;
    frame.debug_view = "input.color";
    expect_error(pc_prepare(guest().get(), made.get(), &frame, 1), PC_ERROR_ARGUMENT,
                 "debug_view: give it without PC_HALF_RESOLUTION");
}

// The mask is a matte of the frame: the bits of the executor with that matte.
TEST_F(Inputs, MaskOfEveryEffect) {
    auto host = canonical_frame(kWidth, kHeight);
    ImageF mask(kWidth, kHeight, 1, 0);
    for (int y = 10; y < 40; ++y)
        for (int x = 30; x < 70; ++x) mask.at(x, y) = x < 32 ? 0.5f : 1;
    const HostTexture texture(GL_R8, mask);
    const ImageF stored = read(texture, kWidth, kHeight, 1);
    const pc_mask_effect effects[] = {PC_MASK_UNBLURRED, PC_MASK_UNMOVED, PC_MASK_IGNORED};
    const char* const passes = "motion_blur,fxaa";
    const ImageF plain = by_executor(host.test, passes);
    TestFrame masked = host.test;
    masked.planes[Role::mattes] = stored;
    masked.description.planes.add(Role::mattes);
    for (const pc_mask_effect first : effects) {
        Chain expected_chain = chain_of("motion_blur");
        append(expected_chain, "fxaa");
        masked.description.mattes.clear();
        for (ChainLink& link : expected_chain.links) {
            const bool ignored = first == PC_MASK_IGNORED && &link == &expected_chain.links[0];
            masked.description.mattes.push_back(ignored ? -1 : 0);
            if (!ignored) link.matte = "mask";
        }
        if (first == PC_MASK_UNMOVED) expected_chain.links[0].matte_effect = MatteEffect::unmoved;
        const ImageF expected = by_executor(masked, expected_chain);
        const auto made = chain(passes);
        if (first != effects[0]) {  // the initial one
            ASSERT_EQ(pc_chain_set_mask(made.get(), 0, first), PC_OK) << pc_error();
        }
        pc_frame frame = host.frame;
        frame.mask = texture;
        expect_equal(filtered(made, frame), expected);
        EXPECT_GT(compare(expected, plain, 1e-3).fraction, 0.02) << first;
        // It may be a part of a larger texture.
        const HostTexture larger = HostTexture::inside(GL_R32F, stored, 120, 80, 13, 7);
        frame.width = kWidth;
        frame.height = kHeight;
        frame.mask = larger;
        expect_equal(filtered(made, frame), expected);
        // Later frames of the kind may lack it, and a host may hand it in as a layer.
        frame.mask = {};
        expect_equal(read(run(guest(), made, frame), kWidth, kHeight), plain);
        const ArrayTexture layer(GL_R32F, stored);
        frame.mask = layer;
        frame.mask_slice = ArrayTexture::kSlice;
        expect_equal(filtered(made, frame), expected);
    }
}

TEST_F(Inputs, MaskEffectsThatAreRefused) {
    const auto made = chain("fxaa");
    expect_error(pc_chain_set_mask(made.get(), 1, PC_MASK_IGNORED), PC_ERROR_ARGUMENT, "1 passes");
    expect_error(pc_chain_set_mask(made.get(), 0, 3), PC_ERROR_ARGUMENT, "effect: 3 is not a");
    expect_error(pc_chain_set_mask(made.get(), 0, PC_MASK_UNMOVED), PC_ERROR_CHAIN, "fxaa");
}

}  // namespace
}  // namespace postchain::test::inputs_test

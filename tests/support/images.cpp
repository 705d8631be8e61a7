#include "tests/support/images.h"

#include <cmath>
#include <cstring>

#include "chain/frame/behind.h"
#include "chain/frame/convert.h"
#include "chain/frame/layers.h"

namespace postchain::test {

ImageF noise_image(int width, int height, int channels, uint32_t seed, float low, float high) {
    ImageF image(width, height, channels);
    uint64_t state = seed * 2654435761u + 1;
    for (float& value : image.data) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        value = low + (high - low) * float(double(state >> 40) / double(1 << 24));
    }
    return image;
}

ImageF textured_image(int width, int height, int channels, uint32_t seed) {
    return make_image(width, height, channels, [&](int x, int y, int c) {
        const double phase = 0.37 * seed + 1.7 * c;
        const double value = 0.5 + 0.16 * std::sin(0.413 * x + 0.217 * y + phase) +
                             0.12 * std::sin(0.131 * x - 0.563 * y + 2 * phase);
        return std::sin(0.77 * x + 0.29 * y + 0.1 * seed) > 0.4 ? 0.35 * value : value;
    });
}

TestFrame layered_frame(int width, int height, std::array<float, 2> square_motion,
                        std::array<float, 2> ground_motion, uint32_t seed) {
    TestFrame frame;
    const auto square = [&](int x, int y) {
        return x >= width / 3 && x < 2 * width / 3 && y >= height / 3 && y < 2 * height / 3;
    };
    ImageF color = textured_image(width, height, 4, seed);
    for (size_t alpha = 3; alpha < color.data.size(); alpha += 4) color.data[alpha] = 1;
    frame.planes[Role::color] = std::move(color);
    frame.planes[Role::inverse_depth] =
        make_image(width, height, 1, [&](int x, int y, int) { return square(x, y) ? 0.5f : 0.1f; });
    frame.planes[Role::motion] = make_image(width, height, 2, [&](int x, int y, int c) {
        return (square(x, y) ? square_motion : ground_motion)[size_t(c)];
    });
    frame.description = describe(frame.planes);
    return frame;
}

void add_neighbors(TestFrame& frame) {
    const int width = frame.description.width, height = frame.description.height;
    for (Neighbor neighbor : kNeighbors) {
        TestFrame other = layered_frame(width, height, {9.0f, 4.0f}, {-7.0f, 2.0f},
                                        neighbor == Neighbor::before ? 101 : 102);
        other.planes[Role::motion_back] = other.planes.at(Role::motion);
        for (auto& [role, plane] : other.planes) {
            frame.description.planes.add(role_of(neighbor, role));
            frame.planes[role_of(neighbor, role)] = std::move(plane);
        }
    }
}

void add_behind(TestFrame& frame) {
    const int width = frame.description.width, height = frame.description.height;
    TestFrame other = layered_frame(width, height, {-13.0f, 6.0f}, {4.0f, -9.0f}, 103);
    ImageF& depth = other.planes.at(Role::inverse_depth);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            depth.at(x, y) = x + y < width / 4 ? -1 : 0.8f * depth.at(x, y);
    frame.planes[Role::behind] = stack_behind(other.planes);
    frame.description.planes.add(Role::behind);
}

namespace {

// So many parts of `color`, one below another.
ImageF lights_of(const ImageF& color, int count, uint32_t seed) {
    std::vector<ImageF> lights;
    ImageF rest = color;
    for (int i = 0; i + 1 < count; ++i) {
        const ImageF part = noise_image(color.width, color.height, 4, seed + uint32_t(i), 0.0f,
                                        i == 0 ? 1.7f : 0.4f);
        ImageF light = color;
        for (size_t k = 0; k < light.data.size(); ++k) {
            light.data[k] *= part.data[k];
            rest.data[k] -= light.data[k];
        }
        lights.push_back(std::move(light));
    }
    lights.push_back(std::move(rest));
    return stack_planes(lights);
}

}  // namespace

void add_lights(TestFrame& frame, int count) {
    frame.description.layers = count;
    frame.description.planes.add(Role::layers);
    frame.planes[Role::layers] = lights_of(frame.planes.at(Role::color), count, 31);
    if (const auto behind = frame.planes.find(Role::behind); behind != frame.planes.end()) {
        const int height = frame.description.height;
        const ImageF color = plane_of_stack(behind->second, 0, height);
        behind->second = stack_planes({behind->second, lights_of(color, count, 91)});
    }
    for (const Neighbor neighbor : kNeighbors) {
        const auto color = frame.planes.find(role_of(neighbor, Role::color));
        if (color == frame.planes.end()) continue;
        const Role there = role_of(neighbor, Role::layers);
        frame.description.planes.add(there);
        frame.planes[there] = lights_of(color->second, count, 71);
    }
}

FrameDescription describe(const FramePlanes& planes) {
    FrameDescription frame;
    FramePlanes copy = planes;
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    if (!convert_frame(copy, frame, options).ok()) std::abort();
    frame.display_width = frame.width;
    frame.display_height = frame.height;
    frame.frame_number = 1;
    frame.camera.focal_length_mm = 50;
    frame.camera.sensor_width_mm = 36;
    frame.camera.f_stop = 2;
    frame.camera.focus_distance = 10;
    return frame;
}

Camera round_camera() {
    Camera camera;
    camera.focal_length_mm = 36;
    camera.sensor_width_mm = 36;
    camera.f_stop = 0.36;
    camera.focus_distance = 4;
    camera.shutter_frames = 0.5;
    return camera;
}

FrameDescription describe_round(const FramePlanes& planes) {
    FrameDescription frame = describe(planes);
    frame.camera = round_camera();
    frame.display_width = 640;
    frame.display_height = 360;
    return frame;
}

template <class A, class B>
Difference compare(const Image<A>& a, const Image<B>& b, double tolerance) {
    Difference difference;
    if (a.width != b.width || a.height != b.height || a.channels != b.channels) {
        difference.max = difference.fraction = INFINITY;
        difference.text = concat(a.width, "x", a.height, "x", a.channels, " against ", b.width, "x",
                                 b.height, "x", b.channels);
        return difference;
    }
    size_t above = 0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            double worst = 0;
            for (int c = 0; c < a.channels; ++c) {
                const double va = double(a.at(x, y, c)), vb = double(b.at(x, y, c));
                double d = std::abs(va - vb) / std::max(1.0, std::abs(vb));
                if (std::isnan(d)) d = INFINITY;
                worst = std::max(worst, d);
            }
            if (worst > tolerance) ++above;
            if (worst > difference.max) {
                difference.max = worst;
                difference.x = x;
                difference.y = y;
            }
        }
    }
    difference.fraction = a.pixels() ? double(above) / double(a.pixels()) : 0;
    difference.text =
        concat("largest difference ", difference.max, " at ", difference.x, ",", difference.y, "; ",
               above, " of ", a.pixels(), " pixels above ", tolerance);
    if (difference.x >= 0) {
        for (int c = 0; c < a.channels; ++c)
            difference.text += concat(c ? ", " : " (", a.at(difference.x, difference.y, c),
                                      " against ", b.at(difference.x, difference.y, c));
        difference.text += ")";
    }
    return difference;
}

template Difference compare(const ImageF&, const ImageF&, double);
template Difference compare(const ImageF&, const ImageD&, double);
template Difference compare(const ImageD&, const ImageD&, double);

bool equal_bits(const ImageF& a, const ImageF& b) {
    return a.width == b.width && a.height == b.height && a.channels == b.channels &&
           std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(float)) == 0;
}

}  // namespace postchain::test

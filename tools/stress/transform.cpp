#include "tools/stress/transform.h"

#include <algorithm>

namespace postchain::stress {
namespace {

bool holds_vectors(Role role) {
    return role == Role::motion || role == Role::motion_back;
}

// Maps a position on the line into 0..size-1 by mirroring at both ends, repeating border pixels.
int mirrored_at(int place, int size) {
    const int in_period = ((place % (2 * size)) + 2 * size) % (2 * size);
    return std::min(in_period, 2 * size - 1 - in_period);
}

}  // namespace

ImageF turned(const ImageF& image, Symmetry how) {
    const bool quarter = how == Symmetry::turn;
    ImageF out(quarter ? image.height : image.width, quarter ? image.width : image.height,
               image.channels);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const int to_x = how == Symmetry::mirror ? image.width - 1 - x
                             : quarter               ? image.height - 1 - y
                                                     : x;
            const int to_y = how == Symmetry::flip ? image.height - 1 - y : quarter ? x : y;
            std::copy_n(image.pixel(x, y), image.channels, out.pixel(to_x, to_y));
        }
    }
    return out;
}

ImageF turned_back(const ImageF& image, Symmetry how) {
    if (how != Symmetry::turn) return turned(image, how);
    return turned(turned(turned(image, how), how), how);
}

FramePlanes turned(const FramePlanes& planes, Symmetry how) {
    FramePlanes out;
    for (const auto& [role, plane] : planes) {
        ImageF& to = out[role] = turned(plane, how);
        if (!holds_vectors(role)) continue;
        for (size_t i = 0; i < to.data.size(); i += 2) {
            const float x = to.data[i], y = to.data[i + 1];
            to.data[i] = how == Symmetry::mirror ? -x : how == Symmetry::turn ? -y : x;
            to.data[i + 1] = how == Symmetry::flip ? -y : how == Symmetry::turn ? x : y;
        }
    }
    return out;
}

ImageF seen_through(const ImageF& image, const Window& window) {
    ImageF out(window.width, window.height, image.channels);
    for (int y = 0; y < window.height; ++y)
        for (int x = 0; x < window.width; ++x)
            std::copy_n(image.pixel(mirrored_at(x + window.x, image.width),
                                    mirrored_at(y + window.y, image.height)),
                        image.channels, out.pixel(x, y));
    return out;
}

FramePlanes seen_through(const FramePlanes& planes, const Window& window) {
    FramePlanes out;
    for (const auto& [role, plane] : planes) out[role] = seen_through(plane, window);
    return out;
}

FramePlanes dot_of(const FramePlanes& planes, int side, float value) {
    FramePlanes out;
    for (const auto& [role, plane] : planes) {
        ImageF& to = out[role] = ImageF(side, side, plane.channels);
        const float* middle = plane.pixel(plane.width / 2, plane.height / 2);
        for (size_t i = 0; i < to.data.size(); ++i)
            to.data[i] = role == Role::color ? 0 : middle[i % size_t(plane.channels)];
        if (role == Role::color) std::fill_n(to.pixel(side / 2, side / 2), plane.channels, value);
    }
    return out;
}

}  // namespace postchain::stress

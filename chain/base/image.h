// Image<T>: a dense plane of interleaved pixels on the CPU, row 0 at the top.
#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

namespace postchain {

template <class T>
struct Image {
    int width = 0;
    int height = 0;
    int channels = 0;
    std::vector<T> data;  // height * width * channels, row-major, channels interleaved

    Image() = default;
    Image(int w, int h, int c, T value = T())
        : width(w), height(h), channels(c), data(size_t(w) * size_t(h) * size_t(c), value) {}

    bool empty() const { return data.empty(); }
    size_t pixels() const { return size_t(width) * size_t(height); }
    bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }

    T* pixel(int x, int y) {
        assert(inside(x, y));
        return data.data() + (size_t(y) * size_t(width) + size_t(x)) * size_t(channels);
    }
    const T* pixel(int x, int y) const {
        assert(inside(x, y));
        return data.data() + (size_t(y) * size_t(width) + size_t(x)) * size_t(channels);
    }
    T& at(int x, int y, int c = 0) { return pixel(x, y)[c]; }
    const T& at(int x, int y, int c = 0) const { return pixel(x, y)[c]; }

    bool operator==(const Image&) const = default;
};

using ImageF = Image<float>;
using ImageD = Image<double>;

// Converts pixels to another number type.
template <class To, class From>
Image<To> image_cast(const Image<From>& from) {
    Image<To> to;
    to.width = from.width;
    to.height = from.height;
    to.channels = from.channels;
    to.data.assign(from.data.begin(), from.data.end());
    return to;
}

}  // namespace postchain

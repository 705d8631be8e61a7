// Sizes that follow from the frame's. A plan states its textures and work groups in them, so that
// one plan serves frames of every size (fit() in chain/plan/plan.h).
#pragma once

#include <array>

namespace postchain {

// The size of a frame, and the edge of a pass's tiles on it (PassOnFrame::tile_edge()).
struct FrameSize {
    int width = 0, height = 0;
    int tile_px = 1;
};

// A length along one axis: ceil(ceil(frame / per) * times / over), or a constant.
struct Extent {
    int per = 1;            // pixels of the frame; 0: the extent is a constant, `times`
    bool per_tile = false;  // instead of `per`: the edge of the pass's tiles
    int times = 1;
    int over = 1;

    constexpr int of(int frame, int tile_px) const {
        const auto parts = [](int length, int part) { return (length + part - 1) / part; };
        const int counted = per == 0 ? 1 : parts(frame, per_tile ? tile_px : per);
        return parts(counted * times, over);
    }
    bool operator==(const Extent&) const = default;
};

// A rectangle of pixels, blocks, tiles or work groups; by default the frame's pixels.
struct Area {
    Extent x, y;
    bool twice = false;  // along the frame's shorter axis

    static constexpr Area fixed(int width, int height) {
        return {{.per = 0, .times = width}, {.per = 0, .times = height}};
    }
    // The tiles of the pass that cover the frame.
    static constexpr Area tiles() { return {{.per_tile = true}, {.per_tile = true}}; }
    // Squares of edge x edge that cover this area.
    constexpr Area in_squares(int edge) const {
        Area squares = *this;
        for (Extent* axis : {&squares.x, &squares.y}) {
            const bool plain = axis->per > 0 && !axis->per_tile && axis->times == 1;
            (plain ? axis->per : axis->over) *= edge;
        }
        return squares;
    }
    // Only of an area that is not divided further than in_squares() of the frame.
    constexpr Area times(int columns, int rows) const {
        Area more = *this;
        more.x.times *= columns;
        more.y.times *= rows;
        return more;
    }
    // Two of this area, side by side along the frame's shorter axis: devices limit the longer.
    constexpr Area two() const {
        Area both = *this;
        both.twice = true;
        return both;
    }
    constexpr std::array<int, 2> of(const FrameSize& frame) const {
        const bool wide = frame.width >= frame.height;
        return {x.of(frame.width, frame.tile_px) * (twice && !wide ? 2 : 1),
                y.of(frame.height, frame.tile_px) * (twice && wide ? 2 : 1)};
    }
    bool operator==(const Area&) const = default;
};

}  // namespace postchain

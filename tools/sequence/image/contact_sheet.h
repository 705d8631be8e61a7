// One picture of many: thumbnails in rows, a label below each. Display-referred, three channels.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/image.h"

namespace postchain::io {

// The mean over the area that each pixel of the small picture covers; what is not finite counts as
// 0.
ImageF shrunk(const ImageF& picture, int width, int height);

// `most` of 0 .. count - 1 at most, the first and the last among them, evenly spread, in order.
std::vector<size_t> evenly_chosen(size_t count, size_t most);

struct SheetLayout {
    int cells = 1;
    int columns = 1;
    int sides = 1;                  // pictures beside each other in a cell
    int width = 240, height = 135;  // of a thumbnail, pixels

    int rows() const { return (cells + columns - 1) / columns; }
    int64_t picture_width() const;
    int64_t picture_height() const;
};

class ContactSheet {
  public:
    explicit ContactSheet(const SheetLayout& layout);

    // In the middle of its place; of at most its size.
    void put(int cell, int side, const Image<uint8_t>& thumbnail);
    // In the place of a picture that there is none of.
    void say(int cell, int side, const std::string& text);
    void label(int cell, const std::string& text);
    void footer(const std::string& text);

    const Image<uint8_t>& picture() const { return picture_; }

  private:
    int left(int cell, int side) const;
    int top(int cell) const;
    SheetLayout layout_;
    Image<uint8_t> picture_;
};

}  // namespace postchain::io

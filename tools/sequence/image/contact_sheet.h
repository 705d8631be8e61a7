// One image with thumbnails in rows, a label below each. Display-referred, three channels.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/image.h"

namespace postchain::io {

// Shrinks an image: the mean over the area of each new pixel; non-finite values are read as 0.
ImageF shrunk(const ImageF& picture, int width, int height);

// shrunk() of an image whose rows come one after the other.
class RowShrinker {
  public:
    RowShrinker(int from_width, int from_height, int channels, int width, int height);
    void add(const ImageF& rows);
    const ImageF& image() const { return small_; }  // whole after the last row

  private:
    void finish_row();
    int from_width_, from_height_;
    ImageF small_;
    int row_ = 0, done_ = 0;     // rows added, and finished
    std::vector<double> means_;  // over the rows that the next row of the image covers
};

// At most `most` of the numbers 0 .. count - 1, evenly spread, in order, with the first and the
// last.
std::vector<size_t> evenly_chosen(size_t count, size_t most);

struct SheetLayout {
    int cells = 1;
    int columns = 1;
    int sides = 1;                  // images beside each other in a cell
    int width = 240, height = 135;  // thumbnail, pixels

    int rows() const { return (cells + columns - 1) / columns; }
    int64_t image_width() const;
    int64_t image_height() const;
};

class ContactSheet {
  public:
    explicit ContactSheet(const SheetLayout& layout);

    // Draws an image centered in its place; it must not be larger than the place.
    void put(int cell, int side, const Image<uint8_t>& thumbnail);
    // Fills the place of a missing image.
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

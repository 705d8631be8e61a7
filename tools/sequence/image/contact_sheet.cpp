#include "tools/sequence/image/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace postchain::io {
namespace {

// A font of its own, since render nodes may have none: digits, lower-case letters and '-'; any
// other character is a gap.
constexpr int kLabelHeight = 14;  // pixels
constexpr int kRows = 7, kColumns = 5, kAdvance = kColumns + 1;
constexpr int kScale = kLabelHeight / kRows;  // pixels of a dot

// Characters side by side, a column apart.
struct Drawing {
    std::string_view characters;
    std::array<std::string_view, kRows> rows;
};
constexpr Drawing kDrawings[] = {
    {"0123456789-",
     {" ###    #    ###   ###     #  #####   ##  #####  ###   ###       ",
      "#   #  ##   #   # #   #   ##  #      #        # #   # #   #      ",
      "#  ##   #       #     #  # #  ####  #        #  #   # #   #      ",
      "# # #   #      #    ##  #  #      # ####    #    ###   #### #####",
      "##  #   #     #       # #####     # #   #  #    #   #     #      ",
      "#   #   #    #    #   #    #  #   # #   #  #    #   #    #       ",
      " ###   ###  #####  ###     #   ###   ###   #     ###   ##        "}},
    {"abcdefghijklm",
     {"      #               #         ##        #       #      #  #      ##        ",
      "      #               #        #          #                 #       #        ",
      " ###  ####   ###   ####  ###  ####   #### ####   ##     ##  #  #    #   ## # ",
      "    # #   # #     #   # #   #  #    #   # #   #   #      #  # #     #   # # #",
      " #### #   # #     #   # #####  #     #### #   #   #      #  ##      #   # # #",
      "#   # #   # #   # #   # #      #        # #   #   #   #  #  # #     #   # # #",
      " #### ####   ###   ####  ###   #     ###  #   #  ###   ##   #  #   ###  # # #"}},
    {"nopqrstuvwxyz",
     {"                                     #                                       ",
      "                                     #                                       ",
      "####   ###  ####   #### # ##   #### ####  #   # #   # #   # #   # #   # #####",
      "#   # #   # #   # #   # ##    #      #    #   # #   # # # #  # #  #   #    # ",
      "#   # #   # ####   #### #      ###   #    #   # #   # # # #   #    ####   #  ",
      "#   # #   # #         # #         #  #  # #   #  # #  # # #  # #      #  #   ",
      "#   #  ###  #         # #     ####    ##   ####   #    # #  #   #  ###  #####"}},
};

bool has_dot(char c, int column, int row) {
    for (const Drawing& drawing : kDrawings)
        if (const size_t at = drawing.characters.find(c); at != std::string_view::npos)
            return drawing.rows[size_t(row)][at * kAdvance + size_t(column)] == '#';
    return false;
}

// Width of a text, pixels.
int label_width(std::string_view text) {
    return text.empty() ? 0 : (int(text.size()) * kAdvance - 1) * kScale;
}

// Draws text in one gray (0..255) with its upper left corner at (x, y), clipped to the image.
void draw_label(Image<uint8_t>& picture, int x, int y, std::string_view text, uint8_t gray) {
    for (size_t i = 0; i < text.size(); ++i)
        for (int py = 0; py < kRows * kScale; ++py)
            for (int px = 0; px < kColumns * kScale; ++px) {
                const int at_x = x + int(i) * kAdvance * kScale + px, at_y = y + py;
                if (!picture.inside(at_x, at_y) || !has_dot(text[i], px / kScale, py / kScale))
                    continue;
                for (int c = 0; c < picture.channels; ++c) picture.at(at_x, at_y, c) = gray;
            }
}

constexpr int kGap = 12;                 // between cells and around them
constexpr int kBar = kLabelHeight + 10;  // a label with room above and below it
constexpr uint8_t kGround = 24, kText = 220, kNote = 150, kEmpty = 48;

// visit(i, share) for each of `from` samples that sample `at` of `to` covers; the shares sum to 1.
template <class Visit>
void each_covered(int from, int to, int at, const Visit& visit) {
    const double step = double(from) / to;
    const double begin = at * step, end = begin + step;
    for (int i = int(begin); i < from && i < end; ++i)
        visit(i, (std::min(end, i + 1.0) - std::max(begin, double(i))) / step);
}

}  // namespace

RowShrinker::RowShrinker(int from_width, int from_height, int channels, int width, int height)
    : from_width_(from_width),
      from_height_(from_height),
      small_(width, height, channels),
      means_(size_t(from_width) * size_t(channels)) {}

void RowShrinker::add(const ImageF& rows) {
    const double step = double(from_height_) / small_.height;
    for (int y = 0; y < rows.height; ++y, ++row_) {
        const float* values = rows.pixel(0, y);
        while (done_ < small_.height) {
            const double begin = done_ * step, end = begin + step;
            if (row_ < int(begin)) break;
            const double share = (std::min(end, row_ + 1.0) - std::max(begin, double(row_))) / step;
            for (size_t i = 0; i < means_.size(); ++i)
                if (std::isfinite(values[i])) means_[i] += share * double(values[i]);
            if (row_ + 1 < end && row_ + 1 < from_height_) break;
            finish_row();
        }
    }
}

void RowShrinker::finish_row() {
    const size_t channels = size_t(small_.channels);
    std::vector<double> sums(channels);
    for (int x = 0; x < small_.width; ++x) {
        std::ranges::fill(sums, 0.0);
        each_covered(from_width_, small_.width, x, [&](int column, double share) {
            for (size_t c = 0; c < channels; ++c)
                sums[c] += share * means_[size_t(column) * channels + c];
        });
        for (size_t c = 0; c < channels; ++c) small_.pixel(x, done_)[c] = float(sums[c]);
    }
    std::ranges::fill(means_, 0.0);
    ++done_;
}

ImageF shrunk(const ImageF& picture, int width, int height) {
    RowShrinker shrinker(picture.width, picture.height, picture.channels, width, height);
    shrinker.add(picture);
    return shrinker.image();
}

std::vector<size_t> evenly_chosen(size_t count, size_t most) {
    const size_t number = std::min(count, most);
    std::vector<size_t> chosen;
    for (size_t i = 0; i < number; ++i)
        chosen.push_back(number == 1 ? 0 : (i * (count - 1) + (number - 1) / 2) / (number - 1));
    return chosen;
}

int64_t SheetLayout::image_width() const {
    return kGap + int64_t(columns) * (int64_t(sides) * width + kGap);
}

int64_t SheetLayout::image_height() const {
    return kGap + int64_t(rows()) * (int64_t(height) + kBar) + kBar;
}

ContactSheet::ContactSheet(const SheetLayout& layout)
    : layout_(layout),
      picture_(int(layout.image_width()), int(layout.image_height()), 3, kGround) {}

int ContactSheet::left(int cell, int side) const {
    return kGap + cell % layout_.columns * (layout_.sides * layout_.width + kGap) +
           side * layout_.width;
}

int ContactSheet::top(int cell) const {
    return kGap + cell / layout_.columns * (layout_.height + kBar);
}

void ContactSheet::put(int cell, int side, const Image<uint8_t>& thumbnail) {
    const int x0 = left(cell, side) + (layout_.width - thumbnail.width) / 2;
    const int y0 = top(cell) + (layout_.height - thumbnail.height) / 2;
    for (int y = 0; y < thumbnail.height; ++y)
        for (int x = 0; x < thumbnail.width; ++x)
            for (int c = 0; c < 3; ++c)
                picture_.at(x0 + x, y0 + y, c) =
                    thumbnail.at(x, y, thumbnail.channels == 3 ? c : 0);
}

void ContactSheet::say(int cell, int side, const std::string& text) {
    const Image<uint8_t> empty(layout_.width, layout_.height, 3, kEmpty);
    put(cell, side, empty);
    draw_label(picture_, left(cell, side) + (layout_.width - label_width(text)) / 2,
               top(cell) + (layout_.height - kLabelHeight) / 2, text, kNote);
}

void ContactSheet::label(int cell, const std::string& text) {
    draw_label(picture_, left(cell, 0) + (layout_.sides * layout_.width - label_width(text)) / 2,
               top(cell) + layout_.height + (kBar - kLabelHeight) / 2, text, kText);
}

void ContactSheet::footer(const std::string& text) {
    draw_label(picture_, kGap, picture_.height - kBar + (kBar - kLabelHeight) / 2 - 4, text, kNote);
}

}  // namespace postchain::io

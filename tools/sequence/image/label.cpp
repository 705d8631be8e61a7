#include "tools/sequence/image/label.h"

#include <array>

namespace postchain::io {
namespace {

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

}  // namespace

int label_width(std::string_view text) {
    return text.empty() ? 0 : (int(text.size()) * kAdvance - 1) * kScale;
}

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

}  // namespace postchain::io

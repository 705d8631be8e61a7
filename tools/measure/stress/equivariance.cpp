// Turns, moves and the dot: what the filters commute with, and what they keep.
//
//   turns  turned(filter(frame)) against filter(turned(frame)): mirror, flip, quarter turn
//   moves  two windows on the frame continued, one moved by s px: what both show must be equal
//          where s is a whole number of tiles and boxes (shift), and is measured where not (grid)
//   dot    one bright pixel in black under the middle pixel's depth and motion everywhere
#include <algorithm>
#include <cmath>

#include "tools/measure/stress/measurement.h"

namespace postchain::stress {
namespace {

ImageF cut(const ImageF& image, int x, int y, int width, int height) {
    ImageF out(width, height, image.channels);
    for (int row = 0; row < height; ++row)
        std::copy_n(image.pixel(x, y + row), width * image.channels, out.pixel(0, row));
    return out;
}

// The checkerboard hint always blends with the pixel above (docs/fxaa.md).
void without_checkerboard(Chain& chain) {
    for (auto& link : chain.links) {
        const Parameter* row = link.type->parameters->find("hint");
        if (row && row->get(link.pass->parameters()) == ParameterValue("checkerboard"))
            row->set(link.pass->parameters(), "none");
    }
}

// Keeps NaN, once met.
bool is_worse(double value, double worst) {
    return !(value <= worst) && !std::isnan(worst);
}

}  // namespace

bool Measurement::fits_lattice() const {
    const int lattice = lattice_px(subject_.chain);
    return color().width % lattice == 0 && color().height % lattice == 0;
}

Chain Measurement::without_jitter() const {
    Chain chain = subject_.chain.clone();
    for (auto& link : chain.links) {
        for (const auto& row : link.type->parameters->rows()) {
            if (row.key == "jitter") row.set(link.pass->parameters(), 0.0);
            if (row.key == "tile_jitter") row.set(link.pass->parameters(), false);
        }
    }
    return chain;
}

Status Measurement::turns() {
    if (!fits_lattice()) return Status();
    const std::pair<Turn, const char*> rows[] = {
        {Turn::mirror, "mirror"}, {Turn::flip, "flip"}, {Turn::quarter, "turn"}};
    Chain chain = without_jitter();
    for (const auto& [turn, check] : rows) {
        if (turn == Turn::flip) without_checkerboard(chain);
        auto straight = filter(chain, cell_.frame, cell_.planes);
        if (!straight.ok()) return straight.status();
        auto filtered = filter_anew(chain, turned(cell_.planes, turn));
        if (!filtered.ok()) return filtered.status();
        add_mean(check, color(), turned_back(*filtered, turn), *straight,
                 "result of the frame as it is");
    }
    return Status();
}

Status Measurement::shift() {
    if (!fits_lattice()) return Status();
    const Chain chain = without_jitter();
    const int lattice = lattice_px(chain), tile = tile_px(chain);
    const int width = color().width, height = color().height;
    // Whole tiles on each side, so that the first window meets them as the frame does.
    const int reach = reach_of(chain, cell_.frame.display_width).depends + lattice;
    const int margin = (reach + lattice - 1) / lattice * lattice;

    // The cell as a window shows it that lies `s` px further left (or up), so that the cell stands
    // s px further right (or down) among the tiles. Windows are wider along the move alone: across
    // it, both have the same border.
    const auto filtered = [&](bool along_x, int s) -> Result<ImageF> {
        const int mx = along_x ? margin : 0, my = along_x ? 0 : margin;
        const int sx = along_x ? s : 0, sy = along_x ? 0 : s;
        const Window window = {-mx - sx, -my - sy, width + 2 * mx, height + 2 * my};
        auto out = filter_anew(chain, seen_through(cell_.planes, window));
        if (!out.ok()) return out.status();
        return cut(*out, mx + sx, my + sy, width, height);
    };

    // Of the moves by parts of a tile, the one that shows most: 1 px, a quarter, a half, all but 1.
    struct Move {
        bool along_x;
        int s;
    };
    const Move moves[] = {{true, 1}, {false, tile / 4}, {true, tile / 2}, {false, tile - 1}};
    std::pair<ImageF, ImageF> whole[2];  // moved, and not
    Measured grid;
    std::pair<ImageF, ImageF> shown;
    for (bool along_x : {true, false}) {
        auto still = filtered(along_x, 0);
        if (!still.ok()) return still.status();
        auto moved = filtered(along_x, lattice);
        if (!moved.ok()) return moved.status();
        const double mean = mean_of(*still);
        for (const Move& move : moves) {
            if (move.along_x != along_x || move.s < 1 || move.s >= lattice) continue;
            auto part = filtered(along_x, move.s);
            if (!part.ok()) return part.status();
            double sum = 0;
            for (size_t i = 0; i < part->data.size(); ++i)
                sum += std::abs(double(part->data[i]) - double(still->data[i]));
            const double most = std::max(mean, mean_of(*part)) * double(part->data.size());
            const double value = most > 0 ? sum / most : sum;
            if (shown.first.empty() || !(value <= grid.value)) {
                grid.value = value;
                grid.note = concat("of the colors, after a move by ", move.s, " px ",
                                   along_x ? "to the right" : "down");
                shown = {std::move(*part), *still};
            }
        }
        whole[along_x ? 0 : 1] = {std::move(*moved), std::move(*still)};
    }
    // Both directions as one picture, one above the other.
    const auto stacked = [](const ImageF& a, const ImageF& b) {
        ImageF both(a.width, 2 * a.height, a.channels);
        std::copy(a.data.begin(), a.data.end(), both.data.begin());
        std::copy(b.data.begin(), b.data.end(), both.data.begin() + std::ptrdiff_t(a.data.size()));
        return both;
    };
    add_equal("shift", stacked(color(), color()), stacked(whole[0].first, whole[1].first),
              stacked(whole[0].second, whole[1].second),
              "result of the frame not moved; above: moved right, below: down");
    if (shown.first.empty()) return Status();  // tiles of one pixel have no parts
    add("grid", grid.value, bounds_.grid, grid.note);
    ImageF map = errors_of(color(), shown.first, shown.second);
    exhibit(color(), shown.first, shown.second, std::move(map), "result of the frame not moved",
            "relative error");
    return Status();
}

Result<std::array<double, 4>> Measurement::light_left(const Chain& chain, const FramePlanes& dot,
                                                      float value, ImageF& out) {
    auto filtered = filter_anew(chain, dot);
    if (!filtered.ok()) return filtered.status();
    out = std::move(*filtered);
    std::array<double, 4> left = {};
    for (size_t i = 0; i < out.data.size(); ++i) left[i % 4] += out.data[i] / double(value);
    return left;
}

Status Measurement::dot() {
    if (!fits_lattice()) return Status();
    const Chain whole = without_jitter();
    // Without the passes that read color alone.
    Chain linear = whole.clone();
    std::erase_if(linear.links, [](const ChainLink& link) {
        const RoleUse use = link.pass->roles();
        const RoleSet reads = use.required | use.optional;
        return !reads.has(Role::motion) && !reads.has(Role::inverse_depth);
    });
    const int side = 2 * reach_of(whole, cell_.frame.display_width).light + 1;
    const double most = held(largest_of(color()));
    const float value = most > 0 ? float(most) : 1;
    const FramePlanes planes = dot_of(cell_.planes, side, value);

    ImageF out;
    double worst = 0, kept = 1;
    if (!linear.links.empty()) {
        const auto left = light_left(linear, planes, value, out);
        if (!left.ok()) return left.status();
        for (double part : *left) {
            if (!is_worse(std::abs(part - 1), worst)) continue;
            worst = std::abs(part - 1);
            kept = part;
        }
    }
    if (linear.links.size() < whole.links.size()) {
        const auto left = light_left(whole, planes, value, out);
        if (!left.ok()) return left.status();
        for (double part : *left) {
            if (!is_worse(part - 1, worst)) continue;
            worst = part - 1;
            kept = part;
        }
    }
    add("dot", worst, bounds_.dot, concat("of a dot of ", value, "; ", kept, " of it is left"));
    ImageF map(side, side, 1);
    for (size_t i = 0; i < map.pixels(); ++i)
        map.data[i] = float(std::abs(double(out.data[4 * i])) / value);
    exhibit(planes.at(Role::color), out, planes.at(Role::color), std::move(map), "the dot",
            "light of the first channel, relative to the dot");
    return Status();
}

}  // namespace postchain::stress

#include "tools/measure/stress/equivariance.h"

#include <algorithm>
#include <cmath>

namespace postchain::stress {
namespace {

ImageF cut(const ImageF& image, int x, int y, int width, int height) {
    ImageF out(width, height, image.channels);
    for (int row = 0; row < height; ++row)
        std::copy_n(image.pixel(x, y + row), width * image.channels, out.pixel(0, row));
    return out;
}

// Keeps NaN once found.
bool is_worse(double value, double worst) {
    return !(value <= worst) && !std::isnan(worst);
}

}  // namespace

bool CellMeasurement::fits_tiles() const {
    const int tile = tile_px(subject_.chain);
    return color().width % tile == 0 && color().height % tile == 0;
}

std::optional<Chain> CellMeasurement::chain_with(Symmetry symmetry) const {
    return subject_.chain.that_guarantees(
        [&](const Guarantees& one) { return one.symmetries.count(symmetry) > 0; });
}

Status CellMeasurement::turns() {
    if (!fits_tiles()) return Status();
    struct Row {
        Turn turn;
        Symmetry symmetry;
        const char* check;
    };
    const Row rows[] = {{Turn::mirror, Symmetry::mirror, "mirror"},
                        {Turn::flip, Symmetry::flip, "flip"},
                        {Turn::quarter, Symmetry::turn, "turn"}};
    for (const auto& [turn, symmetry, check] : rows) {
        const auto chain = wants(check) ? chain_with(symmetry) : std::nullopt;
        if (!chain) continue;
        ASSIGN_OR_RETURN(auto straight, filter(*chain, cell_.frame, cell_.planes));
        ASSIGN_OR_RETURN(auto filtered, filter_anew(*chain, turned(cell_.planes, turn)));
        add_mean(check, color(), turned_back(filtered, turn), straight,
                 "result of the unchanged frame");
    }
    return Status();
}

Status CellMeasurement::shift() {
    if (!wants("shift") && !wants("grid")) return Status();
    const auto chain = chain_with(Symmetry::shift);
    if (!fits_tiles() || !chain) return Status();
    const double reach = chain->reach(cell_.frame).depends_px;
    if (std::isinf(reach)) return Status();
    const int tile = tile_px(*chain);
    const int width = color().width, height = color().height;
    // Whole tiles on each side, so that the first window has the same alignment as the frame.
    const int margin = (int(std::ceil(reach)) + 2 * tile - 1) / tile * tile;

    // The result seen through a window that starts `s` px further left (or up), so that the cell is
    // s px further right (or down) relative to the tiles. Windows are wider along the move only;
    // across it, both have the same border.
    const auto filtered = [&](bool along_x, int s) -> Result<ImageF> {
        const int mx = along_x ? margin : 0, my = along_x ? 0 : margin;
        const int sx = along_x ? s : 0, sy = along_x ? 0 : s;
        const Window window = {-mx - sx, -my - sy, width + 2 * mx, height + 2 * my};
        ASSIGN_OR_RETURN(auto out, filter_anew(*chain, seen_through(cell_.planes, window)));
        return cut(out, mx + sx, my + sy, width, height);
    };

    // The moves by parts of a tile (1 px, a quarter, a half, all but 1), and the one with the
    // largest change.
    struct Move {
        bool along_x;
        int s;
    };
    const Move moves[] = {{true, 1}, {false, tile / 4}, {true, tile / 2}, {false, tile - 1}};
    std::pair<ImageF, ImageF> whole[2];  // moved and not moved
    Measured grid;
    std::pair<ImageF, ImageF> shown;
    for (bool along_x : {true, false}) {
        ASSIGN_OR_RETURN(auto still, filtered(along_x, 0));
        ASSIGN_OR_RETURN(auto moved, filtered(along_x, tile));
        const double mean = mean_of(still);
        for (const Move& move : moves) {
            if (move.along_x != along_x || move.s < 1 || move.s >= tile) continue;
            ASSIGN_OR_RETURN(auto part, filtered(along_x, move.s));
            double sum = 0;
            for (size_t i = 0; i < part.data.size(); ++i)
                sum += std::abs(double(part.data[i]) - double(still.data[i]));
            const double most = std::max(mean, mean_of(part)) * double(part.data.size());
            const double value = most > 0 ? sum / most : sum;
            if (shown.first.empty() || !(value <= grid.value)) {
                grid.value = value;
                grid.note = concat("of the colors, after a move by ", move.s, " px ",
                                   along_x ? "to the right" : "down");
                shown = {std::move(part), still};
            }
        }
        whole[along_x ? 0 : 1] = {std::move(moved), std::move(still)};
    }
    // Both directions in one image, stacked.
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

Result<std::array<double, 4>> CellMeasurement::light_left(const Chain& chain,
                                                          const FramePlanes& dot, float value,
                                                          ImageF& out) {
    ASSIGN_OR_RETURN(out, filter_anew(chain, dot));
    std::array<double, 4> left = {};
    for (size_t i = 0; i < out.data.size(); ++i) left[i % 4] += out.data[i] / double(value);
    return left;
}

Status CellMeasurement::dot() {
    if (!wants("dot") || !fits_tiles()) return Status();
    // The passes that keep light; and all passes if none gains light.
    Chain keeping, chain;
    for (const auto& link : subject_.chain.links) {
        if (auto one =
                link.that_guarantees([](const Guarantees& p) { return p.light == Light::kept; }))
            keeping.links.push_back(std::move(*one));
        if (auto one =
                link.that_guarantees([](const Guarantees& p) { return p.light != Light::any; }))
            chain.links.push_back(std::move(*one));
    }
    if (chain.links.size() < subject_.chain.links.size()) chain = keeping.clone();
    if (chain.links.empty()) return Status();
    // Reach from the dot to all pixels that contribute to pixels receiving its light.
    double largest = 0;
    for (const auto& link : chain.links)
        largest = std::max(largest, reach_of(*link.pass, cell_.frame).spreads_px);
    const double reach = chain.reach(cell_.frame).spreads_px + largest;
    if (std::isinf(reach)) return Status();
    const int side = 2 * int(std::ceil(reach)) + 1;
    const double most = held(largest_of(color()));
    const float value = most > 0 ? float(most) : 1;
    const FramePlanes planes = dot_of(cell_.planes, side, value);

    ImageF out;
    double worst = 0, kept = 1;
    if (!keeping.links.empty()) {
        ASSIGN_OR_RETURN(const auto left, light_left(keeping, planes, value, out));
        for (double part : left) {
            if (!is_worse(std::abs(part - 1), worst)) continue;
            worst = std::abs(part - 1);
            kept = part;
        }
    }
    if (keeping.links.size() < chain.links.size()) {
        ASSIGN_OR_RETURN(const auto left, light_left(chain, planes, value, out));
        for (double part : left) {
            if (!is_worse(part - 1, worst)) continue;
            worst = part - 1;
            kept = part;
        }
    }
    add("dot", worst, bounds_.dot, concat("of a dot of ", value, "; ", kept, " of it remains"));
    ImageF map(side, side, 1);
    for (size_t i = 0; i < map.pixels(); ++i)
        map.data[i] = float(std::abs(double(out.data[4 * i])) / value);
    exhibit(planes.at(Role::color), out, planes.at(Role::color), std::move(map), "the dot",
            "light of the first channel, relative to the dot");
    return Status();
}

}  // namespace postchain::stress

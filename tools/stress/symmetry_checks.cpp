#include "tools/stress/symmetry_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "chain/base/text.h"
#include "tools/stress/image_change.h"
#include "tools/stress/transform.h"

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

// Sides are multiples of r.
bool fits_tiles(const Measurement& measured) {
    const int tile = tile_px(measured.chain());
    return measured.color().width % tile == 0 && measured.color().height % tile == 0;
}

// The chain under test, or one with variants of its passes, that has this symmetry.
std::optional<Chain> chain_with(const Measurement& measured, Symmetry symmetry) {
    return measured.chain().that_guarantees(
        [&](const Guarantees& one) { return one.symmetries.count(symmetry) > 0; });
}

// Remaining fraction of the dot's light in each channel; `out` gets the image.
Result<std::array<double, 4>> light_left(Measurement& measured, const Chain& chain,
                                         const FramePlanes& dot, float value, ImageF& out) {
    ASSIGN_OR_RETURN(out, measured.filter_anew(chain, dot));
    std::array<double, 4> left = {};
    for (size_t i = 0; i < out.data.size(); ++i) left[i % 4] += out.data[i] / double(value);
    return left;
}

}  // namespace

Status check_turns(Measurement& measured) {
    if (!fits_tiles(measured)) return Status();
    const std::pair<Symmetry, const char*> rows[] = {
        {Symmetry::mirror, "mirror"}, {Symmetry::flip, "flip"}, {Symmetry::turn, "turn"}};
    for (const auto& [symmetry, check] : rows) {
        const auto chain = measured.wants(check) ? chain_with(measured, symmetry) : std::nullopt;
        if (!chain) continue;
        ASSIGN_OR_RETURN(auto straight,
                         measured.filter(*chain, measured.cell().frame, measured.cell().planes));
        ASSIGN_OR_RETURN(auto filtered,
                         measured.filter_anew(*chain, turned(measured.cell().planes, symmetry)));
        measured.add_mean(check, measured.color(), turned_back(filtered, symmetry), straight,
                          "result of the unchanged frame");
    }
    return Status();
}

Status check_shift(Measurement& measured) {
    if (!measured.wants("shift") && !measured.wants("grid")) return Status();
    const auto chain = chain_with(measured, Symmetry::shift);
    if (!fits_tiles(measured) || !chain) return Status();
    const double reach = chain->reach(measured.cell().frame).depends_px;
    if (std::isinf(reach)) return Status();
    const int tile = tile_px(*chain);
    const int width = measured.color().width, height = measured.color().height;
    // Whole tiles on each side, so that the first window has the same alignment as the frame.
    const int margin = (int(std::ceil(reach)) + 2 * tile - 1) / tile * tile;

    // The result seen through a window that starts `s` px further left (or up), so that the cell is
    // s px further right (or down) relative to the tiles. Windows are wider along the move only;
    // across it, both have the same border.
    const auto filtered = [&](bool along_x, int s) -> Result<ImageF> {
        const int mx = along_x ? margin : 0, my = along_x ? 0 : margin;
        const int sx = along_x ? s : 0, sy = along_x ? 0 : s;
        const Window window = {-mx - sx, -my - sy, width + 2 * mx, height + 2 * my};
        ASSIGN_OR_RETURN(
            auto out, measured.filter_anew(*chain, seen_through(measured.cell().planes, window)));
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
    measured.add_equal("shift", stacked(measured.color(), measured.color()),
                       stacked(whole[0].first, whole[1].first),
                       stacked(whole[0].second, whole[1].second),
                       "result of the frame not moved; above: moved right, below: down");
    if (shown.first.empty()) return Status();  // tiles of one pixel have no parts
    measured.add("grid", grid.value, measured.bounds().grid, grid.note);
    ImageF map = errors_of(measured.color(), shown.first, shown.second);
    measured.add_images(measured.color(), shown.first, shown.second, std::move(map),
                        "result of the frame not moved", "relative error");
    return Status();
}

Status check_dot(Measurement& measured) {
    if (!measured.wants("dot") || !fits_tiles(measured)) return Status();
    // The passes that keep light; and all passes if none gains light.
    Chain keeping, chain;
    for (const auto& link : measured.chain().links) {
        if (auto one =
                link.that_guarantees([](const Guarantees& p) { return p.light == Light::kept; }))
            keeping.links.push_back(std::move(*one));
        if (auto one =
                link.that_guarantees([](const Guarantees& p) { return p.light != Light::any; }))
            chain.links.push_back(std::move(*one));
    }
    if (chain.links.size() < measured.chain().links.size()) chain = keeping.clone();
    if (chain.links.empty()) return Status();
    // Reach from the dot to all pixels that contribute to pixels receiving its light.
    double largest = 0;
    for (const auto& link : chain.links)
        largest = std::max(largest, reach_of(*link.pass, measured.cell().frame).spreads_px);
    const double reach = chain.reach(measured.cell().frame).spreads_px + largest;
    if (std::isinf(reach)) return Status();
    const int side = 2 * int(std::ceil(reach)) + 1;
    const double most = measured.stored(largest_of(measured.color()));
    const float value = most > 0 ? float(most) : 1;
    const FramePlanes planes = dot_of(measured.cell().planes, side, value);

    ImageF out;
    double worst = 0, kept = 1;
    if (!keeping.links.empty()) {
        ASSIGN_OR_RETURN(const auto left, light_left(measured, keeping, planes, value, out));
        for (double part : left) {
            if (!is_worse(std::abs(part - 1), worst)) continue;
            worst = std::abs(part - 1);
            kept = part;
        }
    }
    if (keeping.links.size() < chain.links.size()) {
        ASSIGN_OR_RETURN(const auto left, light_left(measured, chain, planes, value, out));
        for (double part : left) {
            if (!is_worse(part - 1, worst)) continue;
            worst = part - 1;
            kept = part;
        }
    }
    measured.add("dot", worst, measured.bounds().dot,
                 concat("of a dot of ", value, "; ", kept, " of it remains"));
    ImageF map(side, side, 1);
    for (size_t i = 0; i < map.pixels(); ++i)
        map.data[i] = float(std::abs(double(out.data[4 * i])) / value);
    measured.add_images(planes.at(Role::color), out, planes.at(Role::color), std::move(map),
                        "the dot", "light of the first channel, relative to the dot");
    return Status();
}

}  // namespace postchain::stress

#include "tools/stress/limits.h"

#include <algorithm>

#include "tools/stress/matrix.h"

namespace postchain::stress {
namespace {

const KnownLimit* limit_of(const KnownLimits& all, const ChainLink& link, const std::string& check,
                           const std::string& cell) {
    const auto of_pass = all.find(link.type->name);
    if (of_pass == all.end()) return nullptr;
    const std::string parameters = link.type->parameters->text(link.pass->parameters());
    const auto& limits = of_pass->second;
    const auto found = std::ranges::find_if(limits, [&](const KnownLimit& limit) {
        return limit.check == check && matches(limit.parameters, parameters) &&
               matches(limit.cells, cell);
    });
    return found == limits.end() ? nullptr : &*found;
}

// The inverse warp.
constexpr const char* kBrightPixel =
    "bright pixel in black: it falls to 0 within one pixel, and a change of a path of 10 px by eps "
    "moves that edge by 10 eps";
constexpr const char* kSteepLens =
    "steep lens: at f/0.1, focused at the near plane, 1 % of depth is 22 px of radius, 560 px in a "
    "picture 16384 px wide: what was sharp is blurred";
constexpr const char* kApart =
    "paths that part: where neighbors part by 5 px a pixel nothing is found, and a position that "
    "rounds to the next pixel leads 5 px further, to another fill";

constexpr const char* kSplit =
    "edges split at 0.5 px: if the surface in front moves less, the pixels of its outline stay "
    "with it; if it moves more, they are split";

constexpr const char* kTiedSample =
    "a sample that ties: where another rounding decides for another surface, one sample of a pixel "
    "differs, and denoising spreads that over 25 of the cell's 512 pixels";

// Guertin.
constexpr const char* kShortVector =
    "vectors below 1e-19 px: their squares are 0 in fp32, so they have no direction; in double "
    "precision they have one, and are weighted by it";
constexpr const char* kStillNoise =
    "noise on still vectors: w_B of a vector of length 0 is 0, of any other length up to 1";

// Depth of field, gilham.
constexpr const char* kOrder =
    "rows before columns: with a leak test the second pass weighs what the first has mixed";
constexpr const char* kBoxes = "boxes: the downsampled image moves in steps of its boxes";

// FXAA.
constexpr const char* kTies =
    "ties of FXAA 3.11: rows win over columns and the pixel above over the one below, in a turned "
    "picture others; and another rounding decides otherwise";
constexpr const char* kEdges =
    "light beside black: of light of 1e6 beside black FXAA leaves as much as a display shows, and "
    "how much depends on where the edge lies";
constexpr const char* kOnset =
    "onset at 0.5 px: above that half-velocity the blur begins, and with it FXAA's hint";

}  // namespace

const KnownLimits& known_limits() {
    static const KnownLimits limits = {
        {"motion_blur",
         {{"motion", "mode=inverse_warp", "/radiance/firefly", 24, kBrightPixel},
          {"motion", "mode=inverse_warp", "/paths/apart, nothing found/fp32", 6.5, kApart},
          {"depth", "mode=inverse_warp", "/paths/apart, nothing found/fp32", 140, kApart},
          {"motion", "mode=inverse_warp", "/speed/object 0.5 px, ground 1*px across/fp32", 16,
           kSplit},
          {"reference", "mode=guertin", "/denormal/motion", 0.009, kShortVector},
          {"noise", "mode=guertin", "", 4.8, kStillNoise},
          {"motion", "", "/radiance/firefly*fp16", 26,
           "few taps: a single pixel's streak is no more than the taps that meet it, and after a "
           "change of 1 % some round the other way"}}},
        {"fxaa",
         {{"flip", "", "/radiance/both signs, 1e10/", 0.0051, kTies},
          {"flip", "", "/crossed/*both signs, 65504", 0.0145, kTies},
          {"turn", "", "/radiance/both signs", 0.032, kTies},
          {"turn", "", "/crossed/", 0.0077, kTies},
          {"reference", "", "/radiance/both signs, 1e10/", 0.015, kTies},
          {"grid", "", "/crossed/*firefly 1e10", 1.05, kEdges},
          {"depth", "", "/crossed/*firefly 1e10, f/0.1 at the near plane/fp32", 156, kEdges},
          {"motion", "hint=checkerboard", "/speed/*0.5 px", 560, kOnset}}},
        {"depth_of_field",
         {{"turn", "leak=coc", "/crossed/", 0.03, kOrder},
          {"turn", "leak=coc", "", 0.0024, kOrder},
          {"grid", "", "/radiance/firefly", 0.76, kBoxes},
          {"grid", "", "/nonfinite/inf in color, clamped/", 0.058, kBoxes},
          {"grid", "", "/crossed/", 0.53, kBoxes},
          {"depth", "", "/crossed/*f/0.1", 86,
           "steep lens: at f/0.1, focused at the near plane, 1 % of depth is 22 px of radius"}}},
        {"joint_blur",
         {{"motion", "", "/radiance/firefly", 10.5, kBrightPixel},
          {"motion", "starts=6", "/paths/apart, nothing found/fp32", 6.5, kApart},
          {"depth", "starts=5", "/paths/apart, nothing found/fp32", 142, kApart},
          {"depth", "starts=6", "/paths/apart, nothing found/fp32", 142, kApart},
          {"depth", "starts=8", "/paths/apart, nothing found/fp32", 142, kApart},
          {"depth", "", "/paths/apart, nothing found/fp32", 130, kApart},
          {"reference", "denoise=true", "/crossed/*both signs, 65504, f/0.1 at the near plane/fp32",
           3e-4, kTiedSample},
          {"depth", "starts=5", "/lens/f/0.", 10, kSteepLens},
          {"depth", "starts=6", "/lens/f/0.", 10, kSteepLens},
          {"depth", "", "/lens/f/0.", 8, kSteepLens},
          {"depth", "", "/crossed/*f/0.1 at the near plane", 230, kSteepLens}}}};
    return limits;
}

void apply_known_limits(const Chain& chain, CellResult& cell, const KnownLimits& limits) {
    const std::string name = cell.name();
    for (auto& one : cell.measured) {
        if (one.verdict != Verdict::failed) continue;
        const KnownLimit* widest = nullptr;
        for (const auto& link : chain.links) {
            const KnownLimit* limit = limit_of(limits, link, one.check, name);
            if (limit && (!widest || limit->bound > widest->bound)) widest = limit;
        }
        if (!widest) continue;
        if (one.value <= widest->bound) {
            one.verdict = Verdict::limit;
            one.limit = widest;
        } else {
            one.note += concat("; beyond the known limit ", widest->bound, ": ", widest->reason);
        }
    }
}

}  // namespace postchain::stress

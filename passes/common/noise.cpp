#include "passes/common/noise.h"

#include <cmath>
#include <limits>
#include <vector>
#include "chain/pass/work_list.h"
#include "shaders/shared/noise_uniforms.h"

namespace postchain::noise {
namespace {

// A 32 bit mix (C. Wellons, "lowbias32"); 0 stays 0.
uint32_t mix_bits(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Void and cluster: pixels are ranked so that any prefix of the ranks is spread evenly. Energy of
// a pixel = sum over set pixels of a Gaussian of the toroidal distance, sigma 1.5 pixels.
class VoidAndCluster {
  public:
    std::array<uint16_t, kBlueSize * kBlueSize> ranks() {
        scatter();
        const std::vector<bool> start = set_;
        const std::vector<int64_t> energy = energy_;
        const int count = kPixels / 10;
        std::array<uint16_t, kPixels> ranks{};
        for (int rank = count; rank-- > 0;) {  // the starting pixels, tightest cluster last
            const int pixel = extreme(true);
            ranks[size_t(pixel)] = uint16_t(rank);
            toggle(pixel);
        }
        set_ = start;
        energy_ = energy;
        for (int rank = count; rank < kPixels; ++rank) {  // the rest, largest void first
            const int pixel = extreme(false);
            ranks[size_t(pixel)] = uint16_t(rank);
            toggle(pixel);
        }
        return ranks;
    }

  private:
    static constexpr int kSize = kBlueSize;
    static constexpr int kPixels = kSize * kSize;

    // A tenth of the pixels at random, then clusters moved into voids until none moves.
    void scatter() {
        for (int placed = 0, i = 1; placed < kPixels / 10; ++i) {
            const int pixel = int(mix_bits(uint32_t(i)) % kPixels);
            if (set_[size_t(pixel)]) continue;
            toggle(pixel);
            ++placed;
        }
        for (;;) {
            const int cluster = extreme(true);
            toggle(cluster);
            const int hole = extreme(false);
            toggle(hole);
            if (hole == cluster) return;
        }
    }

    void toggle(int pixel) {
        const int sign = set_[size_t(pixel)] ? -1 : 1;
        set_[size_t(pixel)] = !set_[size_t(pixel)];
        const int px = pixel % kSize, py = pixel / kSize;
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x)
                energy_[size_t(y * kSize + x)] += sign * kernel(x - px) * kernel(y - py);
    }

    // 1-D Gaussian in units of 2^-16; the 2-D one is its product.
    static int64_t kernel(int distance) {
        static const std::array<int64_t, kSize> table = [] {
            std::array<int64_t, kSize> values{};
            for (int i = 0; i < kSize; ++i) {
                const double d = std::min(i, kSize - i);
                values[size_t(i)] = std::llround(65536 * std::exp(-d * d / (2 * 1.5 * 1.5)));
            }
            return values;
        }();
        return table[size_t((distance + kSize) % kSize)];
    }

    // The set pixel with the highest energy, or the free pixel with the lowest; on a tie the first
    // in row order.
    int extreme(bool among_set) const {
        int best = -1;
        for (int i = 0; i < kPixels; ++i) {
            if (set_[size_t(i)] != among_set) continue;
            const int64_t e = energy_[size_t(i)];
            if (best < 0 || (among_set ? e > energy_[size_t(best)] : e < energy_[size_t(best)]))
                best = i;
        }
        return best;
    }

    std::vector<bool> set_ = std::vector<bool>(kPixels, false);
    std::vector<int64_t> energy_ = std::vector<int64_t>(kPixels, 0);
};

// x in the even bits, y in the odd ones.
uint32_t morton(uint32_t x, uint32_t y) {
    uint32_t index = 0;
    for (uint32_t bit = 0; bit < 7; ++bit)
        index |= ((x >> bit) & 1u) << (2 * bit) | ((y >> bit) & 1u) << (2 * bit + 1);
    return index;
}

// Digits of `index` mirrored at the point: 6 = 110 in base 2 -> 0.011 = 0.375.
double radical_inverse(uint32_t index, uint32_t base) {
    double value = 0, place = 1.0 / base;
    for (; index > 0; index /= base, place /= base) value += place * (index % base);
    return value;
}

double gradient_noise(uint32_t x, uint32_t y) {
    const uint32_t inner = 288237660u * x + 25070368u * y;  // fract, in units of 2^-32
    const uint32_t outer = 52u * inner + uint32_t((uint64_t(inner) * 4221604530u) >> 32);
    return (outer >> 8) * 0x1p-24;  // 24 bits: exact as a float too
}

shared::NoiseUniforms uniforms_of(const Parameters& parameters, int frame_number) {
    shared::NoiseUniforms uniforms{};
    const auto shift = shift_of(parameters, frame_number);
    uniforms.shift = {shift[0], shift[1]};
    if (parameters.noise == Kind::blue) {
        const auto& ranks = blue_ranks();
        for (int i = 0; i < int(ranks.size()) / 2; ++i) {
            const uint32_t pair = ranks[size_t(2 * i)] | uint32_t(ranks[size_t(2 * i + 1)]) << 16;
            uniforms.ranks[i / 4][i % 4] = int(pair);
        }
    }
    return uniforms;
}

}  // namespace

const ParameterTable& parameter_table() {
    const ReadIf any = {{{"noise", {"none"}, true}}};
    static const ParameterTable table =
        ParameterTableBuilder<Parameters>()
            .choice("noise", &Parameters::noise, {"halton", "ign", "blue", "none"},
                    {.help = "random numbers: Halton over Morton order, "
                             "interleaved gradient noise, blue noise, or none"})
            .integer("seed", &Parameters::seed,
                     {.min = 0,
                      .max = double(std::numeric_limits<int>::max()),
                      .soft_max = 1000,
                      .help = "shifts the noise pattern",
                      .read_if = any,
                      .convergence = Convergence::averaged})
            .boolean("animate_noise", &Parameters::animate_noise,
                     {.help = "shift the noise pattern with the frame number too", .read_if = any})
            .table();
    return table;
}

std::array<int, 2> shift_of(const Parameters& parameters, int frame_number) {
    uint32_t key = uint32_t(parameters.seed);
    if (parameters.animate_noise) key += uint32_t(frame_number) * 0x9e3779b9u;
    const uint32_t bits = mix_bits(key);
    return {int(bits % kSize), int((bits >> 16) % kSize)};
}

const std::array<uint16_t, kBlueSize * kBlueSize>& blue_ranks() {
    static const auto ranks = VoidAndCluster().ranks();
    return ranks;
}

ImageD table(const Parameters& parameters, int frame_number) {
    if (parameters.noise == Kind::none) return {};
    const auto shift = shift_of(parameters, frame_number);
    ImageD table(kSize, kSize, 2);
    for (int py = 0; py < kSize; ++py) {
        for (int px = 0; px < kSize; ++px) {
            const auto x = uint32_t(px + shift[0]) % kSize;
            const auto y = uint32_t(py + shift[1]) % kSize;
            double tile = 0, tap = 0;
            if (parameters.noise == Kind::halton) {
                const uint32_t index = morton(x, y);
                tile = radical_inverse(index, 2);
                tap = radical_inverse(index, 3);
            } else if (parameters.noise == Kind::ign) {
                tile = gradient_noise(x, y);
                tap = gradient_noise(y + 37, x + 11);
            } else {
                const auto& ranks = blue_ranks();
                tile = (ranks[y % 64 * 64 + x % 64] + 0.5) / 4096;
                tap = (ranks[(y + 41) % 64 * 64 + (x + 29) % 64] + 0.5) / 4096;
            }
            table.at(px, py, 0) = tile;
            table.at(px, py, 1) = 2 * tap - 1;
        }
    }
    return table;
}

TextureId add_table(PassPlanner& planner, const Parameters& parameters) {
    if (parameters.noise == Kind::none) return -1;
    const TextureId noise = planner.texture("noise", Format::rg32f, Area::fixed(kSize, kSize));
    Step step;
    step.name = "noise";
    step.program = {"common/noise.comp", {{"NOISE", std::to_string(int(parameters.noise))}}};
    step.take_uniforms<shared::NoiseUniforms>();
    step.bindings = {{0, noise, Access::write}};
    step.spread = groups_for(Area::fixed(kSize, kSize));
    planner.step(std::move(step));
    return noise;
}

void write_uniforms(const Parameters& parameters, int frame_number, UniformWriter& uniforms) {
    if (parameters.noise == Kind::none) return;
    uniforms.set(uniforms_of(parameters, frame_number));
}

}  // namespace postchain::noise

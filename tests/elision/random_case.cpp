#include "tests/elision/random_case.h"

#include <algorithm>
#include <cmath>

#include "chain/frame/layers.h"

#include "tests/elision/support.h"

namespace postchain::test {
namespace {

double number_of(const Parameter& row, Random& random) {
    const double low = std::max(row.soft_min, -100.0), high = std::min(row.soft_max, 1e4);
    if (random.chance(0.1)) return row.min_excluded && low == row.min ? low + 1e-6 : low;
    if (random.chance(0.1)) return high;
    if (low >= 0 && random.chance(0.5)) return random.logarithmic(std::max(low, 1e-3), high);
    return random.real(low, high);
}

// The second of two rows that exclude each other stays unset.
bool is_excluded(const ParameterTable& table, const Parameter& row) {
    return !row.excludes.empty() && table.find(row.excludes) < &row;
}

// Values that programs are compiled for come from the shape: rows with few values, and the least
// value of a number if useful values begin above it. Numbers come from the case.
ParameterValue value_of(const ParameterTable& table, const Parameter& row, Random& shape,
                        Random& random) {
    if (row.type == ParameterType::boolean) return shape.chance(0.5);
    if (row.type == ParameterType::choice)
        return row.choices[size_t(shape.whole(0, int(row.choices.size()) - 1))];
    if (!row.allowed.empty()) {
        Random& from = row.allowed.size() <= 4 ? shape : random;
        return row.allowed[size_t(from.whole(0, int(row.allowed.size()) - 1))];
    }
    if (!row.optional && !row.min_excluded && row.soft_min > row.min && shape.chance(0.3))
        return row.min;
    if (row.optional && (is_excluded(table, row) || random.chance(0.4))) return std::monostate();
    if (random.chance(0.25)) return row.default_value;
    if (row.type == ParameterType::point)
        return std::array<double, 2>{random.real(row.min, row.max), random.real(row.min, row.max)};
    const double number = number_of(row, random);
    if (row.type == ParameterType::number) return number;
    const auto whole = int64_t(std::lround(number));
    return row.odd ? whole | 1 : whole;
}

// Numbers are drawn again while the pass says that it cannot run with them, most of the time.
void append_random(Chain& chain, const PassType& type, const FrameDescription& frame, Random& shape,
                   Random& random) {
    Pass* pass = chain.append(every_pass(), type.name);
    const uint64_t shape_seed = shape.next();
    for (int draws = random.chance(0.05) ? 1 : 40; draws > 0; --draws) {
        Random same_shape(shape_seed);
        for (const Parameter& row : type.parameters->rows()) {
            const ParameterValue value = value_of(*type.parameters, row, same_shape, random);
            const Status status = type.parameters->set(pass->parameters(), row.key, value);
            EXPECT_TRUE(status.ok()) << status.message();
        }
        if (pass->resolve(frame).ok()) return;
    }
}

ImageF random_color(int width, int height, Random& random) {
    const bool half = random.chance(0.6);
    const double bright = random.chance(0.3) ? random.logarithmic(1e-3, 3e4) : 1;
    const double contrast = random.chance(0.3) ? random.logarithmic(1e-3, 0.3) : 1;
    const double base = random.chance(0.3) ? random.real(-0.2, 1) : 0;
    const bool constant = random.chance(0.08);
    const auto seed = uint32_t(random.next());
    ImageF color = random.chance(0.5) ? noise_image(width, height, 4, seed)
                                      : textured_image(width, height, 4, seed % 1000);
    for (float& value : color.data)
        value = float(bright * (base + contrast * (constant ? 0.375 : double(value))));
    const int regions = random.whole(0, 2);
    for (int k = 0; k < regions; ++k) {  // of one color, now and then of -0
        const float value = random.chance(0.2) ? -0.0f : float(random.real(0, 2));
        const int x0 = random.whole(0, width - 1), y0 = random.whole(0, height - 1);
        for (int y = y0; y < std::min(height, y0 + 40); ++y)
            for (int x = x0; x < std::min(width, x0 + 40); ++x)
                for (int c = 0; c < 4; ++c) color.at(x, y, c) = value;
    }
    if (half)  // 11 bits, at least 2^-14
        for (float& value : color.data) {
            int exponent;
            const float mantissa = std::frexp(value, &exponent);
            value =
                exponent < -12 ? 0 : std::ldexp(std::nearbyint(mantissa * 1024) / 1024, exponent);
        }
    return color;
}

std::array<float, 2> random_motion(Random& random) {
    if (random.chance(0.3)) return {0, 0};
    const double length = random.chance(0.2) ? random.real(0.2, 2.5) : random.logarithmic(0.5, 150);
    const double angle = random.real(0, 6.2831853);
    if (random.chance(0.2)) return {float(length), 0};
    return {float(length * std::cos(angle)), float(length * std::sin(angle))};
}

float random_depth(Random& random) {
    if (random.chance(0.3)) return 0;
    if (random.chance(0.3)) return 0.1f;
    return float(random.logarithmic(0.005, 3));
}

// Layers: a ground, and up to four rectangles of any size before it.
void add_layers(FramePlanes& planes, int width, int height, Random& random) {
    ImageF& depth = planes[Role::inverse_depth] = ImageF(width, height, 1);
    ImageF& motion = planes[Role::motion] = ImageF(width, height, 2);
    const int layers = random.whole(0, 4);
    const bool ramp = random.chance(0.3), turns = random.chance(0.15);
    for (int k = 0; k <= layers; ++k) {
        const std::array<float, 2> v = random_motion(random);
        const float w = random_depth(random);
        const int x0 = k ? random.whole(0, width - 1) : 0, y0 = k ? random.whole(0, height - 1) : 0;
        const int x1 = k ? random.whole(x0, random.chance(0.3) ? x0 : width - 1) : width - 1;
        const int y1 = k ? random.whole(y0, random.chance(0.3) ? y0 : height - 1) : height - 1;
        for (int y = y0; y <= std::min(y1, height - 1); ++y)
            for (int x = x0; x <= std::min(x1, width - 1); ++x) {
                depth.at(x, y) = !k && ramp ? w * float(y + 1) / float(height) : w;
                motion.at(x, y, 0) = !k && turns ? 0.1f * float(y - height / 2) : v[0];
                motion.at(x, y, 1) = !k && turns ? -0.1f * float(x - width / 2) : v[1];
            }
    }
}

std::string text_of(const PlanOptions& options, const Chain& chain) {
    std::string text = name_of(options.precision);
    text += ", rules:";
    for (const auto& rule : options.rules(chain)) text += " " + rule;
    return text + ", outputs: " + options.outputs.text();
}

}  // namespace

RandomCase random_case(uint64_t seed) {
    RandomCase result;
    Random shape(seed / kCasesOfAShape * 7919 + 1), random(seed * 104729 + 2);
    // Mostly sizes of which neither the pixels nor the blocks are a power of two: Mesa compiles a
    // program once more for each texture that is.
    const auto size = [&] {
        if (random.chance(0.1)) return random.whole(1, 20);
        if (random.chance(0.1)) return random.whole(1, 130);
        return random.chance(0.5) ? random.whole(33, 48) : random.whole(65, 112);
    };
    const int width = size(), height = size();
    result.planes[Role::color] = random_color(width, height, random);
    add_layers(result.planes, width, height, random);
    if (random.chance(0.1)) {  // in the right half
        ImageF& hint = result.planes[Role::hint] =
            noise_image(width, height, 2, uint32_t(seed), 0, 1.2f);
        for (int y = 0; y < height; ++y)
            std::fill(hint.pixel(0, y), hint.pixel(width / 2, y), 0.0f);
    }
    // From random numbers of their own: cases without them stay as they were.
    Random held_shape(seed / kCasesOfAShape * 15485863 + 5), held(seed * 15485863 + 3);
    const int most_layers = held_shape.whole(1, 6);
    const bool has_layers = seed / kCasesOfAShape % 3 == 1;
    const int layers = has_layers && held.chance(0.7) ? most_layers : 0;
    if (layers > 0) {
        std::vector<ImageF> stack;
        for (int i = 0; i < layers; ++i) stack.push_back(random_color(width, height, held));
        result.planes[Role::layers] = stack_planes(stack);
    }
    result.frame = describe(result.planes);
    result.frame.frame_number = random.whole(0, 500);
    result.frame.display_width = width + random.whole(0, 300);
    result.frame.camera.f_stop = random.logarithmic(0.1, 16);
    const bool unknown = random.chance(0.25);
    if (unknown) result.frame.bounds = FrameBounds();
    // One shape after the other begins with each type of pass, so that none is missing.
    const auto& types = every_pass().types();
    auto type = size_t(seed / kCasesOfAShape);
    for (int passes = shape.whole(1, 4); passes > 0; --passes) {
        append_random(result.chain, types[type % types.size()], result.frame, shape, random);
        type = size_t(shape.whole(0, int(types.size()) - 1));
    }
    if (held.chance(0.15)) {
        result.planes[Role::mattes] = noise_image(width, height, 1, uint32_t(seed), -1.5f, 2.5f);
        result.frame.planes.add(Role::mattes);
        for (size_t i = 0; i < result.chain.links.size(); ++i)
            result.frame.mattes.push_back(held.chance(0.6) ? 0 : -1);
        result.frame.mattes[0] = 0;
    }
    result.elided.precision = shape.chance(0.5) ? Precision::fp16 : Precision::fp32;
    if (random.chance(0.15)) result.elided.outputs.add(Role::hint);
    if (random.chance(0.05)) result.elided.outputs = {Role::hint};
    if (random.chance(0.25))
        for (const auto& rule : elision_rules(every_pass()))
            if (random.chance(0.5)) result.elided.rules_off.insert(rule.name);
    result.text = concat(width, "x", height, unknown ? ", no facts" : "",
                         result.planes.count(Role::hint) ? ", with a hint" : "",
                         layers > 0 ? concat(", ", layers, " layers") : std::string(),
                         result.planes.count(Role::mattes) ? ", a matte" : "", ", ",
                         text_of(result.elided, result.chain), "\n", result.chain.text());
    return result;
}

}  // namespace postchain::test

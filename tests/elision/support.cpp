#include "tests/elision/support.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace postchain::test {
namespace {

// A frame in which everything moves and is out of focus.
FramePlanes other_frame(const FramePlanes& planes) {
    FramePlanes other = planes;
    for (auto& [role, plane] : other)
        for (size_t i = 0; i < plane.data.size(); ++i)
            plane.data[i] = role == Role::color           ? 777.0f
                            : role == Role::inverse_depth ? 0.77f
                            : role == Role::hint          ? 1.0f
                                                          : (i % 2 ? -29.0f : 31.0f);
    return other;
}

}  // namespace

PlanOptions no_rule(Precision precision) {
    PlanOptions options;
    options.elide = false;
    options.precision = precision;
    return options;
}

PlanOptions only(std::initializer_list<std::string> rules, Precision precision) {
    PlanOptions options;
    options.precision = precision;
    const std::set<std::string> wanted = rules;
    std::set<std::string> known;
    for (const auto& rule : elision_rules(every_pass())) {
        known.insert(rule.name);
        (wanted.count(rule.name) == 0 ? options.rules_off : options.rules_on).insert(rule.name);
    }
    for (const auto& name : wanted) EXPECT_TRUE(known.count(name)) << name;
    return options;
}

ImageF half_noise(int width, int height, int channels, uint32_t seed, float low) {
    ImageF image = noise_image(width, height, channels, seed, 0, 2);
    for (float& value : image.data) value = low + std::floor(value * 512) / 512;
    return image;
}

unsigned Lean::blocks(const std::string& name) const {
    for (const auto& one : work)
        if (one.list.ends_with("." + name)) return one.blocks;
    ADD_FAILURE() << "the plan has no list " << name;
    return 0;
}

bool Lean::used(const std::string& rule) const {
    for (const auto& left : plan.elisions)
        if (left.rule == rule) return true;
    return false;
}

std::string first_difference(const ImageF& full, const ImageF& lean) {
    if (equal_bits(full, lean)) return "";
    if (full.data.size() != lean.data.size()) return "the sizes differ";
    size_t differ = 0, first = full.data.size();
    for (size_t i = full.data.size(); i-- > 0;) {
        if (std::bit_cast<uint32_t>(full.data[i]) == std::bit_cast<uint32_t>(lean.data[i]))
            continue;
        ++differ;
        first = i;
    }
    const size_t pixel = first / size_t(full.channels);
    return concat(differ, " of ", full.data.size(), " values differ, first at ",
                  pixel % size_t(full.width), ",", pixel / size_t(full.width), " channel ",
                  first % size_t(full.channels), " of ", full.width, "x", full.height, ": ",
                  full.data[first], " in full, ", lean.data[first], " lean");
}

Lean expect_same_bits(const Chain& chain, const FrameDescription& frame, const FramePlanes& planes,
                      const PlanOptions& options) {
    PlanOptions full = no_rule(options.precision);
    full.outputs = options.outputs;
    const FramePlanes whole = filter(chain, frame, planes, full);
    filter(chain, frame, other_frame(planes), full);
    Lean lean;
    lean.outputs = filter(chain, frame, planes, options, &lean.plan);
    lean.work = executor().work_done();
    EXPECT_EQ(whole.size(), lean.outputs.size());
    for (const auto& [role, plane] : lean.outputs) {
        if (whole.count(role))
            EXPECT_EQ(first_difference(whole.at(role), plane), "") << name_of(role);
        else
            ADD_FAILURE() << name_of(role) << " comes of the lean run alone";
    }
    return lean;
}

float neighbor(float value, int steps) {
    for (; steps > 0; --steps) value = std::nextafter(value, INFINITY);
    for (; steps < 0; ++steps) value = std::nextafter(value, -INFINITY);
    return value;
}

}  // namespace postchain::test

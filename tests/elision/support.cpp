#include "tests/elision/support.h"

#include <bit>
#include <cmath>

namespace postchain::test {

FramePlanes flat_planes(const ImageF& color, std::array<float, 2> motion, float w) {
    FramePlanes planes;
    planes[Role::color] = color;
    planes[Role::inverse_depth] = constant_image(color.width, color.height, {w});
    planes[Role::motion] = constant_image(color.width, color.height, {motion[0], motion[1]});
    return planes;
}

FramePlanes other_frame(const FramePlanes& planes) {
    FramePlanes other = planes;
    for (auto& [role, plane] : other)
        for (size_t i = 0; i < plane.data.size(); ++i)
            plane.data[i] = role == Role::color || role == Role::layers ? 777.0f
                            : role == Role::inverse_depth               ? 0.77f
                            : role == Role::hint                        ? 1.0f
                                                                        : (i % 2 ? -29.0f : 31.0f);
    return other;
}

PlanOptions no_rule(Precision precision) {
    return {.precision = precision, .elide = false};
}

PlanOptions only(std::initializer_list<std::string> rules, Precision precision) {
    PlanOptions options{.precision = precision};
    const std::set<std::string> wanted = rules;
    std::set<std::string> known;
    for (const auto& rule : elision_rules(every_pass())) {
        known.insert(rule.name);
        (wanted.count(rule.name) == 0 ? options.rules_off : options.rules_on).insert(rule.name);
    }
    for (const auto& name : wanted) EXPECT_TRUE(known.count(name)) << name;
    return options;
}

ImageF half_noise(int width, int height, int channels, uint32_t seed) {
    ImageF image = noise_image(width, height, channels, seed, 0, 2);
    for (float& value : image.data) value = std::floor(value * 512) / 512;
    return image;
}

unsigned Elided::blocks(const std::string& name) const {
    for (const auto& one : work)
        if (one.list.ends_with("." + name)) return one.blocks;
    ADD_FAILURE() << "the plan has no list " << name;
    return 0;
}

bool Elided::used(const std::string& rule) const {
    for (const auto& left : plan.elisions)
        if (left.rule == rule) return true;
    return false;
}

std::string first_difference(const ImageF& complete, const ImageF& elided) {
    if (equal_bits(complete, elided)) return "";
    if (complete.data.size() != elided.data.size()) return "the sizes differ";
    size_t i = 0;
    while (std::bit_cast<uint32_t>(complete.data[i]) == std::bit_cast<uint32_t>(elided.data[i]))
        ++i;
    const size_t pixel = i / size_t(complete.channels);
    return concat("differ at ", pixel % size_t(complete.width), ",", pixel / size_t(complete.width),
                  " channel ", i % size_t(complete.channels), " of ", complete.width, "x",
                  complete.height, ": ", complete.data[i], " in complete, ", elided.data[i],
                  " elided");
}

Elided expect_same_bits(const Chain& chain, const FrameDescription& frame,
                        const FramePlanes& planes, const PlanOptions& options) {
    PlanOptions complete = no_rule(options.precision);
    complete.outputs = options.outputs;
    const FramePlanes whole = filter(chain, frame, planes, complete);
    filter(chain, frame, other_frame(planes), complete);
    Elided elided;
    elided.outputs = filter(chain, frame, planes, options, &elided.plan);
    elided.work = executor().work_done();
    EXPECT_EQ(whole.size(), elided.outputs.size());
    for (const auto& [role, plane] : elided.outputs) {
        if (whole.count(role))
            EXPECT_EQ(first_difference(whole.at(role), plane), "") << name_of(role);
        else
            ADD_FAILURE() << name_of(role) << " comes from the elided run alone";
    }
    return elided;
}

float neighbor(float value, int steps) {
    for (; steps > 0; --steps) value = std::nextafter(value, INFINITY);
    for (; steps < 0; ++steps) value = std::nextafter(value, -INFINITY);
    return value;
}

}  // namespace postchain::test

// Support of every test of the conformance suite: the pass under test, frames, values of
// parameters. A fixture that derives from Conformance runs for each pass and names none. Properties
// of only some passes are tested by their guarantees (chain/pass/guarantees.h).
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain {

// The name of a parameter in googletest's output.
inline void PrintTo(const PassType& type, std::ostream* out) {
    *out << type.name;
}

class Conformance : public ::testing::TestWithParam<PassType> {
  protected:
    // Each program is compiled again if a side is a power of two, as 1 is.
    static constexpr std::array<std::array<int, 2>, 4> kSizes = {
        {{1, 1}, {13, 1}, {37, 33}, {41, 83}}};

    Chain chain() const { return test::chain_of(GetParam().name); }

    // With few samples and short blurs: a pixel then depends on few others.
    Chain short_chain() const {
        Chain one = chain();
        const std::pair<const char*, ParameterValue> values[] = {
            {"samples", int64_t(9)}, {"max_blur_px", int64_t(8)}, {"max_radius_px", 6.0}};
        for (const auto& [key, value] : values)
            if (const Parameter* row = GetParam().parameters->find(key))
                row->set(one.links[0].pass->parameters(), value);
        return one;
    }

    // Two layers that both move, in places transparent; the near one is far out of focus.
    static test::TestFrame moving_frame(int width, int height) {
        test::TestFrame frame =
            test::layered_frame(width, height, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
        ImageF& color = frame.planes[Role::color];
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                if ((x + 2 * y) % 17 < 5)
                    for (int c = 0; c < 4; ++c) color.at(x, y, c) *= 0.25f;
        frame.description = test::describe(frame.planes);
        frame.description.camera.f_stop = 0.2;  // blurs the square also in so small an image
        return frame;
    }

    static PlanOptions everything() { return test::on_device({.elide = false}); }

    // Values at the ends of a row's domain, and every one of a choice.
    static std::vector<ParameterValue> ends_of(const Parameter& row) {
        std::vector<ParameterValue> values = {row.default_value};
        if (row.type == ParameterType::boolean) return {true, false};
        if (row.type == ParameterType::choice) {
            values.clear();
            for (const auto& word : row.choices) values.push_back(word);
            return values;
        }
        if (row.type == ParameterType::point) return values;
        if (!row.allowed.empty()) return {row.allowed.front(), row.allowed.back()};
        const double low = std::isfinite(row.min) ? row.min : -1e6;
        const double high = std::isfinite(row.max) ? row.max : 1e6;
        if (row.type == ParameterType::integer) {
            // Thousands of taps or pixels prove no more than dozens and take minutes.
            values.push_back(int64_t(low));
            values.push_back(int64_t(std::min(high, row.odd ? 63.0 : 64.0)));
        } else {
            values.push_back(row.min_excluded ? low + 1e-6 : low);
            values.push_back(high);
        }
        return values;
    }

    static bool all_finite(const ImageF& image) {
        for (float value : image.data)
            if (!std::isfinite(value)) return false;
        return true;
    }
};

}  // namespace postchain

#define FOR_EVERY_PASS(fixture)                                                               \
    INSTANTIATE_TEST_SUITE_P(Every, fixture, ::testing::ValuesIn(test::every_pass().types()), \
                             [](const auto& one) { return one.param.name; })

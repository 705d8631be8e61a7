// What every pass must do, whatever it is. Runs for each pass of the registry and names none.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain {

// What googletest prints of a parameter.
void PrintTo(const PassType& type, std::ostream* out) {
    *out << type.name;
}

namespace {

using test::TestFrame;

constexpr std::array<std::array<int, 2>, 6> kSizes = {
    {{1, 1}, {1, 9}, {13, 1}, {37, 23}, {64, 40}, {41, 81}}};

class Conformance : public ::testing::TestWithParam<PassType> {
  protected:
    Chain chain() const { return test::chain_of(GetParam().name); }
};

TestFrame moving_frame(int width, int height) {
    TestFrame frame = test::layered_frame(width, height, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
    frame.description.camera.f_stop = 0.2;  // blurs the square also in so small a picture
    return frame;
}

PlanOptions everything() {
    PlanOptions options;
    options.elide = false;
    return options;
}

// Values at the ends of a row's domain, and every one of a choice.
std::vector<ParameterValue> ends_of(const Parameter& row) {
    std::vector<ParameterValue> values = {row.default_value};
    if (row.type == ParameterType::boolean) return {true, false};
    if (row.type == ParameterType::choice) {
        values.clear();
        for (const auto& word : row.choices) values.push_back(word);
        return values;
    }
    if (!row.allowed.empty()) return {row.allowed.front(), row.allowed.back()};
    const double low = std::isfinite(row.min) ? row.min : -1e6;
    const double high = std::isfinite(row.max) ? row.max : 1e6;
    if (row.type == ParameterType::integer) {
        // Thousands of taps or pixels prove no more than hundreds and take minutes.
        values.push_back(int64_t(low));
        values.push_back(int64_t(std::min(high, row.odd ? 255.0 : 256.0)));
    } else {
        values.push_back(row.min_excluded ? low + 1e-6 : low);
        values.push_back(high);
    }
    return values;
}

bool all_finite(const ImageF& image) {
    for (float value : image.data)
        if (!std::isfinite(value)) return false;
    return true;
}

TEST_P(Conformance, ConstantColorComesBackBitForBitAtEverySize) {
    for (const auto& [width, height] : kSizes) {
        TestFrame frame = moving_frame(width, height);
        frame.planes[Role::color] = test::constant_image(width, height, {0.3f, 7.1f, 1e-3f, 1.0f});
        const auto out = test::filter(chain(), frame.description, frame.planes, everything());
        EXPECT_TRUE(test::equal_bits(out.at(Role::color), frame.planes[Role::color]))
            << width << "x" << height;
    }
}

TEST_P(Conformance, StaysInsideTheRangeOfItsInput) {
    for (const auto& [width, height] : kSizes) {
        TestFrame frame = moving_frame(width, height);
        ImageF& color = frame.planes[Role::color];
        color = test::noise_image(width, height, 4, 3, -2.0f, 50.0f);
        const auto [low, high] = std::minmax_element(color.data.begin(), color.data.end());
        const auto out = test::filter(chain(), frame.description, frame.planes, everything());
        for (float value : out.at(Role::color).data) {
            // fp32 rounding of a convex combination: a few units in the last place of 50.
            ASSERT_GE(value, *low - 2e-5f) << width << "x" << height;
            ASSERT_LE(value, *high + 2e-5f) << width << "x" << height;
        }
    }
}

TEST_P(Conformance, AgreesWithItsReferenceAtEverySize) {
    for (const auto& [width, height] : kSizes) {
        const TestFrame frame = moving_frame(width, height);
        const auto out = test::filter(chain(), frame.description, frame.planes, everything());
        const auto expected =
            test::reference(chain(), frame.description, frame.planes, everything());
        const auto difference =
            test::compare(out.at(Role::color), expected.planes.at(Role::color), 1e-3);
        // A tap or a step that rounds the other way moves single pixels.
        EXPECT_LE(difference.fraction, 0.01) << width << "x" << height << ": " << difference.text;
    }
}

TEST_P(Conformance, EveryParameterAtItsEndsGivesFiniteConstantsOrAClearError) {
    const TestFrame frame = moving_frame(37, 23);
    FramePlanes constant = frame.planes;
    constant[Role::color] = test::constant_image(37, 23, {0.3f, 7.1f, 1e-3f, 1.0f});
    for (const auto& row : GetParam().parameters->rows()) {
        for (const auto& value : ends_of(row)) {
            const std::string what = row.key + "=" + text_of(value);
            Chain one = chain();
            ASSERT_TRUE(
                GetParam().parameters->set(one.links[0].pass->parameters(), row.key, value).ok())
                << what;
            const auto plan = make_plan(one, frame.description, everything());
            if (!plan.ok()) {
                EXPECT_EQ(plan.status().code(), StatusCode::chain) << what;
                EXPECT_FALSE(plan.status().message().empty()) << what;
                continue;
            }
            auto out = test::executor().filter(*plan, frame.planes);
            ASSERT_TRUE(out.ok()) << what << ": " << out.status().message();
            EXPECT_TRUE(all_finite(out->at(Role::color))) << what;
            out = test::executor().filter(*plan, constant);
            ASSERT_TRUE(out.ok()) << what;
            EXPECT_TRUE(test::equal_bits(out->at(Role::color), constant.at(Role::color))) << what;
        }
    }
}

TEST_P(Conformance, HalfStorageStaysNearItsReference) {
    const TestFrame frame = moving_frame(64, 40);
    PlanOptions options = everything();
    options.precision = Precision::fp16;
    const auto out = test::filter(chain(), frame.description, frame.planes, options);
    const auto expected = test::reference(chain(), frame.description, frame.planes, options);
    // 2^-11 per stored plane; a velocity that rounds moves taps, which on noise changes pixels.
    double sum = 0;
    const auto& a = out.at(Role::color);
    const auto& b = expected.planes.at(Role::color);
    for (size_t i = 0; i < a.data.size(); ++i) sum += std::abs(double(a.data[i]) - b.data[i]);
    EXPECT_LT(sum / double(a.data.size()), 5e-3);
}

TEST_P(Conformance, SecondFrameAllocatesAndCompilesNothing) {
    const TestFrame frame = moving_frame(40, 24);
    Executor& executor = test::executor();
    const auto plan = make_plan(chain(), frame.description, everything());
    ASSERT_TRUE(plan.ok());
    ASSERT_TRUE(executor.filter(*plan, frame.planes).ok());
    const auto before = executor.counters();
    ASSERT_TRUE(executor.filter(*plan, frame.planes).ok());
    EXPECT_EQ(executor.counters().texture_allocations, before.texture_allocations);
    EXPECT_EQ(executor.counters().programs, before.programs);
}

TEST_P(Conformance, SameBitsOnEveryRun) {
    const TestFrame frame = moving_frame(64, 40);
    const auto first = test::filter(chain(), frame.description, frame.planes, everything());
    for (int run = 0; run < 3; ++run) {
        const auto again = test::filter(chain(), frame.description, frame.planes, everything());
        ASSERT_TRUE(test::equal_bits(again.at(Role::color), first.at(Role::color)));
    }
}

TEST_P(Conformance, PassThatIsLeftOutChangesNoBit) {
    // Still and in focus everywhere: whoever says it is the identity must be.
    TestFrame frame = test::layered_frame(64, 40, {0, 0}, {0, 0}, 9);
    frame.planes[Role::inverse_depth] = ImageF(64, 40, 1, 0.1f);
    frame.description = test::describe(frame.planes);
    Plan plan;
    const auto lean = test::filter(chain(), frame.description, frame.planes, {}, &plan);
    const auto full = test::filter(chain(), frame.description, frame.planes, everything());
    EXPECT_TRUE(test::equal_bits(lean.at(Role::color), full.at(Role::color)) ||
                !plan.passes[0].left_out);
    if (plan.passes[0].left_out) {
        EXPECT_TRUE(plan.steps.empty());
        EXPECT_EQ(plan.transient_bytes(), 0u);
        EXPECT_FALSE(plan.left_out[0].reason.empty());
    }
}

TEST_P(Conformance, DescribesItself) {
    const PassType& type = GetParam();
    EXPECT_FALSE(type.title.empty());
    EXPECT_FALSE(type.help.empty());
    for (const auto& row : type.parameters->rows()) {
        EXPECT_FALSE(row.help.empty()) << row.key;
        EXPECT_TRUE(row.check(row.default_value).ok()) << row.key << ": default is out of domain";
        EXPECT_EQ(row.optional, !row.unset_means.empty())
            << row.key << ": says what unset means exactly when it can be unset";
        if (row.type == ParameterType::number || row.type == ParameterType::integer) {
            EXPECT_TRUE(std::isfinite(row.min) || !row.allowed.empty()) << row.key;
        }
    }
}

TEST_P(Conformance, StagesOfTheReferenceAreTexturesOfThePlan) {
    const TestFrame frame = moving_frame(64, 40);
    const auto gpu =
        test::filter_with_stages(chain(), frame.description, frame.planes, everything());
    const auto expected = test::reference(chain(), frame.description, frame.planes, everything());
    EXPECT_FALSE(expected.stages.empty());
    for (const auto& [name, stage] : expected.stages) {
        const auto found = gpu.stages.find(name);
        if (found == gpu.stages.end()) {
            ADD_FAILURE() << name << " is no texture of the plan";
            continue;
        }
        EXPECT_EQ(found->second.width, stage.width) << name;
        EXPECT_EQ(found->second.height, stage.height) << name;
    }
}

INSTANTIATE_TEST_SUITE_P(Every, Conformance, ::testing::ValuesIn(builtin_passes().types()),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace postchain

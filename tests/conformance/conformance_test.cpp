// Requirements of every pass.
#include "tests/conformance/conformance.h"

namespace postchain {
namespace {

using test::TestFrame;

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

TEST_P(Conformance, EveryParameterAtItsEndsGivesFiniteColorsOrAClearError) {
    const TestFrame frame = moving_frame(37, 33);
    FramePlanes constant = frame.planes;
    constant[Role::color] = test::constant_image(37, 33, {0.3f, 7.1f, 1e-3f, 1.0f});
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
            if (!one.guarantees().keeps_constants) continue;
            out = test::executor().filter(*plan, constant);
            ASSERT_TRUE(out.ok()) << what;
            EXPECT_TRUE(test::equal_bits(out->at(Role::color), constant.at(Role::color))) << what;
        }
    }
}

TEST_P(Conformance, EveryParameterAtItsEndsAgreesWithItsReference) {
    const TestFrame alone = moving_frame(37, 33);
    TestFrame neighbored = alone;
    test::add_neighbors(neighbored);
    int compared = 0;
    for (const auto& row : GetParam().parameters->rows()) {
        for (const auto& value : ends_of(row)) {
            Chain one = chain();
            ASSERT_TRUE(
                GetParam().parameters->set(one.links[0].pass->parameters(), row.key, value).ok());
            const RoleSet usable = one.required() | one.optional();
            const bool reads_neighbors =
                !usable.of(Neighbor::before).empty() || !usable.of(Neighbor::after).empty();
            for (const bool with_neighbors : {false, true}) {
                if (with_neighbors && !reads_neighbors) continue;
                const TestFrame& frame = with_neighbors ? neighbored : alone;
                if (!make_plan(one, frame.description, everything()).ok()) continue;
                const auto out = test::filter(one, frame.description, frame.planes, everything());
                const auto expected =
                    test::reference(one, frame.description, frame.planes, everything());
                // A lens of 1e8 px multiplies the rounding of 1/focus - 1/depth by that.
                const auto difference =
                    test::compare(out.at(Role::color), expected.planes.at(Role::color), 2e-3);
                // A tap that rounds the other way: 2 % are 24 pixels.
                EXPECT_LE(difference.fraction, 0.02)
                    << row.key << "=" << text_of(value) << (with_neighbors ? " with neighbors" : "")
                    << ": " << difference.text;
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, int(GetParam().parameters->rows().size()));
}

// Whenever a pass says that it returns its color bit for bit, whatever its parameters.
TEST_P(Conformance, EveryParameterAtItsEndsIsTheIdentityWhereItSaysSo) {
    TestFrame still = test::layered_frame(37, 33, {0, 0}, {0, 0}, 9);
    for (const TestFrame& frame : {moving_frame(37, 33), still, moving_frame(1, 1)}) {
        for (const auto& row : GetParam().parameters->rows()) {
            for (const auto& value : ends_of(row)) {
                const std::string what = row.key + "=" + text_of(value);
                Chain one = chain();
                ASSERT_TRUE(GetParam()
                                .parameters->set(one.links[0].pass->parameters(), row.key, value)
                                .ok());
                const auto elided = make_plan(one, frame.description);
                if (!elided.ok() || !elided->passes[0].elided) continue;
                EXPECT_TRUE(elided->steps.empty()) << what;
                const auto out = test::filter(one, frame.description, frame.planes, everything());
                EXPECT_TRUE(test::equal_bits(out.at(Role::color), frame.planes.at(Role::color)))
                    << what;
            }
        }
    }
}

TEST_P(Conformance, HalfStorageStaysNearItsReference) {
    const TestFrame frame = moving_frame(67, 41);
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
    const TestFrame frame = moving_frame(37, 33);
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
    const TestFrame frame = moving_frame(67, 41);
    const auto first = test::filter(chain(), frame.description, frame.planes, everything());
    for (int run = 0; run < 3; ++run) {
        const auto again = test::filter(chain(), frame.description, frame.planes, everything());
        ASSERT_TRUE(test::equal_bits(again.at(Role::color), first.at(Role::color)));
    }
}

TEST_P(Conformance, PassThatIsLeftOutChangesNoBit) {
    // Still and in focus everywhere: a pass that says it is the identity must be.
    TestFrame frame = test::layered_frame(67, 41, {0, 0}, {0, 0}, 9);
    frame.planes[Role::inverse_depth] = ImageF(67, 41, 1, 0.1f);
    frame.description = test::describe(frame.planes);
    Plan plan;
    const auto elided = test::filter(chain(), frame.description, frame.planes, {}, &plan);
    const auto full = test::filter(chain(), frame.description, frame.planes, everything());
    EXPECT_TRUE(test::equal_bits(elided.at(Role::color), full.at(Role::color)) ||
                !plan.passes[0].elided);
    if (plan.passes[0].elided) {
        EXPECT_TRUE(plan.steps.empty());
        EXPECT_EQ(plan.transient_bytes(), 0u);
        EXPECT_FALSE(plan.elisions[0].fact.name.empty());
    }
}

// Lights that sum to color, each filtered by the weights of color.
TEST_P(Conformance, FiltersLayersByTheWeightsOfColor) {
    for (const auto& [width, height] : kSizes) {
        TestFrame frame = moving_frame(width, height);
        test::add_neighbors(frame);
        constexpr int kLights = 5;  // more than one step does
        test::add_lights(frame, kLights);
        const auto out = test::filter(chain(), frame.description, frame.planes, everything());
        ASSERT_TRUE(out.count(Role::layers))
            << "docs/adding_a_pass.md says how layers are filtered";
        const auto expected =
            test::reference(chain(), frame.description, frame.planes, everything());
        const auto difference =
            test::compare(out.at(Role::layers), expected.planes.at(Role::layers), 1e-3);
        EXPECT_LE(difference.fraction, 0.01) << width << "x" << height << ": " << difference.text;
        ImageF sum(width, height, 4);
        for (size_t i = 0; i < out.at(Role::layers).data.size(); ++i)
            sum.data[i % sum.data.size()] += out.at(Role::layers).data[i];
        EXPECT_LE(test::compare(sum, out.at(Role::color), 1e-5).fraction, 0)
            << width << "x" << height;
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

TEST_P(Conformance, StagesOfTheReferenceAreTexturesOfThePlanAndAgree) {
    // No block is still: their pixels have no `spread`.
    const TestFrame frame = moving_frame(46, 39);
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
        const auto difference = test::compare(found->second, stage, 1e-3);
        EXPECT_LE(difference.fraction, 0.01) << name << ": " << difference.text;
    }
}

FOR_EVERY_PASS(Conformance);

}  // namespace
}  // namespace postchain

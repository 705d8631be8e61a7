// Requirements of every pass, with its defaults and with each parameter at its ends.
#include "tests/conformance/conformance.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

using test::TestFrame;

ImageF run(const Plan& plan, const FramePlanes& planes) {
    return test::must(test::executor().filter(plan, planes)).at(Role::color);
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

// Finite colors that agree with the reference, or a clear error; constants are kept; and a pass
// that says it is the identity returns its color bit for bit.
TEST_P(Conformance, HoldsForEveryParameterAtItsEnds) {
    TestFrame frame = moving_frame(29, 21);
    test::add_neighbors(frame);
    FramePlanes constant = frame.planes;
    for (const Role role : {Role::color, Role::color_before, Role::color_after})
        constant[role] = test::constant_image(29, 21, {0.3f, 7.1f, 1e-3f, 1.0f});
    const TestFrame still = test::layered_frame(29, 21, {0, 0}, {0, 0}, 9);
    int compared = 0;
    for (const auto& row : GetParam().parameters->rows()) {
        for (const auto& value : ends_of(row)) {
            SCOPED_TRACE(row.key + "=" + text_of(value));
            Chain one = chain();
            ASSERT_TRUE(
                GetParam().parameters->set(one.links[0].pass->parameters(), row.key, value).ok());
            const auto plan = make_plan(one, frame.description, everything());
            if (!plan.ok()) {
                EXPECT_EQ(plan.status().code(), StatusCode::chain);
                EXPECT_FALSE(plan.status().message().empty());
                continue;
            }
            const ImageF out = run(*plan, frame.planes);
            EXPECT_TRUE(all_finite(out));
            // A lens of 1e8 px multiplies the rounding of 1/focus - 1/depth by that.
            const auto difference = test::compare(
                out, test::reference(one, frame.description, frame.planes).planes.at(Role::color),
                2e-3);
            // A tap that rounds the other way: 2 % are 12 pixels.
            EXPECT_LE(difference.fraction, 0.02) << difference.text;
            ++compared;
            if (one.guarantees().keeps_constants) {
                EXPECT_TRUE(test::equal_bits(run(*plan, constant), constant.at(Role::color)));
            }
            for (const TestFrame* given : {&std::as_const(frame), &still}) {
                const auto elided = make_plan(one, given->description);
                if (!elided.ok() || !elided->passes[0].elided) continue;
                EXPECT_TRUE(elided->steps.empty());
                EXPECT_TRUE(test::equal_bits(
                    test::filter(one, given->description, given->planes, everything())
                        .at(Role::color),
                    given->planes.at(Role::color)));
            }
        }
    }
    EXPECT_GT(compared, int(GetParam().parameters->rows().size()));
}

TEST_P(Conformance, HalfStorageStaysNearItsReference) {
    const TestFrame frame = moving_frame(37, 33);
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

TEST_P(Conformance, SameBitsOnEveryRun) {
    const TestFrame frame = moving_frame(67, 41);
    const auto first = test::filter(chain(), frame.description, frame.planes, everything());
    for (int run = 0; run < 3; ++run) {
        const auto again = test::filter(chain(), frame.description, frame.planes, everything());
        ASSERT_TRUE(test::equal_bits(again.at(Role::color), first.at(Role::color)));
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
    for (const PassVariant& variant : type.variants) {
        EXPECT_FALSE(variant.name.empty());
        for (const auto& [key, value] : variant.settings) {
            const Parameter* row = type.parameters->find(key);
            ASSERT_NE(row, nullptr) << key;
            EXPECT_TRUE(row->check(value).ok()) << key;
        }
    }
}

// Textures come from a pool, with whatever they held.
TEST_P(Conformance, NothingOfTheLastFrameIsLeft) {
    // Still but for a corner; blurred and sharp.
    TestFrame frame = test::layered_frame(101, 67, {0, 0}, {0, 0}, 5);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 20; ++x) frame.planes[Role::motion].at(x, y) = 23;
    frame.description = test::describe(frame.planes);
    frame.description.camera.f_stop = 0.2;
    const Plan plan = test::must(make_plan(short_chain(), frame.description, everything()));
    const ImageF before = run(plan, frame.planes);
    for (const float value : {NAN, INFINITY, 1e30f}) {
        FramePlanes bad = frame.planes;
        for (auto& [role, plane] : bad) std::fill(plane.data.begin(), plane.data.end(), value);
        run(plan, bad);
        EXPECT_TRUE(test::equal_bits(run(plan, frame.planes), before)) << value;
        // Again with motion that no pass treats as zero.
        std::fill(bad[Role::motion].data.begin(), bad[Role::motion].data.end(), 50.0f);
        run(plan, bad);
        EXPECT_TRUE(test::equal_bits(run(plan, frame.planes), before)) << value << ", moving";
    }
}

// A plan is data: the format it states is the one that is allocated and bound.
TEST_P(Conformance, EveryTextureIsStoredAsThePlanSays) {
    const TestFrame frame = moving_frame(37, 33);
    const Plan full = test::must(make_plan(chain(), frame.description, everything()));
    const auto is_half = [](float value) {
        // 2^-24 is the least half; above 2^-14 there are 11 significant bits.
        const float step =
            std::exp2(float(std::max(std::ilogb(std::max(std::abs(value), 1e-30f)), -14) - 10));
        // On a GPU a texel that no step writes may be anything, such as an infinite half.
        const bool gpu = test::executor().device_class() == DeviceClass::gpu;
        return (gpu && !std::isfinite(value)) ||
               (std::abs(value) <= 65504 && value / step == std::nearbyint(value / step));
    };
    // The share of a texture's values that are halves. Sampled: most images hold some.
    const auto halves = [&](const Plan& plan, const std::string& name) {
        double share = -1;
        const FramePlanes out = test::must(test::executor().filter(
            plan, frame.planes, [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                if (texture.name != name) return Status();
                const auto count = std::count_if(pixels.data.begin(), pixels.data.end(), is_half);
                share = double(count) / double(pixels.data.size());
                return Status();
            }));
        EXPECT_TRUE(all_finite(out.at(Role::color))) << name;
        return share;
    };
    double least = 1;
    for (size_t i = 0; i < full.textures.size(); ++i) {
        const PlanTexture& texture = full.textures[i];
        const int channels = channels_of(texture.format);
        if (texture.imported || texture.first_step < 0 ||
            texture.format != plane_format(channels, Precision::fp32))
            continue;
        Plan half = full;
        half.textures[i].format = plane_format(channels, Precision::fp16);
        EXPECT_EQ(halves(half, texture.name), 1) << texture.name;
        least = std::min(least, halves(full, texture.name));
    }
    EXPECT_LT(least, 0.5) << "everything is a half anyway";
}

FOR_EVERY_PASS(Conformance);

}  // namespace
}  // namespace postchain

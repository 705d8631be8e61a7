// Rules that skip unread results: unused_plane, unused_step, unused_output.
#include "tests/elision/support.h"

namespace postchain::test::unused_test {
namespace {

using namespace std::string_literals;

TestFrame moving() {
    TestFrame frame = layered_frame(61, 45, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
    frame.planes[Role::motion_back] = frame.planes[Role::motion];
    frame.planes[Role::color] = half_noise(61, 45, 4, 9);
    frame.description = describe(frame.planes);
    frame.description.camera.f_stop = 0.2;  // the square is blurred
    return frame;
}

TEST(UnusedPlane, IsNotHandedOver) {
    const TestFrame frame = moving();
    const auto check = [&](const Chain& chain, RoleSet reads) {
        for (const Precision precision : kPrecisions) {
            const Elided elided = expect_same_bits(chain, frame.description, frame.planes,
                                                   only({kRuleUnusedPlane}, precision));
            EXPECT_EQ(elided.plan.reads, reads) << elided.plan.reads.text();
            // It need not even be there.
            FramePlanes planes;
            for (const auto& [role, plane] : frame.planes)
                if (reads.has(role) || role == Role::color) planes[role] = plane;
            EXPECT_EQ(first_difference(elided.outputs.at(Role::color),
                                       filter(chain, frame.description, planes,
                                              only({kRuleUnusedPlane}, precision))
                                           .at(Role::color)),
                      "");
            // Without the rule every plane is.
            PlanOptions without{.rules_off = {kRuleUnusedPlane}};
            EXPECT_EQ(make_plan(chain, frame.description, without)->reads,
                      frame.description.planes);
        }
    };
    check(chain_of("motion_blur", {{"mode", "guertin"}, {"depth_softness", 0.0}}),
          {Role::color, Role::motion});
    check(chain_of("motion_blur", {{"mode", "guertin"}}),
          {Role::color, Role::motion, Role::inverse_depth});
    check(chain_of("depth_of_field", {{"method", "gilham"}}), {Role::color, Role::inverse_depth});
    check(chain_of("fxaa"), {Role::color});
}

// Steps that the parameters make unused.
TEST(UnusedStep, VarianceNoiseAndHint) {
    const TestFrame frame = moving();
    const auto left = [](const Elided& elided) {
        std::string text;
        for (const auto& one : elided.plan.elisions)
            if (one.rule == kRuleUnusedStep) text += item_text(one, elided.plan) + " ";
        return text;
    };
    const auto check = [&](const Chain& chain, const std::string& expected) {
        const Elided elided =
            expect_same_bits(chain, frame.description, frame.planes, only({kRuleUnusedStep}));
        EXPECT_EQ(left(elided), expected);
        const auto complete = make_plan(chain, frame.description, no_rule());
        EXPECT_EQ(complete->steps.size() - elided.plan.steps.size(),
                  (expected.find("variance") != expected.npos) +
                      (expected.find("noise") != expected.npos));
        EXPECT_GT(complete->transient_bytes(), elided.plan.transient_bytes());
    };
    check(chain_of("motion_blur", {{"mode", "guertin"}}),
          "motion_blur.hint motion_blur.tile_variance ");
    check(chain_of("motion_blur", {{"mode", "guertin"}, {"sample_split", "variance"s}}),
          "motion_blur.hint ");
    check(chain_of("motion_blur", {{"mode", "guertin"},
                                   {"sample_split", "variance"s},
                                   {"jitter", 0.0},
                                   {"tile_jitter", false}}),
          "motion_blur.hint motion_blur.noise ");
    check(chain_of("motion_blur", {{"mode", "single"s}, {"noise", "none"s}}),
          "motion_blur.hint motion_blur.tile_variance ");
    Chain read = chain_of("motion_blur", {{"mode", "guertin"}, {"sample_split", "even"s}});
    append(read, "fxaa", {{"hint", "threshold"s}});
    check(read, "motion_blur.tile_variance ");
    Chain unread = chain_of("motion_blur", {{"mode", "guertin"}});
    append(unread, "fxaa", {{"hint", "none"s}});
    append(unread, "depth_of_field", {{"method", "gilham"}});
    check(unread, "motion_blur.hint motion_blur.tile_variance ");
}

}  // namespace
}  // namespace postchain::test::unused_test

// Turned and moved frames by hand. The checks on them, on light and on repetition detect filters
// that break their guarantees: passes with known faults.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>

#include "tests/stress/faulty_pass.h"
#include "tests/stress/subjects.h"
#include "tests/support/gpu.h"
#include "tests/support/status.h"
#include "tools/stress/check.h"
#include "tools/stress/transform.h"

namespace postchain::stress {
namespace {

// 3 x 2 pixels numbered 0..5 in reading order.
ImageF numbered() {
    ImageF image(3, 2, 1);
    for (size_t i = 0; i < 6; ++i) image.data[i] = float(i);
    return image;
}

using Values = std::vector<float>;

TEST(Transform, TurnsByHandAndBack) {
    EXPECT_EQ(turned(numbered(), Symmetry::mirror).data, (Values{2, 1, 0, 5, 4, 3}));
    EXPECT_EQ(turned(numbered(), Symmetry::flip).data, (Values{3, 4, 5, 0, 1, 2}));
    // Clockwise: the left column, read from below, becomes the first row.
    const ImageF quarter = turned(numbered(), Symmetry::turn);
    EXPECT_EQ(quarter.width, 2);
    EXPECT_EQ(quarter.height, 3);
    EXPECT_EQ(quarter.data, (Values{3, 0, 4, 1, 5, 2}));
    for (Symmetry how : {Symmetry::mirror, Symmetry::flip, Symmetry::turn})
        EXPECT_EQ(turned_back(turned(numbered(), how), how), numbered());
}

// A vector points at the same pixel before and after: right becomes down.
TEST(Transform, VectorsTurnWithThePicture) {
    for (const Role role : {Role::motion, Role::motion_back}) {
        FramePlanes planes;
        planes[role] = ImageF(1, 1, 2);
        planes[role].data = {2, 3};
        const auto moved = [&](Symmetry how) { return turned(planes, how)[role].data; };
        EXPECT_EQ(moved(Symmetry::mirror), (Values{-2, 3}));
        EXPECT_EQ(moved(Symmetry::flip), (Values{2, -3}));
        EXPECT_EQ(moved(Symmetry::turn), (Values{-3, 2}));
    }
}

TEST(Transform, WindowsGoOnMirroredAtTheBorders) {
    ImageF line(3, 1, 1);
    line.data = {0, 1, 2};
    EXPECT_EQ(seen_through(line, {-4, 0, 11, 1}).data, (Values{2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0}));
    EXPECT_EQ(seen_through(numbered(), {1, -1, 2, 4}).data, (Values{1, 2, 1, 2, 4, 5, 4, 5}));
}

TEST(Transform, DotHasTheMiddlesMotionAndOneBrightPixel) {
    FramePlanes planes;
    planes[Role::color] = ImageF(4, 2, 4, 1);
    planes[Role::motion] = ImageF(4, 2, 2, 1);
    planes[Role::motion].at(2, 1, 1) = -5;
    const FramePlanes dot = dot_of(planes, 5, 7);
    EXPECT_EQ(dot.at(Role::motion).width, 5);
    EXPECT_EQ(dot.at(Role::motion).at(0, 4, 1), -5);
    double sum = 0;
    for (float value : dot.at(Role::color).data) sum += double(value);
    EXPECT_EQ(sum, 4 * 7);
    EXPECT_EQ(dot.at(Role::color).at(2, 2, 3), 7);
}

// Numbers from the definitions of the parameters.
TEST(Reach, FollowsFromTheParameters) {
    const auto cells = make_cells(40, true);
    const FrameDescription& frame = cells.front().frame;
    Chain both = test::chain_of("motion_blur", {{"mode", "guertin"}, {"max_blur_px", int64_t(30)}});
    EXPECT_EQ(tile_px(both), 30);
    test::append(both, "depth_of_field",
                 {{"method", "gilham"}, {"downsample", int64_t(4)}, {"blur_sigma_px", 5.0}});
    EXPECT_EQ(both.guarantees().lattice_px, 60);  // lcm(30, 4)
    EXPECT_EQ(tile_px(both), 60);
    // 2.5 x 30 + 4 (ceil(3 x 5 / 4) + 2); 1.006 x 30 + 0.5 + 24.
    EXPECT_EQ(both.reach(frame).depends_px, 99);
    EXPECT_NEAR(both.reach(frame).spreads_px, 54.68, 1e-9);
    test::append(both, "vignette");
    EXPECT_EQ(both.guarantees().lattice_px, 0);  // it depends on the position in the image
    EXPECT_EQ(both.reach(frame).depends_px, 99);
}

// Makes the faulty pass's shader available.
class Equivariance : public ::testing::Test {
  protected:
    void SetUp() override {
        test::executor();  // a GL context
        setenv("POSTCHAIN_SHADER_DIR", POSTCHAIN_FAULTY_SHADER_DIR, 1);
        executor_ = std::make_unique<Executor>(gl::describe_current());
        unsetenv("POSTCHAIN_SHADER_DIR");  // was read when the executor was made
    }
    void TearDown() override { executor_.reset(); }

    std::map<std::string, Measured> checks_of(Fault fault, Light light = Light::kept) {
        const Subject subject{"faulty", chain_with(fault, light)};
        std::map<std::string, Measured> checks;
        const auto measured = test::must(
            measure(*executor_, subject, find_cell("object 40 px, ground still"), Precision::fp32));
        for (const auto& one : measured.checks) checks[one.check] = one;
        return checks;
    }

    std::unique_ptr<Executor> executor_;
};

const std::vector<std::string> kWatched = {"repeat", "mirror", "flip",     "turn",  "shift",
                                           "grid",   "dot",    "constant", "range", "reference"};

TEST_F(Equivariance, NonFiniteResultsAreCounted) {
    MatrixCell cell = find_cell("object 40 px, ground still");
    for (float& value : cell.planes[Role::color].data) value = NAN;
    const Subject copies{"faulty", chain_with(Fault::none)};
    const auto measured = test::must(measure(*executor_, copies, cell, Precision::fp32));
    const Measured& finite = find_check(measured.checks, "finite");
    EXPECT_EQ(finite.verdict, Verdict::failed);
    EXPECT_EQ(finite.value, double(cell.planes[Role::color].data.size()));
}

// Otherwise a driver whose results differ from run to run would pass.
TEST_F(Equivariance, RepeatRunsTheCellOnceMore) {
    const Subject copies{"faulty", chain_with(Fault::none)};
    const MatrixCell& cell = find_cell("object 40 px, ground still");
    for (const auto& [check, runs] :
         {std::pair("finite", 1u), {"repeat", 2u}, {"constant", 2u}, {"mirror", 2u}}) {
        const uint64_t before = executor_->counters().dispatches;
        test::must(measure(*executor_, copies, cell, Precision::fp32, nullptr, {check}));
        EXPECT_EQ(executor_->counters().dispatches - before, runs) << check;
    }
}

// Behind a steep lens the depth changes by 1e-5, not 1e-4: f-stop and focus distance make R change
// by 25,000 px. At inverse depth 1 the result changes by |noise|, whose mean is a half, times that.
TEST_F(Equivariance, ContinuityIsRelativeToTheChangeThatWasMade) {
    MatrixCell cell = find_cell("object 40 px, ground still");
    for (float& value : cell.planes[Role::inverse_depth].data) value = 1;
    const Subject subject{"faulty", chain_with(Fault::takes_depth)};
    Camera& camera = cell.frame.camera;
    const double focal_px =
        *camera.focal_length_mm / *camera.sensor_width_mm * cell.frame.display_width;
    camera.f_stop = 1e-3 * *camera.focal_length_mm * focal_px / (2 * *camera.focus_distance) / 25e3;
    const auto measured =
        test::must(measure(*executor_, subject, cell, Precision::fp32, nullptr, {"depth"}));
    EXPECT_NEAR(find_check(measured.checks, "depth").value, 0.5, 0.02);
}

// Colors above the largest half come from a float file. Pass and reference get what half stores.
TEST_F(Equivariance, BothGetColorAsHalfStoresIt) {
    MatrixCell cell = find_cell("object 40 px, ground still");
    for (float& value : cell.planes[Role::color].data) value = 1e5f;
    const Subject copies{"faulty", chain_with(Fault::none)};
    const auto measured =
        test::must(measure(*executor_, copies, cell, Precision::fp16, nullptr, {"reference"}));
    EXPECT_EQ(find_check(measured.checks, "reference").value, 0);
}

// The pass's reference is a copy, and it guarantees everything.
TEST_F(Equivariance, EachCheckSeesItsFaultsAndNoOthers) {
    const std::pair<Fault, std::set<std::string>> rows[] = {
        {Fault::none, {}},
        {Fault::looks_left, {"mirror", "turn", "reference"}},
        {Fault::looks_up, {"flip", "turn", "reference"}},
        {Fault::blurs_rows, {"turn", "reference"}},
        {Fault::shades_tiles,
         {"mirror", "flip", "turn", "grid", "dot", "constant", "range", "reference"}},
        {Fault::shades_frame,
         {"mirror", "flip", "turn", "shift", "grid", "dot", "constant", "range", "reference"}},
        {Fault::brightens, {"dot", "constant", "range", "reference"}},
        {Fault::dims, {"dot", "constant", "range", "reference"}},
    };
    for (const auto& [fault, failing] : rows) {
        auto checks = checks_of(fault);
        for (const auto& check : kWatched) {
            ASSERT_EQ(checks.count(check), 1u) << check;
            EXPECT_EQ(checks[check].verdict == Verdict::failed, failing.count(check) == 1)
                << "fault " << int(fault) << ": " << check << " " << checks[check].value << " "
                << checks[check].note;
        }
    }
    auto whole = checks_of(Fault::none);
    for (const auto& check : kWatched) EXPECT_EQ(whole[check].value, 0) << check;
    // 0.1 / 1.1 in every pixel.
    EXPECT_NEAR(checks_of(Fault::brightens)["reference"].value, 0.1 / 1.1, 1e-6);
    EXPECT_EQ(checks_of(Fault::counts_runs)["repeat"].verdict, Verdict::failed);
}

// 1.1 and 0.9 of the light; passes that may lose light are checked for gain only, others are
// exempt.
TEST_F(Equivariance, DotCountsLight) {
    for (const auto& [fault, light, value] : {std::tuple{Fault::brightens, Light::kept, 0.1},
                                              {Fault::dims, Light::kept, 0.1},
                                              {Fault::brightens, Light::not_more, 0.1},
                                              {Fault::dims, Light::not_more, 0.0}})
        EXPECT_NEAR(checks_of(fault, light)["dot"].value, value, 1e-6) << int(fault);
    EXPECT_EQ(checks_of(Fault::brightens, Light::any).count("dot"), 0u);
}

}  // namespace
}  // namespace postchain::stress

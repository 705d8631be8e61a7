// The frames of the stability matrix match their names.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "chain/base/status.h"
#include "tests/stress/subjects.h"

namespace postchain::stress {
namespace {

// The frames contain the scales of the specification.
TEST(Stress, CellsHoldTheScalesTheyName) {
    // Half-velocities: with a shutter of one frame the motion is twice as long.
    for (double v : {0.0, 1e-6, 0.499, 0.5, 0.501, 1.0, 40.0, 1e3, 1e6})
        EXPECT_NEAR(find_cell(concat("object ", v, " px, ground still")).frame.bounds.max_speed_px,
                    2 * v, 1e-6 * v);
    const FramePlanes& opposed = find_cell("antiparallel 1 px").planes;
    EXPECT_FLOAT_EQ(opposed.at(Role::motion).at(40, 20, 0), 1.6f);
    EXPECT_FLOAT_EQ(opposed.at(Role::motion).at(0, 0, 0), -1.6f);
    EXPECT_FLOAT_EQ(opposed.at(Role::motion).at(0, 0, 1), -1.2f);
    const FrameBounds& ratio = find_cell("ratio 1e+30").frame.bounds;
    EXPECT_NEAR(ratio.max_inverse_depth / ratio.min_inverse_depth, 1e30, 1e24);
    const FrameBounds& close = find_cell("ratio 1+1e-07").frame.bounds;
    EXPECT_GT(close.max_inverse_depth, close.min_inverse_depth);
    EXPECT_LT(close.max_inverse_depth / close.min_inverse_depth, 1 + 2e-7);
    const FrameBounds& sky = find_cell("near plane before sky").frame.bounds;
    EXPECT_EQ(sky.min_inverse_depth, 0);
    EXPECT_EQ(sky.max_inverse_depth, 10);
    // Which of the two is the object.
    for (const auto& [name, object, ground] : {std::tuple("ratio 1e+30", 1.0f, 1e-30f),
                                               {"ratio 1e+30, object behind", 1e-30f, 1.0f},
                                               {"near plane before sky", 10.0f, 0.0f},
                                               {"sky in near plane", 0.0f, 10.0f}}) {
        const ImageF& depth = find_cell(name).planes.at(Role::inverse_depth);
        EXPECT_EQ(depth.at(40, 20), object) << name;
        EXPECT_EQ(depth.at(0, 0), ground) << name;
    }
    std::set<std::string> rows;
    for (const MatrixCell& cell : make_cells(40, false)) rows.insert(cell.row);
    EXPECT_EQ(rows, (std::set<std::string>{"crossed", "denormal", "depth", "lens", "nonfinite",
                                           "nothing", "paths", "radiance", "size", "speed"}));
    EXPECT_EQ(find_cell("f/0.1, focus at infinity").frame.camera.f_stop, 0.1);
    EXPECT_EQ(find_cell("16384x3").frame.width, 16384);
    const FramePlanes& tiny = find_cell("motion and inverse depth of 1e-40").planes;
    EXPECT_EQ(std::fpclassify(tiny.at(Role::motion).at(0, 0)), FP_SUBNORMAL);
    EXPECT_EQ(std::fpclassify(tiny.at(Role::inverse_depth).at(0, 0)), FP_SUBNORMAL);
    EXPECT_EQ(std::fpclassify(find_cell("color of 5e-39").planes.at(Role::color).at(0, 0)),
              FP_SUBNORMAL);
    // A tenth of 80x40 pixels, starting with the fourth.
    EXPECT_EQ(find_cell("nan in motion_back").nonfinite_placed, 320u);
    EXPECT_EQ(find_cell("nan in every plane").nonfinite_placed, 4 * 320u);
    EXPECT_EQ(find_cell("inf in depth").nonfinite_placed, 0u);  // a valid form of sky
    for (const MatrixCell& cell : make_cells(40, false))
        for (const auto& [role, plane] : cell.planes)
            for (float value : plane.data) ASSERT_TRUE(std::isfinite(value)) << cell.name;
}

// Every value of every row of the crossed cells is in the reduced set.
TEST(Stress, CrossedCellsBringTheWorstTogether) {
    std::set<std::string> parts;
    for (const MatrixCell& cell : make_cells(40, true)) {
        if (cell.row != "crossed" || cell.checks_counts) continue;
        for (size_t from = 0; from < cell.name.size();) {
            const size_t comma = std::min(cell.name.find(", ", from), cell.name.size());
            parts.insert(cell.name.substr(from, comma - from));
            from = comma + 2;
        }
    }
    for (const char* part : {"1e6 px against 1e6 px", "0.501 px over 1e6 px", "1e6 px over 1e-6 px",
                             "near plane before sky", "sky in near plane", "depth ratio 1e30",
                             "firefly 1e10", "1e-8 beside 1e10", "both signs", "65504",
                             "f/0.1 at the near plane", "f/0.1 at infinity", "41x31"})
        EXPECT_EQ(parts.count(part), 1u) << part;
    const MatrixCell& cell = find_cell(
        "1e6 px against 1e6 px, near plane before sky, 1e-8 beside 1e10, f/0.1 at infinity");
    const FramePlanes& planes = cell.planes;
    EXPECT_FLOAT_EQ(planes.at(Role::motion).at(40, 20, 0), 1.6e6f);
    EXPECT_FLOAT_EQ(planes.at(Role::motion).at(0, 0, 0), -1.6e6f);
    EXPECT_EQ(planes.at(Role::inverse_depth).at(40, 20), 10);
    EXPECT_EQ(planes.at(Role::inverse_depth).at(0, 0), 0);
    EXPECT_LT(planes.at(Role::color).at(7, 0), 1e-8f);
    EXPECT_GT(planes.at(Role::color).at(8, 0), 1e9f);
    EXPECT_EQ(cell.frame.camera.f_stop, 0.1);
    EXPECT_EQ(cell.frame.camera.focus_distance, 1e30);
}

}  // namespace
}  // namespace postchain::stress

// Known limits: where they apply, that each is needed, and that the documentation lists it.
#include "tools/stress/limits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "tools/stress/matrix.h"

#include "tests/stress/subjects.h"
#include "tests/support/gpu.h"
#include "tests/support/status.h"

namespace postchain::stress {
namespace {

// The bound of the limit that a failed check is within, or 0.
double limit_of(const Chain& chain, const char* check, double value, const char* row,
                const char* cell = "both signs") {
    CellResult result;
    result.subject = "paper";
    result.row = row;
    result.cell = cell;
    result.measured = {{check, Verdict::failed, value, 1e-4, "at 1,1"},
                       {"finite", Verdict::failed, 1, 0, {}}};
    apply_known_limits(chain, result);
    EXPECT_EQ(result.measured[1].verdict, Verdict::failed);
    EXPECT_EQ(result.measured[0].limit != nullptr, result.measured[0].verdict == Verdict::limit);
    return result.measured[0].limit ? result.measured[0].limit->bound : 0;
}

TEST(Stress, LimitsHoldOnlyWhereListedAndInsideTheirBound) {
    const Chain fxaa = test::chain_of("fxaa");
    const char* const listed = "both signs, 1e10";
    EXPECT_EQ(limit_of(fxaa, "reference", 0.0149, "radiance", listed), 0.015);
    EXPECT_EQ(limit_of(fxaa, "reference", 0.0151, "radiance", listed), 0);
    EXPECT_EQ(limit_of(fxaa, "reference", 0.0149, "radiance", "negative"), 0);
    const Chain guertin = test::chain_of("motion_blur", {{"mode", "guertin"}});
    EXPECT_EQ(limit_of(guertin, "reference", 0.0149, "radiance", listed), 0);
}

// For one pass the first limit that names the cell counts, for several passes the widest; and only
// with these parameters.
TEST(Stress, LimitsOfSeveralPassesAreTheWidest) {
    Chain chain = test::chain_of("depth_of_field", {{"method", "gilham"}});
    EXPECT_EQ(limit_of(chain, "turn", 1e-3, "crossed"), 0.03);
    EXPECT_EQ(limit_of(chain, "turn", 1e-3, "radiance"), 0.0024);
    test::append(chain, "fxaa");
    EXPECT_EQ(limit_of(chain, "turn", 1e-3, "crossed"), 0.03);
    EXPECT_EQ(limit_of(chain, "turn", 1e-3, "radiance"), 0.032);
    chain = test::chain_of("depth_of_field", {{"method", "gilham"}, {"leak", "none"}});
    EXPECT_EQ(limit_of(chain, "turn", 1e-3, "crossed"), 0);
}

// An unused limit would hide the next fault: each must be needed by at least one cell.
TEST(Stress, EveryKnownLimitIsMet) {
    std::vector<Subject> subjects;
    for (auto& subject : every_pass_and_both_orders())
        subjects.push_back(with_cells_camera(std::move(subject)));
    subjects.push_back(with_cells_camera(
        {"gilham",
         test::chain_of("depth_of_field", {{"method", "gilham"}, {"downsample", int64_t(4)}})}));
    subjects.push_back(
        with_cells_camera({"guertin", test::chain_of("motion_blur", {{"mode", "guertin"}})}));
    for (const char* name : {"fast", "balanced", "best"})
        subjects.push_back(with_cells_camera(shipped(name)));
    // FXAA behind two passes of the inverse warp.
    for (const int64_t samples : {16, 32}) {
        const std::string neighbors = samples == 16 ? "none" : "both";
        Chain chain = test::chain_of(
            "depth_of_field",
            {{"method", "inverse_warp"}, {"samples", samples}, {"neighbors", neighbors}});
        test::append(chain, "motion_blur",
                     {{"mode", "inverse_warp"},
                      {"samples", samples == 16 ? int64_t(9) : int64_t(25)},
                      {"starts", samples == 16 ? int64_t(3) : int64_t(4)},
                      {"neighbors", neighbors}});
        test::append(chain, "fxaa", {{"mode", "directional"}});
        subjects.push_back(with_cells_camera({concat("lens first, ", samples), chain.clone()}));
    }
    std::map<int, std::vector<MatrixCell>> cells;  // by size of the tiles
    const auto is_met = [&](const std::string& pass, const KnownLimit& limit) {
        for (const auto& subject : subjects) {
            if (!matches(pass + ": *" + limit.parameters, subject.chain.text())) continue;
            const int tile = tile_px(subject.chain);
            if (!cells.contains(tile)) cells[tile] = make_cells(tile, false);
            for (const auto& cell : cells[tile]) {
                for (Precision precision : {Precision::fp32, Precision::fp16}) {
                    CellResult result;
                    result.subject = subject.name;
                    result.row = cell.row;
                    result.cell = cell.name;
                    result.precision = precision;
                    if (!matches(limit.cells, result.name())) continue;
                    result.measured = test::must(measure(test::executor(), subject, cell, precision,
                                                         nullptr, {limit.check}))
                                          .checks;
                    apply_known_limits(subject.chain, result, every_limit());
                    for (const auto& one : result.measured)
                        if (one.limit && one.limit->reason == limit.reason &&
                            one.limit->bound == limit.bound)
                            return true;
                }
            }
        }
        return false;
    };
    for (const auto& [pass, limits] : every_limit())
        for (const auto& limit : limits)
            EXPECT_TRUE(is_met(pass, limit))
                << pass << " " << limit.check << " " << limit.parameters << " " << limit.cells;
}

// The cause that the limit of a tied sample names.
TEST(Stress, ATiedSampleIsOneOfManyWithoutDenoising) {
    Subject subject = with_cells_camera(shipped("best"));
    const auto reference = [&](const MatrixCell& cell) {
        return test::must(measure(test::executor(), subject, cell, Precision::fp32, nullptr,
                                  {"reference"}))
            .checks.at(0)
            .verdict;
    };
    std::vector<MatrixCell> over;
    for (const MatrixCell& cell : make_cells(tile_px(subject.chain), false))
        if (cell.row == "crossed" &&
            matches("both signs, 65504, f/0.1 at the near plane", cell.name))
            if (reference(cell) == Verdict::failed) over.push_back(cell);
    ASSERT_FALSE(over.empty());
    const ChainLink& joint = subject.chain.links[0];
    ASSERT_TRUE(joint.type->parameters->set(joint.pass->parameters(), "denoise", false).ok());
    for (const MatrixCell& cell : over) EXPECT_EQ(reference(cell), Verdict::ok) << cell.name;
}

// docs/stability.md has a row for each: cause, owner, why it is not fixed, what to set instead.
TEST(Stress, EveryKnownLimitHasARowInTheDocumentation) {
    std::ifstream file(POSTCHAIN_SOURCE_DIR "/docs/stability.md");
    std::set<std::string> rows;
    for (std::string line; std::getline(file, line);)
        if (std::count(line.begin(), line.end(), '|') -
                std::count(line.begin(), line.end(), '\\') ==
            7)
            rows.insert(line.substr(2, line.find(" |", 2) - 2));
    std::set<std::string> named;
    for (const auto& [pass, limits] : known_limits()) {
        for (const auto& limit : limits) {
            const std::string name = limit.reason.substr(0, limit.reason.find(':'));
            EXPECT_EQ(rows.count(name), 1u) << pass << ": " << limit.reason;
            named.insert(name);
            // Checks without exceptions have no limit.
            for (const char* check : {"finite", "elided", "counted", "identity", "constant",
                                      "repeat", "range", "shift", "dot"})
                EXPECT_NE(limit.check, check) << pass;
        }
    }
    // And no row without a limit, except the table's head and the line below it.
    EXPECT_EQ(rows.size(), named.size() + 2);
}

// At 16384 px, float positions have steps of 0.001 px. The inverse warp never adds two positions.
TEST(Stress, WidePicturesAgreeWithTheReference) {
    // Lengths at which a float's position and a double's still choose the same pixels.
    const Subject best =
        with_cells_camera({"best", test::chain_of("joint_blur", {{"samples", int64_t(128)},
                                                                 {"starts", int64_t(8)},
                                                                 {"max_blur_px", int64_t(40)},
                                                                 {"max_radius_px", 491.0}})});
    size_t met = 0;
    for (const auto& cell : make_cells(tile_px(best.chain), false)) {
        if (cell.row != "crossed" || !matches("16384x3", cell.name)) continue;
        ++met;
        const auto measured = test::must(
            measure(test::executor(), best, cell, Precision::fp32, nullptr, {"reference"}));
        EXPECT_LE(find_check(measured.checks, "reference").value, 5e-5);
    }
    EXPECT_EQ(met, 1u);
}

}  // namespace
}  // namespace postchain::stress

// The stability matrix: its reduced set over every registered pass and both orders; its checks and
// table detect faults.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/stress/subjects.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/stress/matrix.h"

namespace postchain::stress {
namespace {

std::string failures(const Matrix& matrix) {
    std::string text;
    for (const auto& cell : matrix.cells)
        for (const auto& one : cell.measured)
            if (one.verdict == Verdict::failed)
                text += concat(cell.name(), ": ", one.check, " ", one.value, " > ", one.bound, "; ",
                               one.note, "\n");
    return text;
}

// The checks that apply to a chain because of its passes' guarantees.
std::set<std::string> guaranteed_checks(const Chain& chain) {
    std::set<std::string> checks(check_names().begin(), check_names().end());
    const auto keep = [&](std::initializer_list<const char*> names, auto guarantee) {
        if (chain.that_guarantees(guarantee)) return;
        for (const char* name : names) checks.erase(name);
    };
    const auto has = [](Symmetry symmetry) {
        return [=](const Guarantees& one) { return one.symmetries.count(symmetry) > 0; };
    };
    keep({"constant"}, [](const Guarantees& one) { return one.keeps_constants; });
    keep({"range"}, [](const Guarantees& one) { return one.convex.has_value(); });
    keep({"identity"}, [](const Guarantees& one) { return !one.driven_by.empty(); });
    keep({"mirror"}, has(Symmetry::mirror));
    keep({"flip"}, has(Symmetry::flip));
    keep({"turn"}, has(Symmetry::turn));
    keep({"shift", "grid"}, has(Symmetry::shift));
    keep({"dot"}, [](const Guarantees& one) { return one.light != Light::any; });
    return checks;
}

TEST(Stress, ReducedSetHoldsForEveryPassAndBothOrders) {
    MatrixOptions options;
    options.reduced = true;
    options.limits = &every_limit();
    const auto subjects = every_pass_and_both_orders();
    const Matrix matrix = test::must(run_matrix(test::executor(), subjects, options));
    EXPECT_EQ(failures(matrix), "");
    // Every subject has every row, and every check that its passes guarantee.
    std::map<std::string, std::set<std::string>> rows, checks;
    for (const auto& cell : matrix.cells) {
        rows[cell.subject].insert(cell.row);
        for (const auto& one : cell.measured) checks[cell.subject].insert(one.check);
    }
    std::set<std::string> all_rows;
    for (const MatrixCell& cell : make_cells(40, false)) all_rows.insert(cell.row);
    EXPECT_EQ(all_rows.size(), 10u);
    for (const auto& subject : subjects) {
        EXPECT_EQ(rows[subject.name], all_rows) << subject.name;
        EXPECT_EQ(checks[subject.name], guaranteed_checks(subject.chain)) << subject.name;
    }
}

// The reduced set has the passes with their defaults, whose limits are others.
TEST(Stress, ShippedChainsHoldWherePathsPart) {
    MatrixOptions options;
    options.only = "apart, nothing found/fp32";
    std::vector<Subject> subjects;
    for (const char* name : {"fast", "balanced", "best"}) subjects.push_back(shipped(name));
    EXPECT_EQ(failures(test::must(run_matrix(test::executor(), subjects, options))), "");
}

// A cell that claims what does not hold.
TEST(Stress, ChecksSeeWhatTheyAreFor) {
    const Subject subject =
        with_cells_camera({"motion_blur", test::chain_of("motion_blur", {{"mode", "guertin"}})});
    const MatrixCell cell = find_cell("object 40 px, ground still");
    const auto checks = [&](const MatrixCell& wrong) {
        return test::must(measure(test::executor(), subject, wrong, Precision::fp32)).checks;
    };
    MatrixCell still = cell;
    still.still = true;
    auto found = checks(still);
    EXPECT_EQ(find_check(found, "identity").verdict, Verdict::failed);
    EXPECT_GT(find_check(found, "identity").value, 0.1);
    EXPECT_EQ(find_check(found, "constant").verdict, Verdict::ok);
    // Still ground beside an object that moves takes its blur as soon as it has a direction.
    EXPECT_GT(find_check(found, "noise").value, 2);
    EXPECT_EQ(find_check(checks(find_cell("still, in focus")), "noise").value, 0);
    // Wrong facts: the elided run skips the blur, the complete one does not.
    MatrixCell slow = cell;
    slow.frame.bounds.max_speed_px = 0;
    EXPECT_EQ(find_check(checks(slow), "elided").verdict, Verdict::failed);
    MatrixCell count = cell;
    count.checks_counts = true;
    count.nonfinite_placed = 1;
    found = checks(count);
    EXPECT_EQ(find_check(found, "counted").verdict, Verdict::failed);
    EXPECT_EQ(find_check(found, "counted").value, 1);
}

TEST(Stress, CameraOfTheCellCountsAlone) {
    Subject subject{
        "one", test::chain_of("motion_blur", {{"mode", "guertin"}, {"shutter_angle_deg", 90.0}})};
    test::append(subject.chain, "depth_of_field", {{"method", "gilham"}, {"f_stop", 8.0}});
    subject.chain.camera.f_stop = 4;
    subject = with_cells_camera(std::move(subject));
    EXPECT_EQ(subject.chain.camera, Camera());
    const std::string text = subject.chain.text();
    EXPECT_NE(text.find("shutter_angle_deg=unset"), std::string::npos) << text;
    EXPECT_EQ(text.find("f_stop=8"), std::string::npos) << text;
    EXPECT_EQ(tile_px(subject.chain), 40);
    EXPECT_EQ(
        tile_px(test::chain_of("motion_blur", {{"mode", "guertin"}, {"max_blur_px", int64_t(64)}})),
        64);
    EXPECT_EQ(tile_px(test::chain_of("depth_of_field", {{"method", "gilham"}})), 40);
    EXPECT_EQ(tile_px(test::chain_of("vignette")), 40);
}

TEST(Stress, PatternsMatchAnywhereAndAcrossStars) {
    const char* name = "paper/speed/all 1 px/fp16";
    for (const char* pattern : {"", "speed", "paper*fp16", "*all*px*"})
        EXPECT_TRUE(matches(pattern, name)) << pattern;
    for (const char* pattern : {"fp16*paper", "depth"})
        EXPECT_FALSE(matches(pattern, name)) << pattern;
}

TEST(Stress, TableShowsTheWorstAndEveryFailureAndLimit) {
    const KnownLimit limit{"mirror", "", "", 10, "known"};
    const auto cell = [&](char name, Precision precision, Measured range, double mirror) {
        CellResult result;
        result.subject = "a";
        result.row = "speed";
        result.cell = std::string(1, name);
        result.precision = precision;
        result.measured = {std::move(range), {"mirror", Verdict::limit, mirror, 1, {}}};
        result.measured[1].limit = &limit;
        return result;
    };
    Matrix matrix;
    matrix.cells = {cell('x', Precision::fp32, {"range", Verdict::ok, 0, 1, {}}, 3),
                    cell('y', Precision::fp16, {"range", Verdict::failed, 2.5, 1, "at 3,4"}, 7),
                    cell('z', Precision::fp32, {"range", Verdict::failed, 2, 1, "at 3,4"}, 5)};
    const std::string text = matrix_as_text(matrix);
    for (const char* part :
         {"FAIL 2.5", "limit 7", "FAIL a/speed/y/fp16: range 2.5, bound 1; at 3,4",
          "FAIL a/speed/z/fp32: range 2, bound 1; at 3,4",
          "limit mirror 3 times, worst 7 (bound 10) in a/speed/y/fp16: known",
          "3 cells, 6 checks: 1 ok, 3 known limits, 2 failed"})
        EXPECT_NE(text.find(part), std::string::npos) << part << text;
}

TEST(Stress, TableShowsErrorsAndConditionNumbersByPrecision) {
    Matrix matrix;
    const auto add = [&](Precision precision, const char* check, double value) {
        CellResult cell;
        cell.subject = "a";
        cell.precision = precision;
        cell.measured = {{check, Verdict::ok, value, 1, {}}};
        matrix.cells.push_back(std::move(cell));
    };
    for (double value : {3e-6, 1e-6, 2e-6}) add(Precision::fp32, "reference", value);
    add(Precision::fp16, "reference", 4e-4);
    add(Precision::fp16, "noise", 0.5);
    const std::string text = matrix_as_text(matrix);
    const auto line = [&](const char* precision) {
        const size_t at = text.find(concat("a      ", precision));
        return at == std::string::npos ? text : text.substr(at, text.find('\n', at) - at);
    };
    EXPECT_EQ(line("fp16"), "a      fp16       0.0004 to 0.0004  -      -       -      0.5 to 0.5");
    EXPECT_EQ(line("fp32"), "a      fp32       2e-06 to 3e-06    -      -       -      -");
}

// 0.004 of 0.005 is worse than 5e-5 of 1e-4, although the absolute margin is larger.
TEST(Stress, WorstIsTheLargestPartOfItsBound) {
    Matrix matrix;
    matrix.cells.resize(3);
    matrix.cells[0].measured = {{"mirror", Verdict::ok, 5e-5, 1e-4, {}}};
    matrix.cells[1].measured = {{"mirror", Verdict::ok, 4e-3, 5e-3, {}}};
    matrix.cells[2].measured = {{"mirror", Verdict::ok, 1e-5, 1e-4, {}}};
    const auto worst = [&] { return worst_of(matrix).at(0).checks.at("mirror").measured->value; };
    EXPECT_EQ(worst(), 4e-3);
    matrix.cells[0].measured[0].value = NAN;
    EXPECT_TRUE(std::isnan(worst()));
    matrix.cells[2].measured[0].verdict = Verdict::limit;
    EXPECT_EQ(worst(), 1e-5);
}

TEST(Stress, WorstIsThatOfARowAndASubject) {
    Matrix matrix;
    const auto add = [&](const char* row, const char* subject, double value) {
        CellResult cell;
        cell.row = row;
        cell.subject = subject;
        cell.measured = {{"mirror", Verdict::ok, value, 1, {}}};
        matrix.cells.push_back(std::move(cell));
    };
    add("a", "x", 0.1);
    add("a", "y", 0.2);
    add("b", "x", 0.3);
    add("a", "x", 0.4);
    std::string text;
    for (const WorstLine& line : worst_of(matrix))
        text += concat(line.row, " ", line.subject, " ", line.checks.at("mirror").measured->value,
                       "\n");
    EXPECT_EQ(text, "a x 0.4\na y 0.2\nb x 0.3\n");
}

TEST(Stress, NoCellAndStoppingAreErrors) {
    const auto subjects = every_pass_and_both_orders();
    MatrixOptions options;
    options.only = "no such cell";
    EXPECT_EQ(run_matrix(test::executor(), subjects, options).status().code(), StatusCode::usage);
    options.only = "nothing";
    const auto stopped = run_matrix(test::executor(), subjects, options,
                                    [](const auto&, size_t done, size_t) { return done < 2; });
    EXPECT_EQ(stopped.status().code(), StatusCode::canceled);
}

}  // namespace
}  // namespace postchain::stress

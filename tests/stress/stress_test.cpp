// The stability matrix: its reduced set over every registered pass and both orders, and that its
// checks, its limits and the command see what is wrong.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "config/chain_file.h"
#include "config/chain_find.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"
#include "tools/measure/stress/limits.h"

namespace postchain::stress {
namespace {

std::vector<Subject> every_pass_and_both_orders() {
    std::vector<Subject> subjects;
    for (const auto& type : test::every_pass().types())
        subjects.push_back({type.name, test::chain_of(type.name)});
    for (const char* name : {"paper", "dof_first"}) {
        auto file = load_chain(name, builtin_passes());
        EXPECT_TRUE(file.ok() && file->status().ok()) << name;
        if (file.ok()) subjects.push_back({name, std::move(file->chain)});
    }
    return subjects;
}

std::string failures(const Matrix& matrix) {
    std::string text;
    for (const auto& cell : matrix.cells)
        for (const auto& one : cell.measured)
            if (one.verdict == Verdict::failed)
                text += concat(cell.name(), ": ", one.check, " ", one.value, " > ", one.bound, "; ",
                               one.note, "\n");
    return text;
}

// The checks that a chain is held to, by what its passes promise.
std::set<std::string> promised_checks(const Chain& chain) {
    std::set<std::string> checks(check_names().begin(), check_names().end());
    const auto keep = [&](std::initializer_list<const char*> names, auto promise) {
        if (chain.that_promises(promise)) return;
        for (const char* name : names) checks.erase(name);
    };
    const auto has = [](Symmetry symmetry) {
        return [=](const Promises& one) { return one.symmetries.count(symmetry) > 0; };
    };
    keep({"constant"}, [](const Promises& one) { return one.keeps_constants; });
    keep({"range"}, [](const Promises& one) { return one.convex.has_value(); });
    keep({"identity"}, [](const Promises& one) { return !one.driven_by.empty(); });
    keep({"mirror"}, has(Symmetry::mirror));
    keep({"flip"}, has(Symmetry::flip));
    keep({"turn"}, has(Symmetry::turn));
    keep({"shift", "grid"}, has(Symmetry::shift));
    keep({"dot"}, [](const Promises& one) { return one.light != Light::any; });
    return checks;
}

TEST(Stress, ReducedSetHoldsForEveryPassAndBothOrders) {
    MatrixOptions options;
    options.reduced = true;
    const auto subjects = every_pass_and_both_orders();
    const auto matrix = run_matrix(test::executor(), subjects, options);
    ASSERT_TRUE(matrix.ok()) << matrix.status().message();
    EXPECT_EQ(failures(*matrix), "");
    // Every row is met by every subject, and every check that its passes promise.
    std::map<std::string, std::set<std::string>> rows, checks;
    for (const auto& cell : matrix->cells) {
        rows[cell.subject].insert(cell.row);
        for (const auto& one : cell.measured) checks[cell.subject].insert(one.check);
    }
    std::set<std::string> all_rows;
    for (const Cell& cell : make_cells(40, false)) all_rows.insert(cell.row);
    EXPECT_EQ(all_rows.size(), 9u);
    for (const auto& subject : subjects) {
        EXPECT_EQ(rows[subject.name], all_rows) << subject.name;
        EXPECT_EQ(checks[subject.name], promised_checks(subject.chain)) << subject.name;
    }
}

// The scales of the specification are really in the frames.
TEST(Stress, CellsHoldTheScalesTheyName) {
    const auto cells = make_cells(40, false);
    const auto find = [&](const std::string& name) -> const Cell& {
        for (const auto& cell : cells)
            if (cell.name == name) return cell;
        ADD_FAILURE() << name;
        return cells.front();
    };
    // Half-velocities: with a shutter of one frame the motion is twice as long.
    for (double v : {0.0, 1e-6, 0.499, 0.5, 0.501, 1.0, 40.0, 1e3, 1e6})
        EXPECT_NEAR(find(concat("object ", v, " px, ground still")).frame.bounds.max_speed_px,
                    2 * v, 1e-6 * v);
    const FramePlanes& opposed = find("antiparallel 1 px").planes;
    EXPECT_FLOAT_EQ(opposed.at(Role::motion).at(40, 20, 0), 1.6f);
    EXPECT_FLOAT_EQ(opposed.at(Role::motion).at(0, 0, 0), -1.6f);
    EXPECT_FLOAT_EQ(opposed.at(Role::motion).at(0, 0, 1), -1.2f);
    const FrameBounds& ratio = find("ratio 1e+30").frame.bounds;
    EXPECT_NEAR(ratio.max_inverse_depth / ratio.min_inverse_depth, 1e30, 1e24);
    const FrameBounds& close = find("ratio 1+1e-07").frame.bounds;
    EXPECT_GT(close.max_inverse_depth, close.min_inverse_depth);
    EXPECT_LT(close.max_inverse_depth / close.min_inverse_depth, 1 + 2e-7);
    const FrameBounds& sky = find("near plane before sky").frame.bounds;
    EXPECT_EQ(sky.min_inverse_depth, 0);
    EXPECT_EQ(sky.max_inverse_depth, 10);
    EXPECT_EQ(find("f/0.1, focus at infinity").frame.camera.f_stop, 0.1);
    EXPECT_EQ(find("16384x3").frame.width, 16384);
    // A tenth of 80x40 pixels, from the fourth on.
    EXPECT_EQ(find("nan in motion_back").nonfinite_placed, 320u);
    EXPECT_EQ(find("nan in every plane").nonfinite_placed, 4 * 320u);
    EXPECT_EQ(find("inf in depth").nonfinite_placed, 0u);  // a way to write sky
    for (const auto& cell : cells)
        for (const auto& [role, plane] : cell.planes)
            for (float value : plane.data) ASSERT_TRUE(std::isfinite(value)) << cell.name;
}

const Measured& find_check(const std::vector<Measured>& all, const std::string& check) {
    for (const auto& one : all)
        if (one.check == check) return one;
    static const Measured none{"none", Verdict::ok, -1, -1, {}};
    return none;
}

// Every value of every row of the crossed cells is in one of the reduced set.
TEST(Stress, CrossedCellsBringTheWorstTogether) {
    std::set<std::string> parts;
    for (const Cell& cell : make_cells(40, true)) {
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
    for (const Cell& cell : make_cells(40, false)) {
        if (cell.name !=
            "1e6 px against 1e6 px, near plane before sky, 1e-8 beside 1e10, "
            "f/0.1 at infinity")
            continue;
        const FramePlanes& planes = cell.planes;
        EXPECT_FLOAT_EQ(planes.at(Role::motion).at(40, 20, 0), 1.6e6f);
        EXPECT_FLOAT_EQ(planes.at(Role::motion).at(0, 0, 0), -1.6e6f);
        EXPECT_EQ(planes.at(Role::inverse_depth).at(40, 20), 10);
        EXPECT_EQ(planes.at(Role::inverse_depth).at(0, 0), 0);
        EXPECT_LT(planes.at(Role::color).at(7, 0), 1e-8f);
        EXPECT_GT(planes.at(Role::color).at(8, 0), 1e9f);
        EXPECT_EQ(cell.frame.camera.f_stop, 0.1);
        EXPECT_EQ(cell.frame.camera.focus_distance, 1e30);
        return;
    }
    FAIL() << "no such cell";
}

TEST(Stress, ChecksSeeWhatTheyAreFor) {
    const auto cells = make_cells(40, false);
    const Subject subject =
        with_cells_camera({"motion_blur", test::chain_of("motion_blur", {{"mode", "guertin"}})});
    // A cell that calls itself still and is not.
    for (const auto& cell : cells) {
        if (cell.name != "object 40 px, ground still") continue;
        Cell wrong = cell;
        wrong.still = true;
        auto measured = measure(test::executor(), subject, wrong, Precision::fp32);
        ASSERT_TRUE(measured.ok());
        EXPECT_EQ(find_check(measured->checks, "identity").verdict, Verdict::failed);
        EXPECT_GT(find_check(measured->checks, "identity").value, 0.1);
        EXPECT_EQ(find_check(measured->checks, "constant").verdict, Verdict::ok);
        // Facts that lie: the elided run skips the blur, the complete one does not.
        wrong = cell;
        wrong.frame.bounds.max_speed_px = 0;
        measured = measure(test::executor(), subject, wrong, Precision::fp32);
        ASSERT_TRUE(measured.ok());
        EXPECT_EQ(find_check(measured->checks, "elided").verdict, Verdict::failed);
        // NaN that no conversion has replaced, in every pixel.
        wrong = cell;
        for (float& value : wrong.planes[Role::color].data) value = NAN;
        measured = measure(test::executor(), subject, wrong, Precision::fp32);
        ASSERT_TRUE(measured.ok());
        EXPECT_EQ(find_check(measured->checks, "finite").verdict, Verdict::failed);
        EXPECT_EQ(find_check(measured->checks, "finite").value, 80 * 40 * 4);
        // A count that is off by one.
        wrong = cell;
        wrong.checks_counts = true;
        wrong.nonfinite_placed = 1;
        measured = measure(test::executor(), subject, wrong, Precision::fp32);
        ASSERT_TRUE(measured.ok());
        EXPECT_EQ(find_check(measured->checks, "counted").verdict, Verdict::failed);
        EXPECT_EQ(find_check(measured->checks, "counted").value, 1);
    }
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
    EXPECT_EQ(tile_px(test::chain_of("fxaa")), 40);
    EXPECT_EQ(tile_px(test::chain_of("depth_of_field", {{"method", "gilham"}})), 40);
    EXPECT_EQ(tile_px(test::chain_of("vignette")), 40);
}

TEST(Stress, LimitsHoldOnlyWhereListedAndInsideTheirBound) {
    Chain chain = test::chain_of("fxaa");
    const auto verdict = [&](const char* row, const char* cell, double value) {
        CellResult result;
        result.subject = "paper";
        result.row = row;
        result.cell = cell;
        result.measured = {{"reference", Verdict::failed, value, 1e-4, "at 1,1"},
                           {"finite", Verdict::failed, 1, 0, {}}};
        apply_known_limits(chain, result);
        EXPECT_EQ(result.measured[1].verdict, Verdict::failed);
        EXPECT_EQ(result.measured[0].limit != nullptr,
                  result.measured[0].verdict == Verdict::limit);
        return result.measured[0].verdict;
    };
    EXPECT_EQ(verdict("radiance", "both signs, 1e10", 0.0149), Verdict::limit);
    EXPECT_EQ(verdict("radiance", "both signs, 1e10", 0.0151), Verdict::failed);
    EXPECT_EQ(verdict("radiance", "negative", 0.0149), Verdict::failed);
    chain = test::chain_of("motion_blur", {{"mode", "guertin"}});
    EXPECT_EQ(verdict("radiance", "both signs, 1e10", 0.0149), Verdict::failed);
    size_t limits = 0;
    for (const auto& type : test::every_pass().types()) {
        for (const auto& limit : type.known_limits) {
            ++limits;
            // Never of what must hold without exception.
            for (const char* check : {"finite", "elided", "counted", "identity", "constant",
                                      "repeat", "range", "shift", "dot"})
                EXPECT_NE(limit.check, check) << type.name;
        }
    }
    EXPECT_GT(limits, 0u);
}

// Of one pass the first that names the cell counts, of several passes the widest; and only with
// these parameters.
TEST(Stress, LimitsOfSeveralPassesAreTheWidest) {
    const auto limit_in = [](const Chain& chain, const char* row) {
        CellResult result;
        result.row = row;
        result.cell = "both signs";
        result.measured = {{"turn", Verdict::failed, 1e-3, 1e-4, {}}};
        apply_known_limits(chain, result);
        return result.measured[0].limit ? result.measured[0].limit->bound : 0;
    };
    Chain chain = test::chain_of("depth_of_field", {{"method", "gilham"}});
    EXPECT_EQ(limit_in(chain, "crossed"), 0.03);
    EXPECT_EQ(limit_in(chain, "radiance"), 0.0024);
    test::append(chain, "fxaa");
    EXPECT_EQ(limit_in(chain, "crossed"), 0.03);
    EXPECT_EQ(limit_in(chain, "radiance"), 0.032);
    EXPECT_EQ(limit_in(test::chain_of("depth_of_field", {{"method", "gilham"}, {"leak", "none"}}),
                       "crossed"),
              0);
}

// A limit that no cell needs would hide the next fault there: each is met by one at least.
TEST(Stress, EveryKnownLimitIsMet) {
    std::vector<Subject> subjects;
    for (auto& subject : every_pass_and_both_orders())
        subjects.push_back(with_cells_camera(std::move(subject)));
    subjects.push_back(with_cells_camera(
        {"gilham",
         test::chain_of("depth_of_field", {{"method", "gilham"}, {"downsample", int64_t(4)}})}));
    subjects.push_back(
        with_cells_camera({"guertin", test::chain_of("motion_blur", {{"mode", "guertin"}})}));
    for (const char* name : {"fast", "balanced", "best"}) {
        auto file = load_chain(name, builtin_passes());
        ASSERT_TRUE(file.ok() && file->status().ok()) << name;
        subjects.push_back(with_cells_camera({name, std::move(file->chain)}));
    }
    const auto is_met = [&](const PassType& type, const KnownLimit& limit) {
        for (const auto& subject : subjects) {
            if (!matches(type.name + ": *" + limit.parameters, subject.chain.text())) continue;
            for (const auto& cell : make_cells(tile_px(subject.chain), false)) {
                for (Precision precision : {Precision::fp32, Precision::fp16}) {
                    CellResult result;
                    result.subject = subject.name;
                    result.row = cell.row;
                    result.cell = cell.name;
                    result.precision = precision;
                    if (!matches(limit.cells, result.name())) continue;
                    auto measured = measure(test::executor(), subject, cell, precision);
                    EXPECT_TRUE(measured.ok()) << measured.status().message();
                    if (!measured.ok()) return false;
                    result.measured = std::move(measured->checks);
                    apply_known_limits(subject.chain, result);
                    for (const auto& one : result.measured)
                        if (one.limit && one.limit->reason == limit.reason &&
                            one.limit->bound == limit.bound)
                            return true;
                }
            }
        }
        return false;
    };
    for (const auto& type : test::every_pass().types())
        for (const auto& limit : type.known_limits)
            EXPECT_TRUE(is_met(type, limit))
                << type.name << " " << limit.check << " " << limit.parameters << " " << limit.cells;
}

TEST(Stress, PatternsMatchAnywhereAndAcrossStars) {
    EXPECT_TRUE(matches("", "paper/speed/all 1 px/fp16"));
    EXPECT_TRUE(matches("speed", "paper/speed/all 1 px/fp16"));
    EXPECT_TRUE(matches("paper*fp16", "paper/speed/all 1 px/fp16"));
    EXPECT_TRUE(matches("*all*px*", "paper/speed/all 1 px/fp16"));
    EXPECT_FALSE(matches("fp16*paper", "paper/speed/all 1 px/fp16"));
    EXPECT_FALSE(matches("depth", "paper/speed/all 1 px/fp16"));
}

TEST(Stress, TableShowsTheWorstAndEveryFailureAndLimit) {
    const KnownLimit limit{"mirror", "", "", 10, "known"};
    const auto measured = [&](const char* check, Verdict verdict, double value) {
        Measured one;
        one.check = check;
        one.verdict = verdict;
        one.value = value;
        one.bound = 1;
        if (verdict == Verdict::failed) one.note = "at 3,4";
        if (verdict == Verdict::limit) one.limit = &limit;
        return one;
    };
    Matrix matrix;
    matrix.cells.resize(3);
    for (size_t i = 0; i < 3; ++i) {
        matrix.cells[i].subject = "a";
        matrix.cells[i].row = "speed";
        matrix.cells[i].cell = std::string(1, char('x' + i));
    }
    matrix.cells[0].measured = {measured("range", Verdict::ok, 0),
                                measured("mirror", Verdict::limit, 3)};
    matrix.cells[1].measured = {measured("range", Verdict::failed, 2.5),
                                measured("mirror", Verdict::limit, 7)};
    matrix.cells[2].measured = {measured("range", Verdict::failed, 2),
                                measured("mirror", Verdict::limit, 5)};
    matrix.cells[1].precision = Precision::fp16;
    const std::string text = matrix_as_text(matrix);
    EXPECT_NE(text.find("FAIL 2.5"), std::string::npos) << text;
    EXPECT_NE(text.find("limit 7"), std::string::npos) << text;
    EXPECT_NE(text.find("FAIL a/speed/y/fp16: range 2.5, bound 1; at 3,4"), std::string::npos)
        << text;
    EXPECT_NE(text.find("FAIL a/speed/z/fp32: range 2, bound 1; at 3,4"), std::string::npos)
        << text;
    EXPECT_NE(text.find("limit mirror 3 times, worst 7 (bound "), std::string::npos) << text;
    EXPECT_NE(text.find(") in a/speed/y/fp16: " + limit.reason), std::string::npos) << text;
    EXPECT_NE(text.find("3 cells, 6 checks: 1 ok, 3 known limits, 2 failed"), std::string::npos)
        << text;
}

// 0.004 of 0.005 is worse than 5e-5 of 1e-4, though further from its bound.
TEST(Stress, WorstIsTheLargestPartOfItsBound) {
    Matrix matrix;
    matrix.cells.resize(3);
    const std::pair<double, double> rows[] = {{5e-5, 1e-4}, {4e-3, 5e-3}, {1e-5, 1e-4}};
    for (size_t i = 0; i < 3; ++i) {
        Measured one;
        one.check = "mirror";
        one.value = rows[i].first;
        one.bound = rows[i].second;
        matrix.cells[i].measured = {one};
    }
    EXPECT_EQ(worst_of(matrix).at(0).checks.at("mirror").measured->value, 4e-3);
    matrix.cells[0].measured[0].value = NAN;
    EXPECT_TRUE(std::isnan(worst_of(matrix).at(0).checks.at("mirror").measured->value));
    matrix.cells[2].measured[0].verdict = Verdict::limit;
    EXPECT_EQ(worst_of(matrix).at(0).checks.at("mirror").measured->value, 1e-5);
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

// ------------------------------------------------------------------------------------ command

struct Outcome {
    int code = -1;
    std::string out;
};

Outcome command(const std::string& arguments, const std::string& environment = "") {
    Outcome outcome;
    const std::string line =
        concat(environment, " ", POSTCHAIN_COMMAND, " stress ", arguments, " 2>/dev/null");
    FILE* pipe = popen(line.c_str(), "r");
    if (!pipe) return outcome;
    char buffer[4096];
    for (size_t n; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) outcome.out.append(buffer, n);
    const int status = pclose(pipe);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome;
}

std::string read(const std::filesystem::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

TEST(StressCommand, WritesTableAndJsonOfTheCellsAskedFor) {
    const auto folder = std::filesystem::path(testing::TempDir()) / concat("stress", getpid());
    const auto outcome = command("--only '/size/1x1/' --json -o " + (folder / "made").string());
    EXPECT_EQ(outcome.code, 0) << outcome.out;
    const auto json = nlohmann::json::parse(outcome.out);
    // Every pass and two orders, two precisions.
    EXPECT_EQ(json["cells"].size(), 2 * (builtin_passes().types().size() + 2));
    EXPECT_EQ(json["failed"], 0);
    EXPECT_EQ(json["checks"], json["ok"].get<int>() + json["limits"].get<int>());
    EXPECT_EQ(json["cells"][0]["checks"][0]["verdict"], "ok");
    EXPECT_EQ(read(folder / "made/stress.json"), outcome.out);
    const std::string page = read(folder / "made/index.html");
    EXPECT_NE(page.find(concat(json["cells"].size(), " cells, ")), std::string::npos);
    EXPECT_NE(page.find("<code>postchain stress --only '/size/1x1/'</code>"), std::string::npos);
    EXPECT_EQ(read(folder / "made/stress.txt"), command("--only '/size/1x1/'").out);
    std::filesystem::remove_all(folder);
}

// Every bit of every output, and all that is concluded from it, for any number of threads; the
// software renderer reads it from its environment once, when the context is made.
TEST(StressCommand, BitsDoNotDependOnTheNumberOfThreads) {
    // 97x61: 28 work groups of which no number of threads has an equal share. The default run holds
    // every pass, paper and dof_first; the others are what else is shipped.
    for (const char* arguments : {"--only '/size/97x61/'", "fast --only '/size/97x61/fp16'",
                                  "best --only '/size/41x31/fp32'"}) {
        std::set<std::string> outputs;
        for (const char* threads : {"1", "2", "8"}) {
            const auto outcome = command(std::string(arguments) + " --json --device software",
                                         concat("LP_NUM_THREADS=", threads));
            EXPECT_EQ(outcome.code, 0) << arguments << "\n" << outcome.out;
            EXPECT_NE(outcome.out.find("\"bits\":\""), std::string::npos);
            outputs.insert(outcome.out);
        }
        EXPECT_EQ(outputs.size(), 1u) << arguments;
    }
}

TEST(StressCommand, OneChainWithSettingsAndErrors) {
    const auto one = command("fast --set motion_blur.samples=5 --only 'fast/size/41x31'");
    EXPECT_EQ(one.code, 0) << one.out;
    EXPECT_NE(one.out.find("2 cells"), std::string::npos) << one.out;
    EXPECT_EQ(command("--only 'no such cell'").code, 2);
    EXPECT_EQ(command("--set motion_blur.samples=5").code, 2);
    EXPECT_EQ(command("no_such_chain").code, 3);
    EXPECT_EQ(command("--only /size/1x1/fp16 -o /dev/null/x").code, 5);
}

}  // namespace
}  // namespace postchain::stress

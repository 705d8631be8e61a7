// The stability matrix: subjects x rows x cells x precisions, each cell with all its checks.
//
//   make_cells --> measure --> known limits --> Matrix --> text (here), page (page.h), JSON
//                                                          (postchain stress)
//
// A check outside its bound fails, unless it is among the known limits of a pass of the chain
// (limits.h) with a reason and a wider bound that holds; then it is reported as a limit. Nothing
// else widens a bound.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/stress/check.h"

namespace postchain::stress {

struct CellResult {
    std::string subject;
    std::string row;
    std::string cell;
    Precision precision = Precision::fp32;
    std::string chain;  // Chain::text() of the subject
    std::vector<Measured> measured;
    uint64_t bits = 0;  // hash of every bit of the output

    std::string name() const;  // "paper/speed/all 1 px/fp16"
};

struct Matrix {
    std::vector<CellResult> cells;
    size_t count(Verdict verdict) const;  // number of checks
    size_t checks() const;
};

struct MatrixOptions {
    std::string only;      // cells whose name() matches; empty = all (see matches())
    bool reduced = false;  // the few cells of every row that tests can afford
    const KnownLimits* limits = &known_limits();
};

// Whether `name` contains `pattern`, in which * matches any text.
bool matches(std::string_view pattern, std::string_view name);

// Called before each cell with the number done and the total; false stops.
using MatrixProgress = std::function<bool(const std::string& name, size_t done, size_t of)>;

// Errors: usage (no cell matches), canceled, gl; chain if a subject cannot run on a frame.
Result<Matrix> run_matrix(Executor& executor, const std::vector<Subject>& subjects,
                          const MatrixOptions& options, const MatrixProgress& progress = {});

// The worst result of one row, subject and check over its cells and precisions.
struct Worst {
    const CellResult* cell = nullptr;
    const Measured* measured = nullptr;
};
// By row and subject, in run order; no entry if a check does not apply.
struct WorstLine {
    std::string row;
    std::string subject;
    std::map<std::string, Worst> checks;
};
std::vector<WorstLine> worst_of(const Matrix& matrix);

// Uses of a known limit in a run.
struct LimitUse {
    const KnownLimit* limit = nullptr;
    size_t checks = 0;
    Worst worst;
};
// In the order of their first use.
std::vector<LimitUse> limits_met(const Matrix& matrix);

// Three digits, enough to compare a value with its bound.
std::string number_text(double value);

// The worst result of each row, subject and check, followed by errors and condition numbers of each
// subject at each precision, every failed check and every known limit in use, with its number of
// uses and worst value.
std::string matrix_as_text(const Matrix& matrix);

// The reduced matrix of one subject, as a line of `postchain selftest` and of tests/bench/gpu.sh.
struct TestRow {
    std::string name;  // pass, chain, or another test
    size_t frames = 0;
    double reference = 0;  // largest mean error against the double-precision reference
    double bound = 0;      // limit of `reference`; 0 = not compared
    std::vector<std::string> faults;
    double seconds = 0;
};

// In fp32. A matrix that does not end is a fault.
TestRow test_subject(Executor& executor, Subject subject, const MatrixProgress& progress = {});

// To stdout; the heads of the columns, and a row with its first faults.
void print_heads();
void print_row(const TestRow& row);

}  // namespace postchain::stress

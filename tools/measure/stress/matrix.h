// The stability matrix: subjects x rows x cells x precisions, each cell with all its checks.
//
//   make_cells --> measure --> known limits --> Matrix --> text (here), page (page.h), JSON
//                                                          (postchain stress)
//
// A check outside its bound fails, unless it is among the known limits of a pass of the chain
// (limits.h), with a reason and a wider bound that the pass keeps: then it is a limit, and printed
// as one. Nothing else widens a bound.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/measure/stress/check.h"

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
    size_t count(Verdict verdict) const;  // checks
    size_t checks() const;
};

struct MatrixOptions {
    std::string only;      // cells whose name() matches; empty = all. See matches().
    bool reduced = false;  // the few cells of every row that tests can afford
    const KnownLimits* limits = &known_limits();
};

// Does the name match: `pattern` stands anywhere in it, and * in it for any text.
bool matches(std::string_view pattern, std::string_view name);

// Called before each cell, with how many are done of how many; false stops.
using MatrixProgress = std::function<bool(const std::string& name, size_t done, size_t of)>;

// Errors: usage (no cell matches), canceled, gl; chain when a subject cannot run on a frame.
Result<Matrix> run_matrix(Executor& executor, const std::vector<Subject>& subjects,
                          const MatrixOptions& options, const MatrixProgress& progress = {});

// The worst of one row, subject and check over its cells and precisions.
struct Worst {
    const CellResult* cell = nullptr;
    const Measured* measured = nullptr;
};
// By row and subject, in the order of the run; no entry where a check does not apply.
struct WorstLine {
    std::string row;
    std::string subject;
    std::map<std::string, Worst> checks;
};
std::vector<WorstLine> worst_of(const Matrix& matrix);

// What a run met of a known limit.
struct LimitUse {
    const KnownLimit* limit = nullptr;
    size_t checks = 0;
    Worst worst;
};
// In the order in which the run met them.
std::vector<LimitUse> limits_met(const Matrix& matrix);

// Three digits: enough to see which bound is missed by how much.
std::string number_text(double value);

// The worst of each row, subject and check; below it every check that failed, and every known limit
// that was met, with how often and its worst number.
std::string matrix_as_text(const Matrix& matrix);

}  // namespace postchain::stress

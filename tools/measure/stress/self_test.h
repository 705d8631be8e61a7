// The reduced matrix of one subject, as a line of `postchain selftest` and of tests/bench/gpu.sh.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/stress/matrix.h"

namespace postchain::stress {

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

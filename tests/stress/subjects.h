// Subjects of the stability matrix tests.
#pragma once

#include <string>
#include <vector>

#include "tools/stress/check.h"

namespace postchain::stress {

// Each registered pass separately, and the shipped chains `paper` and `dof_first`.
std::vector<Subject> every_pass_and_both_orders();

// The known limits of the passes of every_pass(): of the shipped ones, and of those of the tests.
const KnownLimits& every_limit();

// A shipped chain.
Subject shipped(const std::string& name);

// The cell of that name of make_cells(40, reduced); a failure if there is none.
const MatrixCell& find_cell(const std::string& name);

// The check of that name, or one with a bound of -1 if there is none.
const Measured& find_check(const std::vector<Measured>& all, const std::string& check);

}  // namespace postchain::stress

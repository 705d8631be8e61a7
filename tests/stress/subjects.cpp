#include "tests/stress/subjects.h"

#include <gtest/gtest.h>

#include "config/chain_file.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tests/support/gpu.h"

namespace postchain::stress {

Subject shipped(const std::string& name) {
    auto file = load_chain(name, builtin_passes());
    EXPECT_TRUE(file.ok() && file->status().ok()) << name;
    return {name, file.ok() ? std::move(file->chain) : Chain()};
}

std::vector<Subject> every_pass_and_both_orders() {
    std::vector<Subject> subjects;
    for (const auto& type : test::every_pass().types())
        subjects.push_back({type.name, test::chain_of(type.name)});
    for (const char* name : {"paper", "dof_first"}) subjects.push_back(shipped(name));
    return subjects;
}

const KnownLimits& every_limit() {
    static const KnownLimits limits = [] {
        KnownLimits all = known_limits();
        const char* const half = "it may be brighter than what a half holds";
        all["echo"] = {{"reference", "", "fp16", 0.35, half}, {"color", "", "clamped", 55, half}};
        return all;
    }();
    return limits;
}

const MatrixCell& find_cell(const std::string& name) {
    static const std::vector<MatrixCell> cells = make_cells(40, false);
    for (const MatrixCell& cell : cells)
        if (cell.name == name) return cell;
    ADD_FAILURE() << "no cell " << name;
    return cells.front();
}

const Measured& find_check(const std::vector<Measured>& all, const std::string& check) {
    for (const auto& one : all)
        if (one.check == check) return one;
    static const Measured none{"none", Verdict::ok, -1, -1, {}};
    return none;
}

}  // namespace postchain::stress

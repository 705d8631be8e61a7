#include "tools/measure/stress/self_test.h"

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace postchain::stress {
namespace {

std::string fault_text(const CellResult& cell, const Measured& measured) {
    return concat(measured.check, " ", number_text(measured.value), ", limit ",
                  number_text(measured.bound), " (", cell.row, ": ", cell.cell, ")",
                  measured.note.empty() ? "" : ", " + measured.note);
}

}  // namespace

TestRow test_subject(Executor& executor, Subject subject, const MatrixProgress& progress) {
    using Clock = std::chrono::steady_clock;
    TestRow row;
    row.name = subject.name;
    const auto start = Clock::now();
    std::vector<Subject> one;
    one.push_back(std::move(subject));
    MatrixOptions options;
    options.reduced = true;
    options.only = "/fp32";
    const auto matrix = run_matrix(executor, one, options, progress);
    row.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (!matrix.ok()) {
        row.faults.push_back(matrix.status().message());
        return row;
    }
    row.frames = matrix->cells.size();
    for (const auto& cell : matrix->cells)
        for (const auto& measured : cell.measured) {
            if (measured.check == "reference" && measured.value >= row.reference) {
                row.reference = measured.value;
                row.bound = measured.bound;
            }
            if (measured.verdict == Verdict::failed)
                row.faults.push_back(fault_text(cell, measured));
        }
    return row;
}

void print_heads() {
    std::printf("%-15s %-6s %7s  %-10s %-10s %9s\n", "test", "", "frames", "reference", "limit",
                "time");
}

void print_row(const TestRow& row) {
    char text[160];
    const bool compared = row.bound > 0;
    std::snprintf(text, sizeof(text), "%-15s %-6s %7zu  %-10s %-10s %7.1f s\n", row.name.c_str(),
                  row.faults.empty() ? "ok" : "FAILED", row.frames,
                  compared ? number_text(row.reference).c_str() : "-",
                  compared ? number_text(row.bound).c_str() : "-", row.seconds);
    std::fputs(text, stdout);
    constexpr size_t kShown = 3;
    for (size_t i = 0; i < std::min(kShown, row.faults.size()); ++i)
        std::printf("    %s\n", row.faults[i].c_str());
    if (row.faults.size() > kShown) std::printf("    and %zu more\n", row.faults.size() - kShown);
}

}  // namespace postchain::stress

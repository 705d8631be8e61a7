#include "tools/stress/matrix.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <sstream>

#include "tools/stress/limits.h"

namespace postchain::stress {

std::string CellResult::name() const {
    return subject + "/" + row + "/" + cell + "/" + postchain::name_of(precision);
}

size_t Matrix::count(Verdict verdict) const {
    size_t count = 0;
    for (const auto& cell : cells)
        for (const auto& one : cell.measured) count += one.verdict == verdict;
    return count;
}

size_t Matrix::checks() const {
    size_t count = 0;
    for (const auto& cell : cells) count += cell.measured.size();
    return count;
}

bool matches(std::string_view pattern, std::string_view name) {
    size_t from = 0;
    while (!pattern.empty()) {
        const size_t star = pattern.find('*');
        const std::string_view part = pattern.substr(0, star);
        const size_t at = name.find(part, from);
        if (at == std::string_view::npos) return false;
        from = at + part.size();
        if (star == std::string_view::npos) break;
        pattern.remove_prefix(star + 1);
    }
    return true;
}

Result<Matrix> run_matrix(Executor& executor, const std::vector<Subject>& subjects,
                          const MatrixOptions& options, const MatrixProgress& progress) {
    struct Task {
        const Subject* subject;
        std::shared_ptr<const MatrixCell> cell;  // shared by both precisions
        CellResult result;
    };
    std::vector<Task> tasks;
    std::vector<Subject> prepared;
    for (const auto& subject : subjects)
        prepared.push_back(with_cells_camera({subject.name, subject.chain.clone()}));
    for (const auto& subject : prepared) {
        for (MatrixCell& made : make_cells(tile_px(subject.chain), options.reduced)) {
            const auto cell = std::make_shared<const MatrixCell>(std::move(made));
            for (Precision precision : {Precision::fp32, Precision::fp16}) {
                CellResult result;
                result.subject = subject.name;
                result.row = cell->row;
                result.cell = cell->name;
                result.precision = precision;
                result.chain = subject.chain.text();
                if (matches(options.only, result.name()))
                    tasks.push_back({&subject, cell, std::move(result)});
            }
        }
    }
    if (tasks.empty())
        return Status(StatusCode::usage, "no cell matches '" + options.only +
                                             "'; names are CHAIN/ROW/CELL/PRECISION, as in "
                                             "paper/speed/all 1 px/fp16");
    Matrix matrix;
    for (Task& task : tasks) {
        const std::string name = task.result.name();
        if (progress && !progress(name, matrix.cells.size(), tasks.size()))
            return Status(StatusCode::canceled, "stopped at " + name);
        auto measured = measure(executor, *task.subject, *task.cell, task.result.precision);
        if (!measured.ok()) return measured.status().at(name);
        task.result.measured = std::move(measured->checks);
        task.result.bits = measured->bits;
        apply_known_limits(task.subject->chain, task.result, *options.limits);
        matrix.cells.push_back(std::move(task.result));
    }
    return matrix;
}

namespace {

// For equal verdicts, the larger fraction of the bound is worse; NaN is the worst.
bool is_worse(const Measured& a, const Measured& b) {
    if (a.verdict != b.verdict) return a.verdict > b.verdict;
    const bool parts = a.bound > 0 && b.bound > 0;
    const double va = parts ? a.value / a.bound : a.value;
    const double vb = parts ? b.value / b.bound : b.value;
    return !(va <= vb) && !std::isnan(vb);
}

std::string fault_text(const CellResult& cell, const Measured& measured) {
    return concat(measured.check, " ", number_text(measured.value), ", limit ",
                  number_text(measured.bound), " (", cell.row, ": ", cell.cell, ")",
                  measured.note.empty() ? "" : ", " + measured.note);
}

std::string padded(std::string text, size_t width) {
    text.resize(std::max(width, text.size()), ' ');
    return text + "  ";
}

}  // namespace

std::string number_text(double value) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(3);
    out << value;
    return out.str();
}

std::vector<WorstLine> worst_of(const Matrix& matrix) {
    std::vector<WorstLine> lines;
    std::map<std::pair<std::string, std::string>, size_t> places;
    for (const auto& cell : matrix.cells) {
        const auto [place, is_new] = places.try_emplace({cell.row, cell.subject}, lines.size());
        if (is_new) lines.push_back({cell.row, cell.subject, {}});
        for (const auto& one : cell.measured) {
            Worst& worst = lines[place->second].checks[one.check];
            if (worst.measured && !is_worse(one, *worst.measured)) continue;
            worst = {&cell, &one};
        }
    }
    return lines;
}

std::vector<LimitUse> limits_met(const Matrix& matrix) {
    std::vector<LimitUse> uses;
    for (const auto& cell : matrix.cells) {
        for (const auto& one : cell.measured) {
            if (!one.limit) continue;
            auto use = std::ranges::find(uses, one.limit, &LimitUse::limit);
            if (use == uses.end()) use = uses.insert(use, {one.limit, 0, {}});
            ++use->checks;
            if (!use->worst.measured || one.value > use->worst.measured->value)
                use->worst = {&cell, &one};
        }
    }
    return uses;
}

namespace {

std::string aligned(const std::vector<std::vector<std::string>>& table) {
    std::vector<size_t> widths(table[0].size());
    for (const auto& line : table)
        for (size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], line[i].size());
    std::string text;
    for (const auto& line : table) {
        std::string row;
        for (size_t i = 0; i < line.size(); ++i) row += padded(line[i], widths[i]);
        text += row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
    }
    return text;
}

// Upper median and largest value over the cells of each chain and precision.
std::string numbers_text(const Matrix& matrix) {
    const std::vector<const char*> checks = {"reference", "color", "motion", "depth", "noise"};
    std::map<std::pair<std::string, std::string>, std::map<std::string, std::vector<double>>> found;
    for (const auto& cell : matrix.cells)
        for (const auto& one : cell.measured)
            found[{cell.subject, postchain::name_of(cell.precision)}][one.check].push_back(
                one.value);
    std::vector<std::vector<std::string>> table = {{"chain", "precision"}};
    table[0].insert(table[0].end(), checks.begin(), checks.end());
    for (auto& [name, values_of] : found) {
        table.push_back({name.first, name.second});
        for (const char* check : checks) {
            std::vector<double>& values = values_of[check];
            std::ranges::sort(values);
            table.back().push_back(values.empty() ? "-"
                                                  : concat(number_text(values[values.size() / 2]),
                                                           " to ", number_text(values.back())));
        }
    }
    return "\nerror against the double-precision reference, and condition numbers: median to "
           "largest of the cells\n" +
           aligned(table);
}

}  // namespace

std::string matrix_as_text(const Matrix& matrix) {
    std::vector<std::vector<std::string>> table = {{"row", "chain"}};
    for (const auto& check : check_names()) table[0].push_back(check);
    for (const auto& line : worst_of(matrix)) {
        table.push_back({line.row, line.subject});
        for (const auto& check : check_names()) {
            const auto found = line.checks.find(check);
            if (found == line.checks.end()) {
                table.back().push_back("-");
                continue;
            }
            const Measured& one = *found->second.measured;
            std::string word = name_of(one.verdict);
            if (one.verdict != Verdict::ok) word += " " + number_text(one.value);
            table.back().push_back(word);
        }
    }
    std::string text = aligned(table) + numbers_text(matrix);
    for (const auto& cell : matrix.cells)
        for (const auto& one : cell.measured)
            if (one.verdict == Verdict::failed)
                text += concat("\n", name_of(one.verdict), " ", cell.name(), ": ", one.check, " ",
                               number_text(one.value), ", bound ", number_text(one.bound), "; ",
                               one.note);
    if (matrix.count(Verdict::failed)) text += '\n';
    for (const auto& use : limits_met(matrix))
        text += concat("\nlimit ", use.limit->check, " ", use.checks, " times, worst ",
                       number_text(use.worst.measured->value), " (bound ",
                       number_text(use.limit->bound), ") in ", use.worst.cell->name(), ": ",
                       use.limit->reason);
    if (matrix.count(Verdict::limit)) text += '\n';
    return text + concat("\n", matrix.cells.size(), " cells, ", matrix.checks(),
                         " checks: ", matrix.count(Verdict::ok), " ok, ",
                         matrix.count(Verdict::limit), " known limits, ",
                         matrix.count(Verdict::failed), " failed\n");
}

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

#include "tools/stress/matrix.h"

#include <algorithm>
#include <map>
#include <memory>
#include <sstream>

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
        std::shared_ptr<const Cell> cell;  // of both precisions
        CellResult result;
    };
    std::vector<Task> tasks;
    std::vector<Subject> prepared;
    for (const auto& subject : subjects)
        prepared.push_back(with_cells_camera({subject.name, subject.chain.clone()}));
    for (const auto& subject : prepared) {
        for (Cell& made : make_cells(tile_px(subject.chain), options.reduced)) {
            const auto cell = std::make_shared<const Cell>(std::move(made));
            for (Precision precision : {Precision::fp32, Precision::fp16}) {
                CellResult result{subject.name, cell->row, cell->name, precision, {}};
                if (matches(options.only, result.name()))
                    tasks.push_back({&subject, cell, std::move(result)});
            }
        }
    }
    if (tasks.empty())
        return Status(StatusCode::usage, "no cell matches '" + options.only +
                                             "'; names read CHAIN/ROW/CELL/PRECISION, as in "
                                             "paper/speed/all 1 px/fp16");
    Matrix matrix;
    for (Task& task : tasks) {
        const std::string name = task.result.name();
        if (progress && !progress(name, matrix.cells.size(), tasks.size()))
            return Status(StatusCode::cancelled, "stopped at " + name);
        auto measured = measure(executor, *task.subject, *task.cell, task.result.precision);
        if (!measured.ok()) return measured.status().at(name);
        task.result.measured = std::move(*measured);
        apply_known_limits(task.result);
        matrix.cells.push_back(std::move(task.result));
    }
    return matrix;
}

namespace {

std::string padded(std::string text, size_t width) {
    text.resize(std::max(width, text.size()), ' ');
    return text + "  ";
}

// Three digits are enough to see which bound is missed by how much.
std::string number(double value) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(3);
    out << value;
    return out.str();
}

// The worst of one row, subject and check over its cells and precisions.
struct Worst {
    Verdict verdict = Verdict::ok;
    double excess = 0;  // value - bound, of verdicts alike
    double value = 0;
    bool seen = false;
};

}  // namespace

std::string matrix_as_text(const Matrix& matrix) {
    std::vector<std::pair<std::string, std::string>> lines;  // row, subject; in order
    std::map<std::pair<std::string, std::string>, std::map<std::string, Worst>> table;
    size_t row_width = 3, subject_width = 5;
    for (const auto& cell : matrix.cells) {
        const std::pair key(cell.row, cell.subject);
        if (!table.count(key)) lines.push_back(key);
        row_width = std::max(row_width, cell.row.size());
        subject_width = std::max(subject_width, cell.subject.size());
        for (const auto& one : cell.measured) {
            Worst& worst = table[key][one.check];
            const double excess = one.value - one.bound;
            if (worst.seen && (one.verdict < worst.verdict ||
                               (one.verdict == worst.verdict && !(excess > worst.excess))))
                continue;
            worst = {one.verdict, excess, one.value, true};
        }
    }
    constexpr size_t kColumn = 12;
    std::string text = padded("row", row_width) + padded("chain", subject_width);
    for (const auto& check : check_names()) text += padded(check, kColumn);
    text += '\n';
    for (const auto& key : lines) {
        text += padded(key.first, row_width) + padded(key.second, subject_width);
        for (const auto& check : check_names()) {
            const Worst& worst = table[key][check];
            std::string word = worst.seen ? name_of(worst.verdict) : "-";
            if (worst.verdict != Verdict::ok) word += " " + number(worst.value);
            text += padded(word, kColumn);
        }
        text += '\n';
    }
    for (Verdict verdict : {Verdict::failed, Verdict::limit}) {
        for (const auto& cell : matrix.cells)
            for (const auto& one : cell.measured)
                if (one.verdict == verdict)
                    text +=
                        concat("\n", name_of(verdict), " ", cell.name(), ": ", one.check, " ",
                               number(one.value), ", bound ", number(one.bound), "; ", one.note);
        if (matrix.count(verdict)) text += '\n';
    }
    return text + concat("\n", matrix.cells.size(), " cells, ", matrix.checks(),
                         " checks: ", matrix.count(Verdict::ok), " ok, ",
                         matrix.count(Verdict::limit), " known limits, ",
                         matrix.count(Verdict::failed), " failed\n");
}

}  // namespace postchain::stress

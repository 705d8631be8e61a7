#include "tools/measure/stress/page.h"

#include <map>

#include "tools/page/page.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/png.h"

namespace postchain::stress {
namespace {

using io::Json;

// A failure or limit: one check of one cell, with its pictures.
Json entry_of(const CellResult& cell, const Measured& measured,
              const std::vector<ImagedCheck>& imaged) {
    Json place, pictures = Json::array();
    for (const ImagedCheck& shown : imaged) {
        if (shown.measured != &measured) continue;
        place = shown.place;
        for (const Picture& picture : shown.pictures)
            pictures.push_back({{"title", picture.title},
                                {"scale", picture.scale},
                                {"png", io::base64_of(picture.png)},
                                {"width", picture.width},
                                {"height", picture.height}});
    }
    return {{"cell", cell.name()},
            {"check", measured.check},
            {"value", number_text(measured.value)},
            {"bound", number_text(measured.bound)},
            {"note", measured.note},
            {"place", place},
            {"pictures", pictures}};
}

// Numbers are texts of three digits. `entry` of a check of a row is the index of the failure or
// limit that it shows.
Json json_of(const Matrix& matrix, const std::vector<ImagedCheck>& imaged, const PageFacts& facts) {
    std::map<const Measured*, size_t> failed;
    Json failures = Json::array();
    for (const CellResult& cell : matrix.cells)
        for (const Measured& one : cell.measured)
            if (one.verdict == Verdict::failed) {
                failed.emplace(&one, failures.size());
                failures.push_back(entry_of(cell, one, imaged));
            }

    std::map<const KnownLimit*, size_t> met;
    Json limits = Json::array();
    for (const LimitUse& use : limits_met(matrix)) {
        Json entry = entry_of(*use.worst.cell, *use.worst.measured, imaged);
        entry["limit"] = {{"check", use.limit->check},
                          {"bound", number_text(use.limit->bound)},
                          {"reason", use.limit->reason},
                          {"times", use.checks}};
        met.emplace(use.limit, limits.size());
        limits.push_back(std::move(entry));
    }

    Json checks = Json::array();
    for (const auto& row : check_rows()) checks.push_back({{"name", row.name}, {"help", row.help}});

    Json rows = Json::array();
    for (const WorstLine& line : worst_of(matrix)) {
        Json cells = Json::object();
        for (const auto& [check, worst] : line.checks) {
            const Measured& one = *worst.measured;
            Json cell = {{"cell", worst.cell->name()},
                         {"value", number_text(one.value)},
                         {"bound", number_text(one.bound)},
                         {"verdict", name_of(one.verdict)}};
            if (one.verdict == Verdict::failed) cell["entry"] = failed.at(&one);
            if (one.verdict == Verdict::limit) cell["entry"] = met.at(one.limit);
            cells[check] = std::move(cell);
        }
        rows.push_back({{"subject", line.subject}, {"row", line.row}, {"checks", cells}});
    }

    return {{"version", facts.version},
            {"renderer", facts.renderer},
            {"command", facts.command},
            {"cells", matrix.cells.size()},
            {"checked", matrix.checks()},
            {"ok", matrix.count(Verdict::ok)},
            {"limited", matrix.count(Verdict::limit)},
            {"pictured_at_most", kMaxImaged},
            {"checks", checks},
            {"rows", rows},
            {"failures", failures},
            {"limits", limits}};
}

}  // namespace

std::string matrix_as_page(const Matrix& matrix, const std::vector<ImagedCheck>& imaged,
                           const PageFacts& facts) {
    return page::with_data("stress/page.html", io::json_text(json_of(matrix, imaged, facts)));
}

}  // namespace postchain::stress

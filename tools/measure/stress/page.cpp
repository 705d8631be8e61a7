#include "tools/measure/stress/page.h"

#include <algorithm>
#include <cmath>

#include "shaders/embedded.h"
#include "tools/sequence/image/png.h"

namespace postchain {
const std::vector<EmbeddedFile>& embedded_stress_page();
}

namespace postchain::stress {
namespace {

constexpr int kShownWidth = 320;  // CSS pixels to which pictures grow, in whole steps
constexpr int kMostSteps = 64;

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

void replace_all(std::string& text, const std::string& mark, const std::string& with) {
    for (size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += with.size())
        text.replace(at, mark.size(), with);
}

std::string as_data_uri(const std::string& png) {
    return "data:image/png;base64," + io::base64_of(png);
}

class Page {
  public:
    Page(const Matrix& matrix, const std::vector<PicturedCheck>& pictured)
        : matrix_(matrix), pictured_(pictured), uses_(limits_met(matrix)) {
        for (const auto& cell : matrix.cells)
            for (const auto& one : cell.measured)
                if (one.verdict == Verdict::failed) failures_.push_back({&cell, &one});
    }

    std::string verdict() const {
        return concat(matrix_.cells.size(), " cells, ", matrix_.checks(),
                      " checks: ", matrix_.count(Verdict::ok), " ok, ",
                      matrix_.count(Verdict::limit), " known limits, <strong>", failures_.size(),
                      " failed</strong>");
    }

    std::string main() {
        table();
        failures();
        limits();
        checks();
        return std::move(html_);
    }

  private:
    void table() {
        html_ +=
            "<h2 id=\"table\">Worst of each row, chain and check</h2>\n"
            "<p>Over the cells of the row and both precisions, the value that is furthest "
            "beyond its bound, or nearest to it. <em>limit</em>: outside the bound, known, "
            "inside a bound of its own. A dash: the check does not apply.</p>\n"
            "<div class=\"scroll\" role=\"region\" aria-labeledby=\"table\" tabindex=\"0\">"
            "<table class=\"matrix\"><thead><tr><th scope=\"col\">row</th>";
        for (const auto& check : check_names())
            html_ += "<th scope=\"col\"><a href=\"#check-" + check + "\">" + check + "</a></th>";
        html_ += "</tr></thead>\n";
        std::string subject;
        for (const auto& line : worst_of(matrix_)) {
            if (line.subject != subject) {
                if (!subject.empty()) html_ += "</tbody>\n";
                subject = line.subject;
                html_ += concat("<tbody><tr><th scope=\"rowgroup\">", escaped(subject), "</th><td",
                                " colspan=\"", check_names().size(), "\"></td></tr>\n");
            }
            html_ += "<tr><th scope=\"row\">" + escaped(line.row) + "</th>";
            for (const auto& check : check_names()) html_ += worst_cell(line, check);
            html_ += "</tr>\n";
        }
        html_ += "</tbody></table></div>\n";
    }

    std::string worst_cell(const WorstLine& line, const std::string& check) const {
        const auto found = line.checks.find(check);
        if (found == line.checks.end())
            return "<td class=\"none\"><span aria-hidden=\"true\">–</span>"
                   "<span class=\"sr\">does not apply</span></td>";
        const Measured& one = *found->second.measured;
        const std::string value = number_text(one.value);
        const std::string title =
            escaped(concat(found->second.cell->name(), ", bound ", number_text(one.bound)));
        if (one.verdict == Verdict::ok) return "<td title=\"" + title + "\">" + value + "</td>";
        const bool failed = one.verdict == Verdict::failed;
        return concat("<td class=\"", failed ? "fail" : "limit", "\" title=\"", title,
                      "\"><a href=\"#", failed ? anchor_of(&one) : limit_anchor(one.limit), "\">",
                      name_of(one.verdict), " ", value, "</a></td>");
    }

    std::string anchor_of(const Measured* failure) const {
        for (size_t i = 0; i < failures_.size(); ++i)
            if (failures_[i].measured == failure) return concat("fail-", i + 1);
        return "failures";
    }
    std::string limit_anchor(const KnownLimit* limit) const {
        for (size_t i = 0; i < uses_.size(); ++i)
            if (uses_[i].limit == limit) return concat("limit-", i + 1);
        return "limits";
    }

    void checks() {
        html_ +=
            "<h2 id=\"checks\">Checks</h2>\n<div class=\"scroll\" role=\"region\" "
            "aria-labeledby=\"checks\" tabindex=\"0\"><table><thead><tr>"
            "<th scope=\"col\">check</th><th scope=\"col\" style=\"text-align: left\">value"
            "</th></tr></thead><tbody>\n";
        for (const auto& row : check_rows())
            html_ += concat("<tr id=\"check-", row.name, "\"><th scope=\"row\">", row.name,
                            "</th><td class=\"text\">", escaped(row.help), "</td></tr>\n");
        html_ += "</tbody></table></div>\n";
    }

    void failures() {
        html_ += concat("<h2 id=\"failures\">Failures (", failures_.size(), ")</h2>\n");
        if (failures_.empty()) html_ += "<p>None.</p>\n";
        if (failures_.size() > kMaxPictured)
            html_ += concat("<p>The first ", kMaxPictured, " are shown with pictures.</p>\n");
        for (size_t i = 0; i < failures_.size(); ++i) {
            const auto& [cell, one] = failures_[i];
            entry("fail", concat("fail-", i + 1),
                  concat(cell->name(), ": ", one->check, " ", number_text(one->value), ", bound ",
                         number_text(one->bound)),
                  one->note, one);
        }
    }

    void limits() {
        html_ += concat("<h2 id=\"limits\">Known limits (", uses_.size(), ")</h2>\n");
        html_ += uses_.empty() ? "<p>None was met.</p>\n" : "<p>Each with its worst cell.</p>\n";
        for (size_t i = 0; i < uses_.size(); ++i) {
            const LimitUse& use = uses_[i];
            entry("limit", concat("limit-", i + 1),
                  concat(use.limit->check, " ", number_text(use.worst.measured->value), ", bound ",
                         number_text(use.limit->bound), " in place of ",
                         number_text(use.worst.measured->bound), ": ", use.worst.cell->name()),
                  concat(use.limit->reason, ". Met ", use.checks,
                         use.checks == 1 ? " time. " : " times. ",
                         "Here: ", use.worst.measured->note, "."),
                  use.worst.measured);
        }
    }

    void entry(const char* kind, const std::string& id, const std::string& title,
               const std::string& note, const Measured* measured) {
        html_ += concat("<section class=\"entry ", kind, "\" id=\"", id, "\">\n<h3>",
                        escaped(title), "</h3>\n<p>", escaped(note), "</p>\n");
        for (const auto& shown : pictured_) {
            if (shown.measured != measured) continue;
            if (!shown.place.empty())
                html_ += "<p class=\"quiet\">Shown: " + escaped(shown.place) + ".</p>\n";
            html_ += "<div class=\"pictures\">\n";
            for (const auto& picture : shown.pictures) figure(picture, *shown.cell, *measured);
            html_ += "</div>\n";
        }
        html_ += "</section>\n";
    }

    void figure(const Picture& picture, const CellResult& cell, const Measured& measured) {
        const int steps = std::clamp(kShownWidth / std::max(picture.width, 1), 1, kMostSteps);
        html_ += concat("<figure><img loading=\"lazy\" width=\"", picture.width * steps,
                        "\" height=\"", picture.height * steps, "\" alt=\"",
                        escaped(concat(picture.title, " of ", cell.name(), ", ", measured.check,
                                       "; ", picture.scale)),
                        "\" src=\"", as_data_uri(picture.png), "\"><figcaption><b>",
                        escaped(picture.title), "</b><br>", escaped(picture.scale), ", ",
                        picture.width, " x ", picture.height, " px</figcaption></figure>\n");
    }

    struct Failure {
        const CellResult* cell;
        const Measured* measured;
    };
    const Matrix& matrix_;
    const std::vector<PicturedCheck>& pictured_;
    std::vector<LimitUse> uses_;
    std::vector<Failure> failures_;
    std::string html_;
};

}  // namespace

std::string matrix_as_page(const Matrix& matrix, const std::vector<PicturedCheck>& pictured,
                           const PageFacts& facts) {
    Page page(matrix, pictured);
    std::string html(embedded_stress_page().front().text);
    replace_all(html, "<!--TITLE-->", "Stability of postchain " + escaped(facts.version));
    replace_all(html, "<!--VERDICT-->", page.verdict());
    replace_all(html, "<!--FACTS-->",
                "<code>" + escaped(facts.command) + "</code><br>" + escaped(facts.renderer));
    replace_all(html, "<!--MAIN-->", page.main());
    return html;
}

}  // namespace postchain::stress

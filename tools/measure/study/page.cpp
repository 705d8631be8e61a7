#include "tools/measure/study/page.h"

#include <algorithm>
#include <cmath>

#include "shaders/embedded.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/run/frame_task.h"

namespace postchain {
const std::vector<EmbeddedFile>& embedded_study_page();
}

namespace postchain::study {
namespace {

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '"')
            out += "&quot;";
        else
            out += c;
    }
    return out;
}

std::string number(const std::optional<double>& value) {
    return value ? report::figure(*value) : "";
}

void replace_all(std::string& text, const std::string& mark, const std::string& with) {
    for (size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += with.size())
        text.replace(at, mark.size(), with);
}

// Gains of one pair: a line for each family, the mean with its interval below, and a line at 0.
class GainPlot {
  public:
    GainPlot(const MetricTable& table, size_t pair, const std::string& a, const std::string& b)
        : table_(table), pair_(pair), a_(a), b_(b) {
        double most = 0;
        for (const Row& family : table.families)
            if (family.gains[pair]) most = std::max(most, std::abs(*family.gains[pair]));
        if (const auto& interval = table.pairs[pair].interval)
            most = std::max({most, std::abs(interval->low), std::abs(interval->high)});
        scale_ = most > 0 ? kHalf / most : 1;
    }

    std::string svg() {
        size_t lines = 1;
        for (const Row& family : table_.families) lines += family.gains[pair_].has_value();
        const int height = kTop + int(lines) * kLine + 8;
        std::string text =
            concat("<svg width=\"", kWidth, "\" height=\"", height, "\" viewBox=\"0 0 ", kWidth,
                   " ", height, "\" role=\"img\" aria-label=\"gain of ", escaped(b_), " over ",
                   escaped(a_), "\">\n");
        text += label(kMiddle - 8, 16, "end", "&#8592; " + escaped(a_) + " nearer", "quiet");
        text += label(kMiddle + 8, 16, "start", escaped(b_) + " nearer &#8594;", "quiet");
        text += concat("<line x1=\"", kMiddle, "\" x2=\"", kMiddle, "\" y1=\"", kTop - 6,
                       "\" y2=\"", height - 4, "\" stroke=\"var(--quiet)\"/>\n");
        int y = kTop + 8;
        for (const Row& family : table_.families) {
            if (!family.gains[pair_]) continue;
            text += label(8, y + 4, "start", escaped(family.name), "");
            text += dot(*family.gains[pair_], y, 4, "var(--accent)");
            text += label(kWidth - 8, y + 4, "end", number(family.gains[pair_]), "quiet");
            y += kLine;
        }
        const PairResult& result = table_.pairs[pair_];
        if (result.mean) {
            text += label(8, y + 4, "start", "mean, 95 %", "");
            if (result.interval)
                text += concat("<line x1=\"", at(result.interval->low), "\" x2=\"",
                               at(result.interval->high), "\" y1=\"", y, "\" y2=\"", y,
                               "\" stroke=\"var(--text)\" stroke-width=\"2\"/>\n");
            text += dot(*result.mean, y, 6, "var(--text)");
            text += label(kWidth - 8, y + 4, "end", number(result.mean), "");
        }
        return text + "</svg>\n";
    }

  private:
    static constexpr int kWidth = 760, kMiddle = 400, kHalf = 220, kTop = 30, kLine = 20;

    // In whole pixels: the same text whatever the last bits are.
    int at(double gain) const { return kMiddle + int(std::lround(gain * scale_)); }
    std::string dot(double gain, int y, int radius, const char* fill) const {
        return concat("<circle cx=\"", at(gain), "\" cy=\"", y, "\" r=\"", radius, "\" fill=\"",
                      fill, "\"/>\n");
    }
    static std::string label(int x, int y, const char* anchor, const std::string& text,
                             const char* kind) {
        return concat("<text x=\"", x, "\" y=\"", y, "\" text-anchor=\"", anchor, "\" class=\"",
                      kind, "\">", text, "</text>\n");
    }

    const MetricTable& table_;
    const size_t pair_;
    const std::string &a_, &b_;
    double scale_ = 1;
};

class Page {
  public:
    explicit Page(const StudyReport& report) : report_(report) {}

    std::string body() {
        verdict();
        overview();
        plots();
        scenes();
        for (const auto& table : report_.tables) metric(table);
        chains();
        text_ += "<h2>Notes</h2>\n<ul>\n";
        for (const auto& note : report_.notes) text_ += "<li>" + escaped(note) + "</li>\n";
        return text_ + "</ul>\n";
    }

  private:
    void verdict() {
        const size_t failed = report_.failures();
        text_ +=
            concat("<p class=\"quiet\">", report::counted(report_.scenes.size() - failed, "scene"),
                   " measured", failed ? concat(", ", failed, " failed") : "", ", postchain ",
                   escaped(report_.version),
                   ". <a href=\"report.json\">report.json</a>, <a "
                   "href=\"report.csv\">report.csv</a>, <a "
                   "href=\"report.md\">report.md</a></p>\n<ul>\n");
        for (const auto& line : report_.verdict()) text_ += "<li>" + escaped(line) + "</li>\n";
        text_ += "</ul>\n";
        for (const auto& scene : report_.scenes)
            if (!scene.failure.empty())
                text_ += "<p class=\"failed\">Failed: " + escaped(scene.name) + ": " +
                         escaped(scene.failure) + "</p>\n";
    }

    // Means of every variant by every metric.
    void overview() {
        text_ += "<h2>Mean over families</h2>\n<div class=\"wide\"><table>\n<tr><th>metric</th>";
        for (const auto& name : report_.variants) text_ += "<th>" + escaped(name) + "</th>";
        for (size_t p = 0; p < report_.pairs.size(); ++p)
            text_ += "<th>" + escaped(report_.pair_name(p)) + "</th>";
        text_ += "</tr>\n";
        for (const auto& table : report_.tables) {
            text_ += "<tr><td title=\"" + escaped(table.metric.help) + "\">" +
                     escaped(table.metric.name) + "<span class=\"way\">" +
                     report::words_of(table.metric.better) + "</span></td>";
            values(table, table.means);
            for (const auto& one : table.pairs) text_ += "<td>" + gain(one) + "</td>";
            text_ += "</tr>\n";
        }
        text_ +=
            "</table></div>\n<p class=\"quiet\">Blue: the nearest to the truth. Under each "
            "question the gain (how much nearer to the truth the first named is, whichever way the "
            "metric runs), its 95 % interval, and the families in which the first named is "
            "nearer. The interval says how far the mean of these families may be from the mean "
            "over many families of this kind; one that contains 0 leaves the question "
            "open.</p>\n";
    }

    static std::string gain(const PairResult& one) {
        if (!one.mean) return "";
        std::string text = report::figure(*one.mean);
        if (one.interval)
            text += concat(" (", report::figure(one.interval->low, 3), " to ",
                           report::figure(one.interval->high, 3), ")");
        text =
            concat(text, ", <span class=\"count\">", one.nearer, " of ", one.families, "</span>");
        const bool decided = one.decision == Decision::a || one.decision == Decision::b;
        return decided ? "<b>" + text + "</b>" : text;
    }

    void values(const MetricTable& table, const Values& means) {
        const size_t none = means.size();
        size_t best = none;
        for (size_t v = 0; v < means.size(); ++v)
            if (means[v] &&
                (best == none || gain_of(table.metric.better, *means[best], *means[v]) > 0))
                best = v;
        // Of values that are all the same none is the best.
        if (std::all_of(means.begin(), means.end(), [&](const auto& v) { return v == means[0]; }))
            best = none;
        for (size_t v = 0; v < means.size(); ++v)
            text_ += (best == v ? "<td class=\"best\">" : "<td>") + number(means[v]) + "</td>";
    }

    void plots() {
        const MetricTable* table = report_.table("hdr_flip");
        if (!table) return;
        text_ += "<h2>Gains of HDR-FLIP by family</h2>\n";
        for (size_t p = 0; p < report_.pairs.size(); ++p)
            text_ += GainPlot(*table, p, report_.variants[report_.pairs[p].first],
                              report_.variants[report_.pairs[p].second])
                         .svg();
    }

    void scenes() {
        text_ +=
            "<h2>Scenes</h2>\n<div class=\"wide\"><table>\n<tr><th>scene</th><th "
            "class=\"left\">family</th><th>frames</th><th>size</th><th class=\"left\">truth"
            "</th><th class=\"left\">reports</th></tr>\n";
        for (const auto& scene : report_.scenes) {
            text_ += "<tr><td>" + escaped(scene.name) + "</td><td class=\"left\">" +
                     escaped(scene.family) + "</td>";
            if (!scene.failure.empty()) {
                text_ += "<td class=\"left failed\" colspan=\"4\">failed</td></tr>\n";
                continue;
            }
            text_ += "<td>" + escaped(sequence::frames_text(scene.frames)) + "</td><td>" +
                     concat(scene.width, "x", scene.height) + "</td><td class=\"left\">" +
                     escaped(scene.truth) + "</td><td class=\"left\">";
            for (size_t i = 0; i < scene.reports.size(); ++i)
                text_ +=
                    (i ? ", " : "") + ("<a href=\"" + escaped(scene.reports[i]) + "\">") +
                    escaped(report_.kind == report::Kind::ab ? report_.pair_name(i) : "report") +
                    "</a>";
            text_ += "</td></tr>\n";
        }
        text_ += "</table></div>\n";
    }

    void row(const MetricTable& table, const std::string& kind, const std::string& name,
             const Row& row) {
        text_ += "<tr class=\"" + kind + "\"><td>" + escaped(name) + "</td>";
        values(table, row.means);
        for (const auto& value : row.gains) text_ += "<td>" + number(value) + "</td>";
        text_ += "</tr>\n";
    }

    void metric(const MetricTable& table) {
        text_ += concat("<details", table.metric.name == "hdr_flip" ? " open" : "", "><summary><b>",
                        escaped(table.metric.name), "</b> ", escaped(table.metric.help), " (",
                        report::words_of(table.metric.better), ")",
                        "</summary>\n<div class=\"wide\"><table>\n<tr><th>scene</th>");
        for (const auto& name : report_.variants) text_ += "<th>" + escaped(name) + "</th>";
        for (size_t p = 0; p < report_.pairs.size(); ++p)
            text_ += "<th>gain of " + escaped(report_.pair_name(p)) + "</th>";
        text_ += "</tr>\n";
        for (const Row& family : table.families) {
            for (const Row& scene : table.scenes)
                if (scene.family == family.name) row(table, "scene", scene.name, scene);
            if (family.scenes > 1)
                row(table, "family",
                    concat("mean of ", family.name, ", ", report::counted(family.scenes, "scene")),
                    family);
        }
        Row mean{"", "", 0, table.means, {}};
        for (const PairResult& one : table.pairs) mean.gains.push_back(one.mean);
        row(table, "mean", "mean over families", mean);
        text_ += "</table></div></details>\n";
    }

    void chains() {
        text_ += "<h2>Chains</h2>\n";
        for (size_t v = 0; v < report_.variants.size(); ++v)
            text_ += "<details><summary>" + escaped(report_.variants[v]) + "</summary><pre>" +
                     escaped(report_.chain_texts[v]) + "</pre></details>\n";
    }

    const StudyReport& report_;
    std::string text_;
};

}  // namespace

std::string page_of(const StudyReport& report) {
    std::string page(embedded_study_page().front().text);
    const std::string body = Page(report).body();
    replace_all(page, "<!--TITLE-->", escaped(report.title));
    replace_all(page, "<!--BODY-->", body);
    return page;
}

}  // namespace postchain::study

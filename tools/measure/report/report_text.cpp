#include "tools/measure/report/report_text.h"

#include <set>

#include "chain/base/printable.h"
#include "config/markdown.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::report {
namespace {

std::string number(const std::optional<double>& value, int digits) {
    return value ? figure(*value, digits) : "";
}

// A text field after RFC 4180. An apostrophe precedes text that a spreadsheet would read as a
// formula.
std::string field(const std::string& name) {
    const bool formula =
        !name.empty() && std::string("=+-@\t\r").find(name[0]) != std::string::npos;
    const std::string text = printable(formula ? "'" + name : name);
    if (text.find_first_of(",\"") == std::string::npos) return text;
    std::string quoted = "\"";
    for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

std::string csv_times(const Variant& variant) {
    if (!variant.timing) return ",,,";
    return "," + number(variant.timing->total.median_ms, 9) + "," +
           number(variant.timing->total.spread_ms, 9) + "," +
           (variant.timing->trustworthy ? "yes" : "no");
}

std::string csv_split(const Variant& variant) {
    if (!variant.split) return ",,,,,";
    const ErrorParts& mse = variant.split->mse;
    std::string text;
    for (const auto& value :
         {mse.precision, mse.sampling, mse.model, variant.split->cross, mse.total})
        text += "," + number(value, 9);
    return text;
}

// The page says the same (tools/page/report/comparison.js).
constexpr const char* kIntervalsExplained =
    "**t-interval**: how far the mean of these frames may be from the mean over many frames of "
    "this kind. The more the frames disagree and the fewer they are, the wider it is. An interval "
    "that contains 0 leaves open which of the two is better. **Tiles redrawn** (bootstrap): each "
    "frame is cut into tiles, and tiles are drawn again and again at random, some of them twice "
    "and some not at all. An interval on one side of 0 says that the difference does not come from "
    "a few places of these frames; it says nothing about other frames.";

class Markdown {
  public:
    explicit Markdown(const Report& report) : report_(report) {}

    std::string text() {
        out_ = "# " + markdown_text(report_.title) + "\n\n";
        if (report_.comparison) {
            out_ += markdown_text(report_.comparison->verdict) + "\n\n";
            if (!report_.comparison->claims.empty())
                out_ += markdown_text(report_.comparison->claims) + "\n\n";
        } else if (report_.winner)
            out_ += markdown_text(report_.winner->words) + ".\n\n";
        list(report_.under);
        list(report_.warnings, "**Warning:** ");
        conditions();
        curve();
        means();
        differences();
        times();
        splits();
        elisions();
        frames();
        chains();
        if (!report_.notes.empty()) out_ += "## Notes\n\n";
        list(report_.notes);
        return out_;
    }

  private:
    using Notes = std::vector<std::string>;

    void list(const std::vector<std::string>& lines, const std::string& before = {}) {
        for (const auto& line : lines) out_ += "- " + before + markdown_text(line) + "\n";
        if (!lines.empty()) out_ += "\n";
    }
    void row(const std::vector<std::string>& cells) { out_ += markdown_row(cells); }
    void header(const std::vector<std::string>& cells) { out_ += markdown_header(cells); }

    void conditions() {
        header({"", ""});
        row({"input", report_.input});
        row({"truth", report_.truth ? *report_.truth : "none: " + report_.no_truth});
        if (const auto sigma = mean_of(report_.truth_noise, kNoiseSigma)) {
            std::string without_error;
            for (const MetricInfo& metric : report_.metrics)
                if (const auto value = mean_of(report_.truth_noise, metric.name))
                    without_error += concat(", ", metric.name, " ", figure(*value, 3));
            row({"noise of the truth",
                 concat("standard deviation ", figure(*sigma, 2), " of the displayed luma; a ",
                        "picture without any error would have ", without_error.substr(2))});
        }
        std::string list;
        for (int frame : report_.frames) list += (list.empty() ? "" : ", ") + std::to_string(frame);
        row({"frames", concat(list, " (n = ", report_.frames.size(), "), ", report_.width, "x",
                              report_.height)});
        row({"device",
             concat(report_.renderer, ", ", report_.threads, " threads, ", report_.precision)});
        row({"HDR-FLIP",
             concat(report_.tone_mapper, ", EV ", figure(report_.exposure_start), " .. ",
                    figure(report_.exposure_stop), ", ", report_.exposures.size(),
                    " exposures, from ", report_.truth ? "the truth" : "the unfiltered input")});
        row({"display transform", report_.display_transform});
        row({"postchain", report_.version});
        out_ += "\n";
    }

    // Error beside time, the cheapest first.
    void curve() {
        if (report_.pareto_metric.empty()) return;
        out_ += "## Error against run time\n\n";
        std::vector<std::string> cells = {"variant", "ms", report_.pareto_metric};
        for (const char* more : {"mse", "psnr"})
            if (more != report_.pareto_metric) cells.push_back(more);
        cells.push_back("Pareto set");
        header(cells);
        for (const Variant* variant : by_time(report_)) {
            std::vector<std::string> row_cells = {variant->name,
                                                  number(variant->timing->total.median_ms, 4)};
            for (size_t i = 2; i + 1 < cells.size(); ++i)
                row_cells.push_back(mean(variant->metrics, cells[i]));
            row_cells.push_back(variant->pareto ? "yes" : "");
            row(row_cells);
        }
        if (!report_.input_metrics.empty()) {
            std::vector<std::string> row_cells = {kInputName, ""};
            for (size_t i = 2; i + 1 < cells.size(); ++i)
                row_cells.push_back(mean(report_.input_metrics, cells[i]));
            row_cells.push_back("");
            row(row_cells);
        }
        out_ += "\nIn the Pareto set: no other variant is both faster and closer by " +
                report_.pareto_metric + ".\n\n";
    }

    // Metrics with a value of at least one variant.
    std::vector<MetricInfo> measured() const {
        std::vector<MetricInfo> metrics;
        for (const MetricInfo& metric : report_.metrics)
            for (const Variant& variant : report_.variants) {
                const auto found = variant.metrics.find(metric.name);
                if (found == variant.metrics.end() || !found->second.mean) continue;
                metrics.push_back(metric);
                break;
            }
        return metrics;
    }

    void means() {
        out_ += report_.reference == "truth" ? "## Against the truth, mean over frames\n\n"
                : report_.reference == "a"
                    ? "## Against the first chain, mean over frames\n\n"
                    : "## Against the same filter converged, mean over frames\n\n";
        const auto rows = scored_rows(report_);
        std::vector<std::string> cells;
        if (report_.variants.size() > 4) {  // many variants: one row each
            cells = {"variant"};
            for (const MetricInfo& metric : measured())
                cells.push_back(
                    concat(metric.name, " (", words_of(metric.better, report_.reference), ")"));
            header(cells);
            for (const ScoredRow& one : rows) {
                cells = {one.name};
                for (const MetricInfo& metric : measured())
                    cells.push_back(mean(*one.metrics, metric.name));
                row(cells);
            }
        } else {
            cells = {"metric", ""};
            for (const ScoredRow& one : rows) cells.push_back(one.name);
            header(cells);
            for (const MetricInfo& metric : measured()) {
                cells = {metric.name, words_of(metric.better, report_.reference)};
                for (const ScoredRow& one : rows) cells.push_back(mean(*one.metrics, metric.name));
                row(cells);
            }
        }
        if (!report_.input_metrics.empty())
            out_ += concat("\n`", kInputName,
                           "`: the unfiltered input against the same truth. A variant that is not "
                           "better than it by a metric has made that metric worse.\n");
        for (const Variant& variant : report_.variants)
            if (!variant.failure.empty())
                out_ += "\n" + markdown_text(variant.name + " failed: " + variant.failure) + "\n";
        out_ += "\n";
    }

    static std::string mean(const Metrics& metrics, const std::string& metric) {
        return number(mean_of(metrics, metric), 5);
    }

    void differences() {
        if (!report_.comparison || report_.comparison->metrics.empty()) return;
        const Comparison& comparison = *report_.comparison;
        out_ += "## " +
                markdown_text(report_.variants[1].name + " minus " + report_.variants[0].name) +
                "\n\n";
        const auto range = [](const std::optional<Interval>& interval) {
            return interval ? number(interval->low, 4) + " .. " + number(interval->high, 4)
                            : std::string();
        };
        const auto table = [&](const std::vector<const MetricComparison*>& metrics) {
            header({"metric", "", "n", "mean", "95 % t-interval over frames",
                    "95 % of tiles redrawn within frames", "finding"});
            for (const MetricComparison* metric : metrics) {
                std::string finding = name_of(metric->finding);
                for (char& c : finding) c = c == '_' ? ' ' : c;
                if (metric->finding == Finding::too_few_frames) finding += " to decide";
                row({metric->metric, way(metric->metric), std::to_string(metric->n),
                     number(metric->mean, 4), range(metric->t_interval), range(metric->bootstrap),
                     finding});
            }
            out_ += "\n";
        };
        std::vector<const MetricComparison*> found, open;
        for (const auto& metric : comparison.metrics)
            if (metric.n > 0)
                (metric.finding == Finding::no_measurable_difference ? open : found)
                    .push_back(&metric);
        if (!found.empty()) table(found);
        if (!open.empty()) {
            out_ += concat("### ", counted(open.size(), "metric"),
                           " without a measurable difference\n\n");
            table(open);
        }
        out_ += concat(kIntervalsExplained,
                       "\n\nMetrics whose best value is 1 are compared by their distance from 1. ",
                       "Tiles are ", comparison.bootstrap_tile_px, " px, ",
                       comparison.bootstrap_replicates, " replicates, seed ",
                       comparison.bootstrap_seed, ".\n\n");
    }

    std::string way(const std::string& name) const {
        for (const MetricInfo& metric : report_.metrics)
            if (metric.name == name) return words_of(metric.better, report_.reference);
        return "";
    }

    void times() {
        out_ += "## Time\n\n";
        header({"variant", "total ms", "spread", "n", "per pass ms", "trusted"});
        std::string source, frame;
        for (const Variant& variant : report_.variants) {
            if (!variant.timing) continue;
            const Timing& t = *variant.timing;
            std::string passes;
            for (const PassCost& cost : t.passes)
                passes += (passes.empty() ? "" : ", ") + cost.pass + " " +
                          (cost.elided ? "left out" : number(cost.time.median_ms, 4));
            row({variant.name + (variant.pareto ? " (Pareto)" : ""), number(t.total.median_ms, 4),
                 number(t.total.spread_ms, 3), std::to_string(t.total.n), passes,
                 t.trustworthy ? "yes" : "no: " + t.why_not});
            source = t.source;
            frame = std::to_string(t.frame);
        }
        if (!source.empty())
            out_ += "\nMedian and interquartile range; " + source + "; frame " + frame +
                    "; without transfers.\n";
        out_ += "\n";
    }

    void splits() {
        bool any = false;
        for (const Variant& variant : report_.variants) any |= variant.split.has_value();
        if (!any) return;
        out_ += "## Error in three parts (MSE)\n\n";
        header({"variant", "precision", "sampling", "model", "cross term", "total"});
        std::string noise;
        for (const Variant& variant : report_.variants) {
            if (!variant.split) continue;
            const ErrorSplit& s = *variant.split;
            row({variant.name, number(s.mse.precision, 4), number(s.mse.sampling, 4),
                 number(s.mse.model, 4), number(s.cross, 4), number(s.mse.total, 4)});
            noise = number(s.converged_noise, 3);
        }
        out_ += "\nNoise left in the converged picture (MSE, last variant): " + noise + ".\n\n";
        std::set<std::string> said;
        for (const Variant& variant : report_.variants)
            for (const auto& note : variant.split ? variant.split->notes : Notes())
                if (said.insert(note).second) out_ += "- " + markdown_text(note) + "\n";
        if (!said.empty()) out_ += "\n";
    }

    void elisions() {
        out_ += "## Left out\n\n";
        const auto rows = elision_rows(report_);
        if (rows.empty()) {
            out_ += "Nothing: every plan is whole.\n\n";
            return;
        }
        header({"variant", "what", "rule", "reason", "frames", "bytes", "dispatches", "taps"});
        for (const ElisionRow& one : rows) {
            std::string reason = one.reasons.front();
            if (one.reasons.size() > 1)
                reason += concat(" (frame ", one.frames[0], "; ", one.reasons.size() - 1,
                                 " more like it)");
            const auto number = [&](uint64_t n) {
                return one.saving.any() ? std::to_string(n) : "";
            };
            row({one.variant, one.what, one.rule, reason, sequence::frames_text(one.frames),
                 number(one.saving.bytes), number(uint64_t(one.saving.dispatches)),
                 number(one.saving.taps)});
        }
        out_ +=
            "\nSavings are sums over the frames named: bytes of textures, dispatches, texture "
            "fetches; of blocks that the device found, fetches alone.\n\n";
    }

    void frames() {
        out_ += "## Per frame\n\n";
        std::vector<std::string> cells = {"frame", "variant"};
        for (const MetricInfo& metric : measured()) cells.push_back(metric.name);
        header(cells);
        for (size_t i = 0; i < report_.frames.size(); ++i) {
            for (const ScoredRow& one : scored_rows(report_)) {
                cells = {std::to_string(report_.frames[i]), one.name};
                for (const MetricInfo& metric : measured()) {
                    const auto found = one.metrics->find(metric.name);
                    const bool has = found != one.metrics->end() && i < found->second.frames.size();
                    cells.push_back(has ? number(found->second.frames[i], 5) : "");
                }
                row(cells);
            }
        }
        out_ += "\n";
    }

    void chains() {
        out_ += "## Chains\n\n";
        for (const Variant& variant : report_.variants)
            out_ += markdown_text(variant.name) + ", hash " + hex_of(variant.chain_hash) +
                    "\n\n```yaml\n" + variant.chain_text + "```\n\n";
    }

    const Report& report_;
    std::string out_;
};

}  // namespace

std::string report_as_csv(const Report& report) {
    std::string out = "variant,chain_hash,frame";
    for (const MetricInfo& metric : report.metrics) out += "," + field(metric.name);
    out +=
        ",total_ms,total_spread_ms,time_trusted,mse_precision,mse_sampling,mse_model,mse_cross,"
        "mse_total,pareto,failure\n";
    for (const ScoredRow& row : scored_rows(report)) {
        const Variant* variant = row.variant;
        const auto line = [&](const std::string& frame, const auto& value_of, bool whole) {
            out +=
                field(row.name) + "," + (variant ? hex_of(variant->chain_hash) : "") + "," + frame;
            for (const MetricInfo& metric : report.metrics) {
                const auto found = row.metrics->find(metric.name);
                out += "," + (found == row.metrics->end() ? std::string()
                                                          : number(value_of(found->second), 9));
            }
            out += whole && variant
                       ? csv_times(*variant) + csv_split(*variant) + "," +
                             (variant->pareto ? "yes" : "no") + "," + field(variant->failure)
                       : ",,,,,,,,,,";
            out += "\n";
        };
        for (size_t i = 0; i < report.frames.size(); ++i)
            line(
                std::to_string(report.frames[i]),
                [&](const Series& series) {
                    return i < series.frames.size() ? series.frames[i] : std::nullopt;
                },
                false);
        line(
            "mean", [](const Series& series) { return series.mean; }, true);
    }
    return out;
}

std::string markdown_row(const std::vector<std::string>& cells) {
    std::string line;
    for (const auto& text : cells) line += "| " + markdown_cell(text) + " ";
    return line + "|\n";
}

std::string markdown_header(const std::vector<std::string>& cells) {
    std::string text = markdown_row(cells);
    for (size_t i = 0; i < cells.size(); ++i) text += "|---";
    return text + "|\n";
}

std::string report_as_markdown(const Report& report) {
    return Markdown(report).text();
}

}  // namespace postchain::report

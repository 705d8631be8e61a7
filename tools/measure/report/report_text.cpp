#include "tools/measure/report/report_text.h"

#include <set>

#include "tools/measure/report/lists.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/run/frame_task.h"

namespace postchain::report {
namespace {

std::string number(const std::optional<double>& value, int digits) {
    return value ? figure(*value, digits) : "";
}

// RFC 4180. What a spreadsheet would take for a formula gets an apostrophe before it; numbers do
// not come this way.
std::string field(const std::string& name) {
    const bool formula =
        !name.empty() && std::string("=+-@\t\r").find(name[0]) != std::string::npos;
    const std::string text = formula ? "'" + name : name;
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

// Text as it is, where Markdown would take it for HTML.
std::string plain(const std::string& text) {
    std::string out;
    for (char c : text)
        out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
}

// A cell of a Markdown table: one line, no bar.
std::string cell(const std::string& text) {
    std::string out;
    for (char c : plain(text)) {
        if (c == '|') out += '\\';
        out += c == '\n' ? ' ' : c;
    }
    return out;
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

class Markdown {
  public:
    explicit Markdown(const Report& report) : report_(report) {}

    std::string text() {
        out_ = "# " + plain(report_.title) + "\n\n";
        if (report_.comparison) {
            out_ += plain(report_.comparison->verdict) + "\n\n";
            if (!report_.comparison->claims.empty())
                out_ += plain(report_.comparison->claims) + "\n\n";
        }
        for (const auto& line : report_.under) out_ += "- " + plain(line) + "\n";
        if (!report_.under.empty()) out_ += "\n";
        conditions();
        curve();
        means();
        differences();
        times();
        splits();
        elisions();
        frames();
        chains();
        for (size_t i = 0; i < report_.notes.size(); ++i)
            out_ += (i ? "" : "## Notes\n\n") + ("- " + plain(report_.notes[i])) + "\n";
        return out_;
    }

  private:
    using Notes = std::vector<std::string>;

    void row(const std::vector<std::string>& cells) {
        for (const auto& text : cells) out_ += "| " + cell(text) + " ";
        out_ += "|\n";
    }
    void header(const std::vector<std::string>& cells) {
        row(cells);
        for (size_t i = 0; i < cells.size(); ++i) out_ += "|---";
        out_ += "|\n";
    }

    void conditions() {
        header({"", ""});
        row({"input", report_.input});
        row({"truth", report_.truth ? *report_.truth : "none: " + report_.no_truth});
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
                row_cells.push_back(mean(*variant, cells[i]));
            row_cells.push_back(variant->pareto ? "yes" : "");
            row(row_cells);
        }
        out_ += "\nIn the Pareto set: no other variant is both faster and nearer by " +
                report_.pareto_metric + ".\n\n";
    }

    // Metrics that some variant has a value of.
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
        std::vector<std::string> cells = {"metric", "better"};
        for (const Variant& variant : report_.variants) cells.push_back(variant.name);
        if (report_.variants.size() > 4) {  // many variants: one row each
            cells = {"variant"};
            for (const MetricInfo& metric : measured()) cells.push_back(metric.name);
            header(cells);
            for (const Variant& variant : report_.variants) {
                cells = {variant.name};
                for (const MetricInfo& metric : measured())
                    cells.push_back(mean(variant, metric.name));
                row(cells);
            }
        } else {
            header(cells);
            for (const MetricInfo& metric : measured()) {
                cells = {metric.name, name_of(metric.better)};
                for (const Variant& variant : report_.variants)
                    cells.push_back(mean(variant, metric.name));
                row(cells);
            }
        }
        for (const Variant& variant : report_.variants)
            if (!variant.failure.empty())
                out_ += "\n" + plain(variant.name + " failed: " + variant.failure) + "\n";
        out_ += "\n";
    }

    static std::string mean(const Variant& variant, const std::string& metric) {
        const auto found = variant.metrics.find(metric);
        return found == variant.metrics.end() ? "" : number(found->second.mean, 5);
    }

    void differences() {
        if (!report_.comparison || report_.comparison->metrics.empty()) return;
        const Comparison& comparison = *report_.comparison;
        out_ +=
            "## " + plain(report_.variants[1].name + " minus " + report_.variants[0].name) + "\n\n";
        header({"metric", "n", "mean", "95 % t-interval over frames",
                "95 % of tiles redrawn within frames", "finding"});
        const auto range = [](const std::optional<Interval>& interval) {
            return interval ? number(interval->low, 4) + " .. " + number(interval->high, 4)
                            : std::string();
        };
        for (const auto& metric : comparison.metrics) {
            if (metric.n == 0) continue;
            std::string finding = name_of(metric.finding);
            for (char& c : finding) c = c == '_' ? ' ' : c;
            if (metric.finding == Finding::too_few_frames) finding += " to decide";
            row({metric.metric, std::to_string(metric.n), number(metric.mean, 4),
                 range(metric.t_interval), range(metric.bootstrap), finding});
        }
        out_ +=
            concat("\nMetrics whose best value is 1 are compared by their distance from 1. ",
                   "Tiles are ", comparison.bootstrap_tile_px, " px, ",
                   comparison.bootstrap_replicates, " replicates, seed ", comparison.bootstrap_seed,
                   ". Of ", comparison.steps_a, " and ", comparison.steps_b, " dispatches a frame ",
                   comparison.shared_steps, " are the same and run once.\n\n");
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
                if (said.insert(note).second) out_ += "- " + plain(note) + "\n";
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
            for (const Variant& variant : report_.variants) {
                cells = {std::to_string(report_.frames[i]), variant.name};
                for (const MetricInfo& metric : measured()) {
                    const auto found = variant.metrics.find(metric.name);
                    const bool has =
                        found != variant.metrics.end() && i < found->second.frames.size();
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
            out_ += plain(variant.name) + ", hash " + hex_of(variant.chain_hash) + "\n\n```yaml\n" +
                    variant.chain_text + "```\n\n";
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
    for (const Variant& variant : report.variants) {
        const auto line = [&](const std::string& frame, const auto& value_of, bool whole) {
            out += field(variant.name) + "," + hex_of(variant.chain_hash) + "," + frame;
            for (const MetricInfo& metric : report.metrics) {
                const auto found = variant.metrics.find(metric.name);
                out += "," + (found == variant.metrics.end() ? std::string()
                                                             : number(value_of(found->second), 9));
            }
            out += whole ? csv_times(variant) + csv_split(variant) + "," +
                               (variant.pareto ? "yes" : "no") + "," + field(variant.failure)
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

std::string report_as_markdown(const Report& report) {
    return Markdown(report).text();
}

Status write_report_csv(const Report& report) {
    return report.write(report.folder + "/report.csv", report_as_csv(report));
}

Status write_report_markdown(const Report& report) {
    return report.write(report.folder + "/report.md", report_as_markdown(report));
}

}  // namespace postchain::report

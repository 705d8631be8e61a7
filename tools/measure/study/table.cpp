#include "tools/measure/study/table.h"

#include <algorithm>
#include <cmath>

#include "tools/measure/experiment/statistics.h"
#include "tools/measure/report/words.h"

namespace postchain::study {
namespace {

std::optional<double> mean_of(const Values& values) {
    double sum = 0;
    int count = 0;
    for (const auto& value : values)
        if (value) {
            sum += *value;
            ++count;
        }
    if (count == 0) return std::nullopt;
    return sum / count;
}

const Values* values_of(const std::map<std::string, Values>& metrics, const std::string& name) {
    const auto found = metrics.find(name);
    return found == metrics.end() ? nullptr : &found->second;
}

// Means over rows of one column.
std::optional<double> column_mean(const std::vector<const Row*>& rows, Values Row::*column,
                                  size_t index) {
    Values values;
    for (const Row* row : rows) values.push_back((row->*column)[index]);
    return mean_of(values);
}

bool within_margin(const PairResult& result) {
    return result.equivalence && result.equivalence->decides();
}

class Maker {
  public:
    Maker(const report::MetricInfo& metric, const std::vector<std::string>& variants,
          const std::vector<std::pair<size_t, size_t>>& pairs, std::optional<double> margin)
        : variants_(variants), pairs_(pairs), margin_(margin) {
        table_.metric = metric;
    }

    MetricTable make(const std::vector<SceneFigures>& scenes) {
        for (const SceneFigures& scene : scenes) add_scene(scene);
        add_families();
        find_means();
        for (size_t p = 0; p < pairs_.size(); ++p) table_.pairs.push_back(result_of(p));
        correct(&PairResult::difference);
        correct(&PairResult::equivalence);
        for (size_t p = 0; p < pairs_.size(); ++p) decide(p);
        return std::move(table_);
    }

  private:
    void add_scene(const SceneFigures& scene) {
        Row row;
        row.name = scene.scene;
        row.family = scene.family;
        for (size_t v = 0; v < variants_.size(); ++v) {
            const auto found = scene.variants.find(v);
            const Values* values = found == scene.variants.end()
                                       ? nullptr
                                       : values_of(found->second, table_.metric.name);
            row.means.push_back(values ? mean_of(*values) : std::nullopt);
        }
        for (size_t p = 0; p < pairs_.size(); ++p) {
            const auto found = scene.pairs.find(p);
            row.gains.push_back(found == scene.pairs.end() ? std::nullopt : gain(found->second));
        }
        table_.scenes.push_back(std::move(row));
    }

    std::optional<double> gain(const SceneFigures::Pair& pair) const {
        const Values* a = values_of(pair.a, table_.metric.name);
        const Values* b = values_of(pair.b, table_.metric.name);
        if (!a || !b) return std::nullopt;
        Values gains;
        for (size_t i = 0; i < std::min(a->size(), b->size()); ++i)
            if ((*a)[i] && (*b)[i])
                gains.push_back(gain_of(table_.metric.better, *(*a)[i], *(*b)[i]));
        return mean_of(gains);
    }

    void add_families() {
        std::vector<std::string> names;
        for (const Row& row : table_.scenes)
            if (std::ranges::find(names, row.family) == names.end()) names.push_back(row.family);
        for (const std::string& name : names) {
            std::vector<const Row*> rows;
            for (const Row& row : table_.scenes)
                if (row.family == name) rows.push_back(&row);
            Row family;
            family.name = name;
            family.scenes = rows.size();
            for (size_t v = 0; v < variants_.size(); ++v)
                family.means.push_back(column_mean(rows, &Row::means, v));
            for (size_t p = 0; p < pairs_.size(); ++p)
                family.gains.push_back(column_mean(rows, &Row::gains, p));
            table_.families.push_back(std::move(family));
        }
    }

    // Variants are compared over the same families only.
    void find_means() {
        std::vector<const Row*> whole;
        for (const Row& family : table_.families)
            if (std::ranges::all_of(family.means,
                                    [](const auto& value) { return value.has_value(); }))
                whole.push_back(&family);
        for (size_t v = 0; v < variants_.size(); ++v)
            table_.means.push_back(column_mean(whole, &Row::means, v));
        if (whole.empty()) return;
        for (size_t v = 0; v < variants_.size(); ++v)
            if (!table_.best ||
                gain_of(table_.metric.better, *table_.means[*table_.best], *table_.means[v]) > 0)
                table_.best = v;
    }

    PairResult result_of(size_t pair) const {
        PairResult result;
        std::vector<double> gains;
        for (const Row& family : table_.families)
            if (family.gains[pair]) gains.push_back(*family.gains[pair]);
        for (const Row& scene : table_.scenes)
            if (scene.gains[pair]) {
                ++result.scenes;
                result.scenes_nearer += *scene.gains[pair] > 0;
            }
        const experiment::Paired paired = experiment::paired_interval(gains);
        result.families = paired.n;
        if (paired.n > 0) result.mean = paired.mean;
        result.interval = paired.interval;
        for (const double gain : gains) {
            result.nearer += gain > 0;
            result.farther += gain < 0;
        }
        result.sign_probability = experiment::sign_probability(result.nearer, result.farther);
        result.margin = margin_;
        if (!result.interval) return result;
        result.difference = {experiment::difference_probability(paired), 1};
        if (margin_)
            result.equivalence = {experiment::equivalence_probability(paired, *margin_), 1};
        return result;
    }

    // For the number of questions with a probability.
    void correct(std::optional<Probability> PairResult::*of) {
        std::vector<double> alone;
        for (const PairResult& one : table_.pairs)
            if (one.*of) alone.push_back((one.*of)->alone);
        const auto corrected = experiment::holm(alone);
        size_t next = 0;
        for (PairResult& one : table_.pairs)
            if (one.*of) (one.*of)->corrected = corrected[next++];
    }

    void decide(size_t pair) {
        PairResult& result = table_.pairs[pair];
        if (result.difference)
            result.decision = result.difference->decides()
                                  ? (*result.mean > 0 ? Decision::b : Decision::a)
                              : within_margin(result) ? Decision::equal
                                                      : Decision::not_decided;
        result.words = words_of(result, pair);
    }

    std::string words_of(const PairResult& result, size_t pair) const {
        const std::string& a = variants_[pairs_[pair].first];
        const std::string& b = variants_[pairs_[pair].second];
        if (!result.mean) return "no scene has a value";
        if (result.nearer + result.farther == 0) return "no difference";
        const bool b_nearer = *result.mean >= 0;
        const auto amount = [&](double gain) { return report::figure(b_nearer ? gain : -gain); };
        const std::string by = concat(b_nearer ? b : a, " is closer than ", b_nearer ? a : b,
                                      " by ", amount(*result.mean));
        if (!result.interval) return by + " in the only family; nothing is decided";
        const double low = b_nearer ? result.interval->low : result.interval->high;
        const double high = b_nearer ? result.interval->high : result.interval->low;
        // Two families give an interval.
        const std::string text =
            concat(by, " (", amount(low), " to ", amount(high), "; p ",
                   report::figure(result.difference->corrected, 3), "), in ",
                   b_nearer ? result.nearer : result.farther, " of ", result.families, " families");
        if (result.decision == Decision::equal)
            return concat("no difference beyond ", report::figure(*result.margin), " (p ",
                          report::figure(result.equivalence->corrected, 3), "): ", text);
        if (result.decision == Decision::not_decided) return "not decided: " + text;
        return within_margin(result)
                   ? concat(text, ", which is less than ", report::figure(*result.margin))
                   : text;
    }

    const std::vector<std::string>& variants_;
    const std::vector<std::pair<size_t, size_t>>& pairs_;
    const std::optional<double> margin_;
    MetricTable table_;
};

bool has_value(const MetricTable& table) {
    for (const Row& row : table.scenes)
        if (mean_of(row.means)) return true;
    return false;
}

}  // namespace

double gain_of(report::Better better, double a, double b) {
    switch (better) {
        case report::Better::higher:
            return b - a;
        case report::Better::one:
            return std::abs(a - 1) - std::abs(b - 1);
        case report::Better::lower:
            break;
    }
    return a - b;
}

std::optional<double> default_margin(const std::string& metric) {
    static const std::map<std::string, double> margins = {
        {"hdr_flip", 0.005}, {"flip", 0.005}, {"psnr", 0.4}, {"ssim", 0.002}, {"tde", 0.002}};
    const auto found = margins.find(metric);
    return found == margins.end() ? std::nullopt : std::optional(found->second);
}

std::vector<MetricTable> tables_of(const std::vector<report::MetricInfo>& metrics,
                                   const std::vector<std::string>& variants,
                                   const std::vector<std::pair<size_t, size_t>>& pairs,
                                   const std::vector<SceneFigures>& scenes,
                                   const std::map<std::string, double>& margins) {
    std::vector<MetricTable> tables;
    for (const auto& metric : metrics) {
        const auto stated = margins.find(metric.name);
        const auto margin = stated == margins.end() ? default_margin(metric.name)
                                                    : std::optional<double>(stated->second);
        MetricTable table = Maker(metric, variants, pairs, margin).make(scenes);
        if (has_value(table)) tables.push_back(std::move(table));
    }
    return tables;
}

}  // namespace postchain::study

#include "tools/measure/study/questions.h"

#include <algorithm>
#include <cmath>

#include "config/scalar.h"
#include "tools/measure/experiment/experiment.h"

namespace postchain::study {
namespace {

std::optional<size_t> chain_of(const TextNode& at, const std::string& path, const Study& study,
                               Reporter& reporter) {
    const auto names = study.names();
    const auto found = std::find(names.begin(), names.end(), at.text);
    if (at.is_scalar() && found != names.end()) return size_t(found - names.begin());
    reporter.error(at, path,
                   at.is_scalar() ? unknown_word("chain", at.text, names) : "is a chain's name");
    return std::nullopt;
}

// Keys of a question that is a map.
std::optional<Equal> equal_of(const TextNode& item, const std::string& path, Reporter& reporter) {
    if (!item.is_map()) return Equal::unsaid;
    bool good = true;
    for (const auto& [key, value] : item.entries)
        if (key.text != "pair" && key.text != "equal") {
            reporter.error(key, path + "." + key.text,
                           unknown_word("key", key.text, {"pair", "equal"}));
            good = false;
        }
    const TextNode* equal = item.find("equal");
    if (!good) return std::nullopt;
    if (!equal) return Equal::unsaid;
    for (const Equal one : {Equal::samples, Equal::time})
        if (equal->is_scalar() && equal->text == name_of(one)) return one;
    reporter.error(*equal, path + ".equal", "is samples or time");
    return std::nullopt;
}

}  // namespace

void read_questions(const TextNode& root, Study& study, Reporter& reporter) {
    const TextNode* questions = root.find("questions");
    if (!questions) {
        for (size_t b = 1; b < study.chains.size(); ++b)
            for (size_t a = 0; a < b; ++a) study.ask(a, b);
        return;
    }
    if (!questions->is_list() || questions->items.empty())
        return reporter.error(*questions, "questions", "is a list of pairs: [[lens, joint]]");
    for (size_t i = 0; i < questions->items.size(); ++i) {
        const TextNode& item = questions->items[i];
        const std::string path = concat("questions[", i, "]");
        const TextNode* pair = item.is_map() ? item.find("pair") : &item;
        if (!pair || !pair->is_list() || pair->items.size() != 2) {
            reporter.error(
                item, path,
                "is a pair of chains: [lens, joint], or {pair: [lens, joint], equal: time}");
            continue;
        }
        const auto a = chain_of(pair->items[0], path, study, reporter),
                   b = chain_of(pair->items[1], path, study, reporter);
        const auto same = equal_of(item, path, reporter);
        if (!a || !b || !same) continue;
        const std::pair<size_t, size_t> asked(*a, *b), turned(*b, *a);
        const auto of_a = samples_of(study.chains[*a].chain);
        const auto of_b = samples_of(study.chains[*b].chain);
        if (*a == *b) {
            reporter.error(item, path, "compares a chain with itself");
        } else if (std::count(study.pairs.begin(), study.pairs.end(), asked) +
                   std::count(study.pairs.begin(), study.pairs.end(), turned)) {
            reporter.error(item, path, "is asked twice");
        } else if (*same == Equal::samples && !(of_a && of_b)) {
            reporter.error(item, path,
                           concat("says equal samples, but ", study.chains[of_a ? *b : *a].name,
                                  " samples adaptively: how many it takes depends on the frame; "
                                  "remove max_samples, or ask for equal: time"));
        } else if (*same == Equal::samples && of_a != of_b) {
            reporter.error(item, path,
                           concat("says equal samples, but the passes of ", study.chains[*a].name,
                                  " take ", *of_a, " and those of ", study.chains[*b].name, " ",
                                  *of_b, "; change samples of a pass"));
        } else {
            study.ask(*a, *b, *same);
        }
    }
}

void read_margins(const TextNode& root, Study& study, Reporter& reporter) {
    const TextNode* margins = root.find("margins");
    if (!margins) return;
    if (!margins->is_map())
        return reporter.error(*margins, "margins",
                              "is a map of metrics: {hdr_flip: 0.005, psnr: 0.4}");
    std::vector<std::string> metrics;
    for (const auto& metric : experiment::metric_columns(study.kind, true))
        metrics.push_back(metric.name);
    for (const auto& [key, value] : margins->entries) {
        const std::string path = "margins." + key.text;
        if (std::find(metrics.begin(), metrics.end(), key.text) == metrics.end()) {
            reporter.error(key, path, unknown_word("metric", key.text, metrics));
            continue;
        }
        const auto read = value_of(value);
        const auto* whole = read.ok() ? std::get_if<int64_t>(&*read) : nullptr;
        const auto* number = read.ok() ? std::get_if<double>(&*read) : nullptr;
        const double margin = whole ? double(*whole) : number ? *number : 0;
        if (margin > 0 && std::isfinite(margin))
            study.margins[key.text] = margin;
        else
            reporter.error(value, path,
                           "is a number above 0: a gain below it counts as no difference");
    }
}

}  // namespace postchain::study

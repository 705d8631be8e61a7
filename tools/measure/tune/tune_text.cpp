#include "tools/measure/tune/tune_text.h"

#include <algorithm>

#include "chain/base/printable.h"
#include "config/chain_file.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/words.h"

namespace postchain::tune {
namespace {

std::string padded(std::string text, size_t width) {
    return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

std::string seconds(double s) {
    return report::figure(s, 3) + " s";
}

std::string goal_text(const Goal& goal) {
    return goal.budget_s ? concat("--budget ", report::figure(*goal.budget_s), "s")
                         : concat("--error ", report::figure(*goal.error));
}

std::string name_of(const Candidate& candidate) {
    return knobs_text(candidate.chain) +
           (candidate.name.empty() ? "" : " (start: " + candidate.name + ")");
}

std::string row(const Tuning& tuning, size_t i) {
    const Candidate& candidate = tuning.search.candidates[i];
    const Times& times = candidate.measured.times;
    return concat(
        tuning.search.chosen == i ? "*" : " ", times.doubt.empty() ? " " : "~",
        padded(report::figure(times.seconds, 3), 8), padded(report::figure(times.spread_s, 2), 9),
        padded(report::figure(*candidate.measured.error, 3), 9), "  ", name_of(candidate));
}

// Lines without their ends.
std::vector<std::string> table(const Tuning& tuning) {
    std::vector<std::string> lines = {"   s/frame   spread hdr_flip  chain"};
    for (const size_t i : tuning.search.front()) lines.push_back(row(tuning, i));
    return lines;
}

}  // namespace

std::string outcome_text(const Tuning& tuning) {
    const ParetoSearch& search = tuning.search;
    const Goal& goal = tuning.goal;
    const std::string measured =
        concat(report::counted(search.candidates.size(), "chain"), " measured");
    if (const Candidate* candidate = tuning.chosen())
        return concat(goal_text(goal), ": ", knobs_text(candidate->chain), " takes ",
                      seconds(candidate->measured.times.seconds), " a frame with HDR-FLIP ",
                      report::figure(*candidate->measured.error, 3), " (", measured, ")");
    if (goal.budget_s) {
        const Candidate& fastest = search.candidates[*search.fastest()];
        return concat(goal_text(goal), ": the fastest of ", measured, " takes ",
                      seconds(fastest.measured.times.seconds),
                      " a frame: ", knobs_text(fastest.chain),
                      "; raise the budget, use smaller frames or a faster device (--device)");
    }
    const Candidate& closest = search.candidates[*search.closest()];
    return concat(goal_text(goal), ": the closest of ", measured, " has HDR-FLIP ",
                  report::figure(*closest.measured.error, 3), ": ", knobs_text(closest.chain),
                  tuning.with_truth ? "; allow a larger error, or start from another CHAIN"
                                    : "; allow a larger error");
}

std::vector<std::string> doubts_of(const Tuning& tuning) {
    std::vector<std::string> lines = tuning.notes;
    if (!tuning.search.complete)
        lines.push_back(concat("the walk ended after ", tuning.search.candidates.size(),
                               " chains (--max-chains); more may lie on the front"));
    size_t doubtful = 0;
    std::string why;
    for (const Candidate& candidate : tuning.search.candidates)
        if (!candidate.measured.times.doubt.empty()) {
            ++doubtful;
            why = candidate.measured.times.doubt;
        }
    if (doubtful > 0)
        lines.push_back(
            concat("~: untrustworthy time (", report::counted(doubtful, "chain"), "): ", why));
    if (const Candidate* chosen = tuning.chosen(); chosen && tuning.goal.budget_s) {
        const Times& times = chosen->measured.times;
        if (times.seconds + times.spread_s / 2 > *tuning.goal.budget_s)
            lines.push_back("the spread of the chosen chain's time reaches beyond the budget");
    }
    return lines;
}

std::string front_text(const Tuning& tuning) {
    std::string text;
    for (const std::string& line : table(tuning)) text += printable(line) + "\n";
    return text;
}

std::string tuned_chain_file(const Tuning& tuning) {
    std::vector<std::string> lines = {
        "postchain tune " + tuning.version + ", " + goal_text(tuning.goal) +
            (tuning.goal.budget_s ? ": the least error within this time per frame"
                                  : ": the least time within this mean HDR-FLIP"),
        "input: " + tuning.input + ", frames " + tuning.frames,
        "reference: " + tuning.reference,
        "device: " + tuning.device,
        "time: " + tuning.timing +
            ", of the passes without reading and writing; per frame the median of " +
            concat(tuning.search.candidates.front().measured.times.repeats) +
            " repetitions (chosen chain: " + concat(tuning.chosen()->measured.times.repeats) +
            ", timed again); spread: quartiles",
        concat("Chains that no other of the ", tuning.search.candidates.size(),
               " measured beats in both time and error (*: this file):")};
    for (const std::string& line : table(tuning)) lines.push_back(line);
    for (const std::string& line : doubts_of(tuning)) lines.push_back(line);
    std::string text;
    for (const std::string& line : lines) text += "# " + printable(line) + "\n";
    return text + write_chain(tuning.chosen()->chain);
}

io::Json tuning_json(const Tuning& tuning) {
    using io::Json;
    const std::vector<size_t> front = tuning.search.front();
    Json points = Json::array();
    for (size_t i = 0; i < tuning.search.candidates.size(); ++i) {
        const Candidate& candidate = tuning.search.candidates[i];
        const Times& times = candidate.measured.times;
        points.push_back({{"chain", knobs_text(candidate.chain)},
                          {"chain_hash", hex_of(candidate.chain.hash())},
                          {"start", candidate.name.empty() ? Json(nullptr) : Json(candidate.name)},
                          {"seconds", times.seconds},
                          {"spread_s", times.spread_s},
                          {"repeats", times.repeats},
                          {"doubt", times.doubt.empty() ? Json(nullptr) : Json(times.doubt)},
                          {"hdr_flip", candidate.measured.error},
                          {"front", std::ranges::find(front, i) != front.end()},
                          {"chosen", tuning.search.chosen == i}});
    }
    return {{"postchain_tune", 1},
            {"version", tuning.version},
            {"input", tuning.input},
            {"frames", tuning.frames},
            {"reference", tuning.reference},
            {"with_truth", tuning.with_truth},
            {"device", tuning.device},
            {"timing", tuning.timing},
            {"budget_s", tuning.goal.budget_s},
            {"error", tuning.goal.error},
            {"outcome", outcome_text(tuning)},
            {"notes", doubts_of(tuning)},
            {"points", std::move(points)}};
}

}  // namespace postchain::tune

#include "tools/measure/tune/tune_text.h"

#include <algorithm>
#include <sstream>

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
    return goal.budget_s ? setting("budget", report::figure(*goal.budget_s) + "s")
                         : setting("error", report::figure(*goal.error));
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

constexpr std::string_view kWalkLine = "# walk ";
constexpr std::string_view kPointLine = "# measured ";
constexpr std::string_view kEndLine = "# unchanged ";

// The text behind `word` if the line begins with it.
std::optional<std::string> after(std::string_view word, const std::string& line) {
    if (!line.starts_with(word)) return std::nullopt;
    return line.substr(word.size());
}

// The measured chains as comments, whose last is a hash of the text above it.
void append_walk(std::string& file, const Tuning& tuning) {
    file += concat(kWalkLine, tuning.key, "\n");
    for (const Candidate& candidate : tuning.search.candidates) {
        const Times& times = candidate.measured.times;
        const io::Json point = {{"chain_hash", candidate.chain.hash()},
                                {"seconds", times.seconds},
                                {"spread_s", times.spread_s},
                                {"repeats", times.repeats},
                                {"doubt", times.doubt},
                                {"hdr_flip", candidate.measured.error},
                                {"confirmed", candidate.confirmed}};
        file += concat(kPointLine, io::json_text(point), "\n");
    }
    file += concat(kEndLine, hex_of(hash_text(file)), "\n");
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
                      "; raise the budget, use smaller frames or a faster device ({device})"_keyed);
    }
    const Candidate& closest = search.candidates[*search.closest()];
    return concat(goal_text(goal), ": the closest of ", measured, " has HDR-FLIP ",
                  report::figure(*closest.measured.error, 3), ": ", knobs_text(closest.chain),
                  tuning.with_truth ? "; allow a larger error, or start from another CHAIN"
                                    : "; allow a larger error");
}

std::vector<std::string> doubts_of(const Tuning& tuning) {
    std::vector<std::string> lines = tuning.notes;
    if (tuning.search.stopped)
        lines.push_back(concat(
            "the walk was stopped after ",
            report::counted(tuning.search.candidates.size(), "chain"), "; the same command goes on",
            meets(tuning.goal, tuning.chosen()->measured) ? "" : "; no chain meets the goal yet"));
    else if (!tuning.search.complete)
        lines.push_back(concat("the walk ended after ",
                               report::counted(tuning.search.candidates.size(), "chain"),
                               " ({max_chains}); more may lie on the front"_keyed));
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
    int repeats = tuning.chosen()->measured.times.repeats;  // more of those timed again
    for (const Candidate& candidate : tuning.search.candidates)
        repeats = std::min(repeats, candidate.measured.times.repeats);
    std::vector<std::string> lines = {
        "postchain tune " + tuning.version + ", " + goal_text(tuning.goal) +
            (tuning.goal.budget_s ? ": the least error within this time per frame"
                                  : ": the least time within this mean HDR-FLIP"),
        "input: " + tuning.input + ", frames " + tuning.frames,
        "reference: " + tuning.reference,
        "device: " + tuning.device,
        "time: " + tuning.timing +
            ", of the passes without reading and writing; per frame the median of " +
            concat(repeats) + " repetitions" +
            (tuning.search.stopped && !tuning.chosen()->confirmed
                 ? ""
                 : concat(" (chosen chain: ", tuning.chosen()->measured.times.repeats,
                          ", timed again)")) +
            "; spread: quartiles",
        concat("Chains that no other of the ", tuning.search.candidates.size(),
               " measured beats in both time and error (*: this file):")};
    for (const std::string& line : table(tuning)) lines.push_back(line);
    for (const std::string& line : doubts_of(tuning)) lines.push_back(line);
    std::string text;
    for (const std::string& line : lines) text += "# " + printable(as_options(line)) + "\n";
    text += write_chain(tuning.chosen()->chain);
    if (tuning.search.stopped) append_walk(text, tuning);
    return text;
}

std::optional<StoppedWalk> stopped_walk_of(const std::string& file) {
    StoppedWalk walk;
    std::istringstream lines(file);
    std::string above;
    for (std::string line; std::getline(lines, line); above += line + "\n") {
        if (const auto key = after(kWalkLine, line)) walk.key = *key;
        if (const auto point = after(kPointLine, line)) {
            const auto json = io::read_json(*point, "");
            if (!json.ok()) return std::nullopt;
            try {
                Measured measured;
                measured.times = {
                    json->at("seconds").get<double>(), json->at("spread_s").get<double>(),
                    json->at("repeats").get<int>(), json->at("doubt").get<std::string>()};
                json->at("hdr_flip").get_to(measured.error);
                walk.by_hash[json->at("chain_hash").get<uint64_t>()] = {
                    std::move(measured), json->at("confirmed").get<bool>()};
            } catch (const io::Json::exception&) {
                return std::nullopt;
            }
        }
        if (const auto hash = after(kEndLine, line)) {
            const bool whole =
                *hash == hex_of(hash_text(above)) && above.size() + line.size() + 1 == file.size();
            return whole && !walk.key.empty() ? std::optional(std::move(walk)) : std::nullopt;
        }
    }
    return std::nullopt;
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

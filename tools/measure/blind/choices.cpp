#include "tools/measure/blind/choices.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "tools/measure/experiment/statistics.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/files/json.h"

namespace postchain::blind {
namespace {

constexpr const char* kHeader = "kit,observer,trial,choice,seconds";

// The page writes observers without commas and quotes.
std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields;
    std::istringstream text(line);
    for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
    return fields;
}

std::optional<Preferred> preferred_of(const std::string& word) {
    if (word == "A") return Preferred::left;
    if (word == "B") return Preferred::right;
    if (word == "none") return Preferred::none;
    return std::nullopt;
}

}  // namespace

Status read_choices(const std::string& csv, const std::string& file_name, const Kit& kit,
                    std::vector<Choice>& choices) {
    // A spreadsheet writes a byte order mark.
    std::istringstream text(csv.starts_with("\xef\xbb\xbf") ? csv.substr(3) : csv);
    std::string line;
    for (size_t number = 1; std::getline(text, line) || number == 1; ++number) {
        const auto error = [&](const auto&... words) {
            return Status(StatusCode::input, concat(file_name, ":", number, ": ", words...));
        };
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (number == 1) {
            if (line != kHeader) return error("the first line is not ", kHeader);
            continue;
        }
        if (line.empty()) continue;
        const auto fields = fields_of(line);
        if (fields.size() != 5) return error("has ", fields.size(), " fields instead of 5");
        if (fields[0] != kit.id)
            return error("belongs to kit ", fields[0], ", and this folder is kit ", kit.id,
                         "; name the folder whose page was shown");
        size_t trial = 0;
        const char* end = fields[2].data() + fields[2].size();
        const auto read = std::from_chars(fields[2].data(), end, trial);
        if (read.ec != std::errc() || read.ptr != end || trial < 1 || trial > kit.trials.size())
            return error("trial ", fields[2], " is not in 1..", kit.trials.size());
        const auto preferred = preferred_of(fields[3]);
        if (!preferred) return error("choice ", fields[3], " is not A, B or none");
        if (fields[1].empty()) return error("names no observer");
        const Choice choice{fields[1], trial - 1, *preferred};
        if (std::any_of(choices.begin(), choices.end(), [&](const Choice& other) {
                return other.observer == choice.observer && other.trial == choice.trial;
            }))
            return error("observer '", choice.observer, "' has answered trial ", trial,
                         " before; give each file once, and observers different names");
        choices.push_back(choice);
    }
    return Status();
}

std::vector<PairCounts> results_of(const Kit& kit, const std::vector<Choice>& choices) {
    std::vector<PairCounts> results;
    for (size_t b = 1; b < kit.sides.size(); ++b)
        for (size_t a = 0; a < b; ++a) {
            PairCounts counts;
            counts.a = a;
            counts.b = b;
            results.push_back(counts);
        }
    for (const Choice& choice : choices) {
        const Trial& trial = kit.trials[choice.trial];
        for (PairCounts& counts : results) {
            const bool turned = trial.left == counts.b && trial.right == counts.a;
            if (!turned && !(trial.left == counts.a && trial.right == counts.b)) continue;
            if (choice.preferred == Preferred::none)
                ++counts.for_none;
            else
                ++((choice.preferred == Preferred::left) != turned ? counts.for_a : counts.for_b);
        }
    }
    std::vector<double> alone;
    for (PairCounts& counts : results) {
        const int decided = counts.for_a + counts.for_b;
        if (decided > 0) counts.share_b = experiment::share_interval(counts.for_b, decided);
        counts.probability = experiment::sign_probability(counts.for_a, counts.for_b);
        alone.push_back(counts.probability);
    }
    const auto corrected = experiment::holm(alone);
    for (size_t i = 0; i < results.size(); ++i) results[i].corrected = corrected[i];
    return results;
}

std::string words_of(const Kit& kit, const PairCounts& counts) {
    std::string text =
        concat(kit.sides[counts.b], " against ", kit.sides[counts.a], ": ", counts.for_b, " to ",
               counts.for_a, ", no difference ", report::counted(size_t(counts.for_none), "time"));
    if (!counts.share_b) return text;
    const auto percent = [](double share) { return std::lround(100 * share); };
    return concat(text, "; preferred in ",
                  percent(double(counts.for_b) / (counts.for_a + counts.for_b)), " % (",
                  percent(counts.share_b->low), " to ", percent(counts.share_b->high), " %), p ",
                  report::figure(counts.corrected), counts.corrected < 0.05 ? "" : ": not decided");
}

io::Json results_json(const Kit& kit, const std::vector<PairCounts>& results, size_t observers) {
    io::Json pairs = io::Json::array();
    for (const PairCounts& counts : results)
        pairs.push_back(
            {{"a", kit.sides[counts.a]},
             {"b", kit.sides[counts.b]},
             {"for_a", counts.for_a},
             {"for_b", counts.for_b},
             {"no_difference", counts.for_none},
             {"share_b_interval", counts.share_b
                                      ? io::Json::array({counts.share_b->low, counts.share_b->high})
                                      : io::Json()},
             {"probability", counts.probability},
             {"probability_holm", counts.corrected},
             {"words", words_of(kit, counts)}});
    return {{"postchain_blind_results", 1},
            {"kit", kit.id},
            {"observers", observers},
            {"trials", kit.trials.size()},
            {"pairs", pairs}};
}

}  // namespace postchain::blind

#include "tools/measure/blind/comparison.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

#include "chain/base/parameter.h"
#include "tools/measure/experiment/statistics.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/words.h"
#include "tools/page/page.h"
#include "tools/sequence/image/png.h"

namespace postchain::blind {
namespace {

using io::Json;

// Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    // 0 .. n - 1; the bias for the small n here is below 1e-15.
    size_t below(size_t n) {
        uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return size_t((z ^ (z >> 31)) % n);
    }

  private:
    uint64_t state_;
};

std::string identity_of(const Comparison& comparison) {
    std::string text = comparison.images + "\n";
    for (const auto& side : comparison.sides) text += side + "\n";
    for (const Trial& trial : comparison.trials)
        text += concat(trial.frame, " ", trial.left, " ", trial.right, "\n");
    return text;
}

constexpr const char* kHeader = "comparison,observer,trial,choice,seconds";

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

Comparison make_comparison(const std::vector<std::string>& sides, const std::vector<int>& frames,
                           uint64_t seed, const std::vector<Picture>& pictures) {
    Comparison comparison;
    comparison.sides = sides;
    std::string hashes;
    for (const Picture& one : pictures) hashes += hex_of(hash_text(one.png));
    comparison.images = hex_of(hash_text(hashes));
    Random random(seed);
    for (const int frame : frames)
        for (size_t b = 1; b < sides.size(); ++b)
            for (size_t a = 0; a < b; ++a)
                comparison.trials.push_back(random.below(2) ? Trial{frame, b, a}
                                                            : Trial{frame, a, b});
    for (size_t i = comparison.trials.size(); i > 1; --i)
        std::swap(comparison.trials[i - 1], comparison.trials[random.below(i)]);
    comparison.id = hex_of(hash_text(identity_of(comparison)));
    return comparison;
}

std::string key_text(const Comparison& comparison) {
    Json trials = Json::array();
    for (const Trial& trial : comparison.trials)
        trials.push_back({{"frame", trial.frame},
                          {"left", comparison.sides[trial.left]},
                          {"right", comparison.sides[trial.right]}});
    return io::json_text({{"postchain_blind", 1},
                          {"comparison", comparison.id},
                          {"images", comparison.images},
                          {"sides", comparison.sides},
                          {"trials", trials}},
                         1) +
           "\n";
}

Result<Comparison> comparison_from(const std::string& text, const std::string& file_name) {
    Comparison comparison;
    try {
        const auto read = io::read_json(text, file_name, io::kReportLimits);
        const Json json = read.ok() ? *read : Json();
        comparison.id = json.at("comparison").get<std::string>();
        comparison.images = json.at("images").get<std::string>();
        comparison.sides = json.at("sides").get<std::vector<std::string>>();
        std::map<std::string, size_t> index;
        for (size_t s = 0; s < comparison.sides.size(); ++s) index[comparison.sides[s]] = s;
        for (const Json& trial : json.at("trials"))
            comparison.trials.push_back({trial.at("frame").get<int>(),
                                         index.at(trial.at("left").get<std::string>()),
                                         index.at(trial.at("right").get<std::string>())});
        if (json.at("postchain_blind") == 1 &&
            comparison.id == hex_of(hash_text(identity_of(comparison))))
            return comparison;
    } catch (const std::exception&) {
    }
    return Status(StatusCode::input,
                  file_name +
                      ": is not the key of a blind comparison, or was changed; make the "
                      "folder again with postchain blind");
}

std::string page_of(const Comparison& comparison, const std::vector<Picture>& pictures) {
    // In an order that says nothing about sides.
    std::map<std::pair<int, size_t>, size_t> given;
    Json trials = Json::array(), images = Json::array();
    const auto index_of = [&](int frame, size_t side) -> Json {
        for (const Picture& picture : pictures) {
            if (picture.frame != frame || picture.side != side) continue;
            const auto [at, added] = given.emplace(std::pair(frame, side), images.size());
            if (added) images.push_back(io::base64_of(picture.png));
            return at->second;
        }
        return Json();
    };
    for (const Trial& trial : comparison.trials) {
        const Json left = index_of(trial.frame, trial.left);
        const Json right = index_of(trial.frame, trial.right);
        trials.push_back({{"left", left},
                          {"right", right},
                          {"truth", index_of(trial.frame, comparison.sides.size())}});
    }
    return page::with_data(
        "blind/page.html",
        io::json_text({{"comparison", comparison.id}, {"trials", trials}, {"images", images}}));
}

Status read_choices(const std::string& csv, const std::string& file_name,
                    const Comparison& comparison, std::vector<Choice>& choices) {
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
        if (fields[0] != comparison.id)
            return error("belongs to comparison ", fields[0], ", and this folder is comparison ",
                         comparison.id, "; name the folder whose page was shown");
        size_t trial = 0;
        const char* end = fields[2].data() + fields[2].size();
        const auto read = std::from_chars(fields[2].data(), end, trial);
        if (read.ec != std::errc() || read.ptr != end || trial < 1 ||
            trial > comparison.trials.size())
            return error("trial ", fields[2], " is not in 1..", comparison.trials.size());
        const auto preferred = preferred_of(fields[3]);
        if (!preferred) return error("choice ", fields[3], " is not A, B or none");
        if (fields[1].empty()) return error("names no observer");
        const Choice choice{fields[1], trial - 1, *preferred};
        if (std::ranges::any_of(choices, [&](const Choice& other) {
                return other.observer == choice.observer && other.trial == choice.trial;
            }))
            return error("observer '", choice.observer, "' has answered trial ", trial,
                         " before; give each file once, and observers different names");
        choices.push_back(choice);
    }
    return Status();
}

std::vector<PairCounts> results_of(const Comparison& comparison,
                                   const std::vector<Choice>& choices) {
    std::vector<PairCounts> results;
    for (size_t b = 1; b < comparison.sides.size(); ++b)
        for (size_t a = 0; a < b; ++a) {
            PairCounts counts;
            counts.a = a;
            counts.b = b;
            results.push_back(counts);
        }
    for (const Choice& choice : choices) {
        const Trial& trial = comparison.trials[choice.trial];
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

std::string words_of(const Comparison& comparison, const PairCounts& counts) {
    std::string text = concat(comparison.sides[counts.b], " against ", comparison.sides[counts.a],
                              ": ", counts.for_b, " to ", counts.for_a, ", no difference ",
                              report::counted(size_t(counts.for_none), "time"));
    if (!counts.share_b) return text;
    const auto percent = [](double share) { return std::lround(100 * share); };
    return concat(text, "; preferred in ",
                  percent(double(counts.for_b) / (counts.for_a + counts.for_b)), " % (",
                  percent(counts.share_b->low), " to ", percent(counts.share_b->high), " %), p ",
                  report::figure(counts.corrected), counts.corrected < 0.05 ? "" : ": not decided");
}

Json results_json(const Comparison& comparison, const std::vector<PairCounts>& results,
                  size_t observers) {
    Json pairs = Json::array();
    for (const PairCounts& counts : results)
        pairs.push_back({{"a", comparison.sides[counts.a]},
                         {"b", comparison.sides[counts.b]},
                         {"for_a", counts.for_a},
                         {"for_b", counts.for_b},
                         {"no_difference", counts.for_none},
                         {"share_b_interval", counts.share_b},
                         {"probability", counts.probability},
                         {"probability_holm", counts.corrected},
                         {"words", words_of(comparison, counts)}});
    return {{"postchain_blind_results", 1},
            {"comparison", comparison.id},
            {"observers", observers},
            {"trials", comparison.trials.size()},
            {"pairs", pairs}};
}

}  // namespace postchain::blind

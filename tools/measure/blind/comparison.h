// A blind comparison: pairs of images in random order on a page that does not say which is which,
// the key that does, and the choices of observers.
//
//   sides x frames --make_comparison()--> Comparison --page_of()--> index.html, for observers
//                                      --key_text()--> key.json, for whoever evaluates
//   choices.csv + Comparison --read_choices()--> choices --results_of()--> a row for each pair of
//   sides
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/measure/report/report.h"
#include "tools/sequence/files/json.h"

namespace postchain::blind {

inline constexpr size_t kMaxTrials = 1000;

// Two sides of one frame.
struct Trial {
    int frame = 0;
    size_t left = 0, right = 0;  // indices of sides
};

struct Picture {
    int frame = 0;
    size_t side = 0;  // as many as sides: the ground truth
    std::string png;
};

struct Comparison {
    std::string id;      // hash of sides, trials and images, as 16 digits; choices name it
    std::string images;  // hash
    std::vector<std::string> sides;
    std::vector<Trial> trials;  // in the order in which they are shown
};
// Every pair of sides on every frame, in an order and with sides that depend on the seed only.
Comparison make_comparison(const std::vector<std::string>& sides, const std::vector<int>& frames,
                           uint64_t seed, const std::vector<Picture>& pictures);

std::string key_text(const Comparison& comparison);
// Errors (input): key_text() did not make `text`.
Result<Comparison> comparison_from(const std::string& text, const std::string& file_name);

// Holds each image once, in the order of their first use.
std::string page_of(const Comparison& comparison, const std::vector<Picture>& pictures);

enum class Preferred { left, right, none };
struct Choice {
    std::string observer;
    size_t trial = 0;
    Preferred preferred = Preferred::none;
};

// Adds the rows of a CSV: comparison,observer,trial,choice,seconds. Errors (input), with file and
// line: another header, another comparison, a trial that the comparison lacks, an unknown choice,
// an observer who has answered the trial before.
Status read_choices(const std::string& csv, const std::string& file_name,
                    const Comparison& comparison, std::vector<Choice>& choices);

struct PairCounts {
    size_t a = 0, b = 0;  // sides, a before b
    int for_a = 0, for_b = 0, for_none = 0;
    std::optional<report::Interval> share_b;  // 95 %, of the choices for a or b
    double probability = 1;                   // two-sided, if a and b are preferred equally often
    double corrected = 1;                     // by Holm, for all pairs
};
std::vector<PairCounts> results_of(const Comparison& comparison,
                                   const std::vector<Choice>& choices);
// "joint against lens: 14 to 3, 5 without a difference; preferred in 82 % (57 to 96 %), p 0.013"
std::string words_of(const Comparison& comparison, const PairCounts& counts);
io::Json results_json(const Comparison& comparison, const std::vector<PairCounts>& results,
                      size_t observers);

}  // namespace postchain::blind

// Choices of observers of a blind comparison, and their evaluation.
//
//   choices.csv + Kit --read_choices()--> choices --results_of()--> a row for each pair of sides
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/measure/blind/kit.h"
#include "tools/measure/report/report.h"
#include "tools/sequence/files/json.h"

namespace postchain::blind {

enum class Preferred { left, right, none };
struct Choice {
    std::string observer;
    size_t trial = 0;
    Preferred preferred = Preferred::none;
};

// Adds the rows of a CSV: kit,observer,trial,choice,seconds. Errors (input), with file and line:
// another header, another kit, a trial that the kit lacks, an unknown choice, an observer who has
// answered the trial before.
Status read_choices(const std::string& csv, const std::string& file_name, const Kit& kit,
                    std::vector<Choice>& choices);

struct PairCounts {
    size_t a = 0, b = 0;  // sides, a before b
    int for_a = 0, for_b = 0, for_none = 0;
    std::optional<report::Interval> share_b;  // 95 %, of the choices for a or b
    double probability = 1;                   // two-sided, if a and b are preferred equally often
    double corrected = 1;                     // by Holm, for all pairs
};
std::vector<PairCounts> results_of(const Kit& kit, const std::vector<Choice>& choices);
// "joint against lens: 14 to 3, 5 without a difference; preferred in 82 % (57 to 96 %), p 0.013"
std::string words_of(const Kit& kit, const PairCounts& counts);
io::Json results_json(const Kit& kit, const std::vector<PairCounts>& results, size_t observers);

}  // namespace postchain::blind

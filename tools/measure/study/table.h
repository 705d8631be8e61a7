// The table of a study: figures of scenes -> means of families, mean over families, and the finding
// for each pair of chains.
//
//   frames of a scene --mean--> scene --mean--> family --mean, 95 % t interval, signs--> study
//                                                     \--tests, Holm over the questions--> finding
//
// A gain is how much closer B is to ground truth than A, frame by frame of one scene: A - B of an
// error, B - A of psnr and ssim, |A - 1| - |B - 1| of a ratio. Above 0 always favors B. The family
// is the task, because scenes of one family are not independent.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/measure/report/report.h"

namespace postchain::study {

using Values = std::vector<std::optional<double>>;

// Figures of one scene. Frames of one pair are those of one call of ab; a missing value is null.
struct SceneFigures {
    std::string scene, family;
    std::map<size_t, std::map<std::string, Values>> variants;  // index, metric -> per frame
    struct Pair {
        std::map<std::string, Values> a, b;  // metric -> per frame
    };
    std::map<size_t, Pair> pairs;  // index of the pair
};

struct Row {
    std::string name, family;  // family: of a scene; empty in a family's row
    size_t scenes = 1;         // in it
    Values means;              // by variant
    Values gains;              // by pair
};

// Below 5 % after Holm's correction over the questions: a, b: the gain is not 0; equal: it is not
// decided, and within the margin.
enum class Decision { too_few, not_decided, equal, a, b };
struct Probability {
    double alone = 1, corrected = 1;
    bool decides() const { return corrected < 0.05; }
};
struct PairResult {
    std::optional<double> mean;  // gain, over families
    std::optional<report::Interval> interval;
    std::optional<Probability> difference;   // probability of such a gain if there is no difference
    std::optional<double> margin;            // a gain below it is called no difference
    std::optional<Probability> equivalence;  // probability if the true gain is beyond the margin
    int families = 0;
    int nearer = 0;   // families whose gain is above 0
    int farther = 0;  // below
    int scenes = 0;
    int scenes_nearer = 0;
    double sign_probability = 1;  // two-sided: of signs at least as uneven by chance
    Decision decision = Decision::too_few;
    std::string words;
};

struct MetricTable {
    report::MetricInfo metric;
    std::vector<Row> scenes, families;
    Values means;                // by variant, over the families that have all variants
    std::optional<size_t> best;  // the closest of these to ground truth
    std::vector<PairResult> pairs;
};

// Gains that are called no difference (docs/studies.md); none for metrics in units of the scene's
// light.
std::optional<double> default_margin(const std::string& metric);

// How much closer to ground truth b is than a.
double gain_of(report::Better better, double a, double b);

// A table for each metric that has a value. Rows are in the order of `scenes`; families in the
// order in which they appear. `margins`: by metric, instead of the defaults.
std::vector<MetricTable> tables_of(const std::vector<report::MetricInfo>& metrics,
                                   const std::vector<std::string>& variants,
                                   const std::vector<std::pair<size_t, size_t>>& pairs,
                                   const std::vector<SceneFigures>& scenes,
                                   const std::map<std::string, double>& margins = {});

}  // namespace postchain::study

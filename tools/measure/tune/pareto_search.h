// Walks along the Pareto front of error and time (Pareto local search: Paquete, Chiarandini,
// Stuetzle 2004).
//
//   starts --measure--> candidates --front--> closest to the goal --steps--> new chains
//   --measure--> ...
//
// It ends when every step from the front has been measured, or after a number of chains. Every
// point it states has been measured; nothing is interpolated. The chosen chain is timed a second
// time, because the best of several noisy times is too good.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/measure/tune/knobs.h"

namespace postchain::tune {

// Exactly one is set.
struct Goal {
    std::optional<double> budget_s;  // seconds per frame, at most
    std::optional<double> error;     // mean HDR-FLIP, at most
};

struct Times {
    double seconds = 0;   // per frame: mean over the frames of the median of the repetitions
    double spread_s = 0;  // mean over the frames of the interquartile range
    int repeats = 0;      // repetitions of each frame
    std::string doubt;    // why the times are not trustworthy; empty: they are
};

struct Measured {
    Times times;
    std::optional<double> error;  // none: far beyond the budget, so not measured
};

// Measures the cost and the error of a chain, which takes long and may fail.
class ChainEvaluator {
  public:
    virtual ~ChainEvaluator() = default;
    virtual Result<Measured> measure(const Chain& chain) = 0;
    virtual Result<Times> time_again(const Chain& chain) = 0;  // more repetitions than measure()
};

struct Candidate {
    Chain chain;
    std::string name;  // start's name; empty: found by the search
    Measured measured;
    bool expanded = false;   // all of its steps are measured
    bool confirmed = false;  // the times come from time_again()
};

struct ParetoSearch {
    std::vector<Candidate> candidates;  // in the order they were measured; the starts first
    std::optional<size_t> chosen;       // none: no chain meets the goal
    bool complete = false;              // false: the number of chains, or a stop, ended it
    bool stopped = false;               // `chosen`: the best so far, which may not meet the goal

    // Chains that no other beats in both error and time, the fastest first.
    std::vector<size_t> front() const;
    std::optional<size_t> fastest() const;
    std::optional<size_t> closest() const;  // index of the point of least error
};

bool meets(const Goal& goal, const Measured& measured);

struct Start {
    std::string name;  // "balanced"
    Chain chain;
};
using Steps = std::function<std::vector<Step>(const Chain&)>;
// Measures at most `most` chains, but every start. Errors: those of the evaluator; but if it is
// canceled and an error was measured, the search so far, which `stopped`.
Result<ParetoSearch> search_front(std::vector<Start> starts, const Steps& steps, const Goal& goal,
                                  int most, ChainEvaluator& evaluator);

}  // namespace postchain::tune

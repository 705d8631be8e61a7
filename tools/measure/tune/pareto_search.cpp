#include "tools/measure/tune/pareto_search.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace postchain::tune {
namespace {

// Whether `a` makes `b` superfluous. On a tie the earlier one stays.
bool beats(const Measured& a, const Measured& b, bool a_is_earlier) {
    if (!a.error || !b.error) return false;
    const bool better = a.times.seconds < b.times.seconds || *a.error < *b.error;
    return a.times.seconds <= b.times.seconds && *a.error <= *b.error && (better || a_is_earlier);
}

// The chain of least `value` that has one.
template <class Value>
std::optional<size_t> least(const std::vector<Candidate>& candidates, const Value& value) {
    std::optional<size_t> best;
    double least = 0;
    for (size_t i = 0; i < candidates.size(); ++i) {
        const std::optional<double> here = value(i);
        if (!here || (best && *here >= least)) continue;
        best = i;
        least = *here;
    }
    return best;
}

class Searcher {
  public:
    Searcher(const Steps& steps, const Goal& goal, int most, ChainEvaluator& evaluator)
        : steps_(steps), goal_(goal), most_(size_t(most)), evaluator_(evaluator) {}

    Result<ParetoSearch> run(std::vector<Start> starts) {
        const Status status = walk(std::move(starts));
        if (status.ok()) {
            result_.complete = !stopped_early_;
            return std::move(result_);
        }
        if (status.code() != StatusCode::canceled) return status;
        result_.chosen = choice();
        if (!result_.chosen)
            result_.chosen = least(result_.candidates, [&](size_t i) {
                return result_.candidates[i].measured.error ? value_of(i) : std::nullopt;
            });
        if (!result_.chosen) return status;
        result_.stopped = true;
        return std::move(result_);
    }

  private:
    Status walk(std::vector<Start> starts) {
        for (Start& start : starts) RETURN_IF_ERROR(attempt(std::move(start.chain), start.name));
        // A time that does not hold may leave no chain within the budget; then the walk continues.
        do {
            while (const auto next = next_to_expand()) RETURN_IF_ERROR(expand(*next));
            RETURN_IF_ERROR(confirm());
        } while (!result_.chosen && next_to_expand());
        return Status();
    }

    bool full() const { return result_.candidates.size() >= most_; }

    Status attempt(Chain chain, const std::string& name) {
        if (!known_.insert(chain.text()).second) return Status();
        ASSIGN_OR_RETURN(auto measured, evaluator_.measure(chain));
        result_.candidates.push_back({std::move(chain), name, std::move(measured)});
        return Status();
    }

    std::optional<double> value_of(size_t i) const {
        const Measured& measured = result_.candidates[i].measured;
        return goal_.budget_s ? measured.times.seconds : measured.error;
    }

    // While nothing meets the goal, the chain closest to it; then the unexpanded point of the
    // front that is closest to it.
    std::optional<size_t> next_to_expand() {
        const bool met = choice().has_value();
        const std::vector<size_t> front = result_.front();
        const double limit = goal_.budget_s ? *goal_.budget_s : *goal_.error;
        const auto next = least(result_.candidates, [&](size_t i) -> std::optional<double> {
            if (result_.candidates[i].expanded) return std::nullopt;
            if (!met) return value_of(i);
            if (std::ranges::find(front, i) == front.end()) return std::nullopt;
            return std::abs(std::log(std::max(*value_of(i), 1e-12) / limit));
        });
        if (next && full()) {
            stopped_early_ = true;
            return std::nullopt;
        }
        return next;
    }

    // From a chain beyond the budget no step leads to more time; from one that has reached the
    // error, none needs to.
    bool worthwhile(const Measured& from, Cost cost) const {
        if (cost != Cost::more) return true;
        return goal_.budget_s ? meets(goal_, from) : !meets(goal_, from);
    }

    Status expand(size_t i) {
        const Measured from = result_.candidates[i].measured;
        for (Step& step : steps_(result_.candidates[i].chain)) {
            if (!worthwhile(from, step.cost)) continue;
            if (full() && !known_.contains(step.chain.text())) return Status();
            RETURN_IF_ERROR(attempt(std::move(step.chain), ""));
        }
        result_.candidates[i].expanded = true;
        return Status();
    }

    std::optional<size_t> choice() const {
        return least(result_.candidates, [&](size_t i) -> std::optional<double> {
            const Measured& measured = result_.candidates[i].measured;
            if (!meets(goal_, measured)) return std::nullopt;
            return goal_.budget_s ? *measured.error : measured.times.seconds;
        });
    }

    // Each pass confirms one more chain, so it ends.
    Status confirm() {
        while ((result_.chosen = choice()) && !result_.candidates[*result_.chosen].confirmed) {
            Candidate& chosen = result_.candidates[*result_.chosen];
            ASSIGN_OR_RETURN(chosen.measured.times, evaluator_.time_again(chosen.chain));
            chosen.confirmed = true;
        }
        return Status();
    }

    const Steps& steps_;
    const Goal& goal_;
    const size_t most_;
    ChainEvaluator& evaluator_;
    ParetoSearch result_;
    std::set<std::string> known_;  // texts of the candidates' chains
    bool stopped_early_ = false;
};

}  // namespace

bool meets(const Goal& goal, const Measured& measured) {
    if (!measured.error) return false;
    return goal.budget_s ? measured.times.seconds <= *goal.budget_s
                         : *measured.error <= *goal.error;
}

std::vector<size_t> ParetoSearch::front() const {
    std::vector<size_t> found;
    for (size_t i = 0; i < candidates.size(); ++i) {
        bool beaten = !candidates[i].measured.error;
        for (size_t j = 0; j < candidates.size() && !beaten; ++j)
            beaten = j != i && beats(candidates[j].measured, candidates[i].measured, j < i);
        if (!beaten) found.push_back(i);
    }
    std::ranges::sort(found, {}, [&](size_t i) { return candidates[i].measured.times.seconds; });
    return found;
}

std::optional<size_t> ParetoSearch::fastest() const {
    return least(candidates,
                 [&](size_t i) { return std::optional(candidates[i].measured.times.seconds); });
}

std::optional<size_t> ParetoSearch::closest() const {
    return least(candidates, [&](size_t i) { return candidates[i].measured.error; });
}

Result<ParetoSearch> search_front(std::vector<Start> starts, const Steps& steps, const Goal& goal,
                                  int most, ChainEvaluator& evaluator) {
    return Searcher(steps, goal, most, evaluator).run(std::move(starts));
}

}  // namespace postchain::tune

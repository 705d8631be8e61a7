// Budgets of time that a host gave to chains, and the samples that keep within them. The host's
// chain keeps its own values: what runs is a copy with fewer samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "chain/gl/clock.h"
#include "chain/guest/chain_handle.h"
#include "chain/guest/failure.h"

namespace postchain::guest {

class SampleController {
  public:
    static constexpr std::array<double, 5> kParts = {1, 0.75, 0.5, 0.375, 0.25};
    static constexpr double kMinSeconds = 0.5;  // between two changes

    // `least`: the smallest part it may choose.
    explicit SampleController(double budget_ms, double least)
        : budget_ms_(budget_ms), least_(least) {}

    // The time of a frame that ran with the present part.
    void add(double milliseconds);
    // Changes the part if the times since the last change ask for it; true if it did. It goes down
    // to the first part that fits if times follow the samples, and up by one part if that fits with
    // a tenth to spare. `now`: seconds, of any origin.
    bool change(double now);

    // Takes the last change() back. It is tried again as if it had been made.
    void take_back() { level_ = before_; }

    double part() const { return kParts[level_]; }
    double budget_ms() const { return budget_ms_; }
    // The median time at the present part; 0: not known yet.
    double milliseconds() const;
    uint64_t changes() const { return changes_; }

  private:
    static constexpr size_t kMinFrames = 4, kMaxFrames = 8;

    double budget_ms_, least_;
    size_t level_ = 0, before_ = 0;              // before_: of the last change
    std::array<double, kMaxFrames> times_ = {};  // the newest, in no order
    size_t frames_ = 0;                          // since the last change
    double changed_ = -1e30;                     // when
    uint64_t changes_ = 0;
};

class Budgets {
  public:
    // PC_ERROR_CHAIN: no pass reads a number of samples. PC_ERROR_ARGUMENT: a value of the budget.
    Failure set(const ChainVersion& chain, const pc_budget& budget);
    void query(const ChainVersion& chain, pc_budget_state& state) const;
    // Before the chain's frame `tag`, a number that increases: takes the times of every chain's
    // newest finished frame, tagged likewise, into account, and decides the part of this one's
    // samples. True if it has a budget: the frame must be timed.
    bool govern(const ChainVersion& chain, gl::Clock& clock, uint64_t tag);
    // Takes the change of samples back that govern() has just made, if it made one.
    bool undo(const ChainVersion& chain);
    // The chain as it runs: with the samples of its part, or as the host has it.
    ChainVersion version(const ChainVersion& chain);
    // The chain with the samples of every part that govern() may choose; none without a budget.
    std::vector<Chain> variants(const ChainVersion& chain) const;
    // Chains that have a budget. Those of destroyed chains go with the next set() or govern().
    size_t size() const { return all_.size(); }

  private:
    struct Governed {
        void take_times(gl::Clock& clock);

        uint64_t chain;
        std::weak_ptr<const uint64_t> life;  // of the chain
        SampleController controller;
        // The copy of the host's `revision` with `part` of its samples.
        ChainVersion scaled = {};
        uint64_t revision = 0;
        double part = 1;
        std::array<uint64_t, 8> ran = {};  // tags of its frames since the last change
        size_t runs = 0;
        uint64_t last = 0;     // tag of the times that were taken last
        bool changed = false;  // by the last govern()
    };
    const Governed* find(uint64_t chain) const;
    Governed* find(uint64_t chain) {
        return const_cast<Governed*>(std::as_const(*this).find(chain));
    }
    void forget_destroyed();

    std::vector<Governed> all_;
};

}  // namespace postchain::guest

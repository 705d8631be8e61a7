// Budgets of time that a host gave to chains, and the samples that keep within them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "chain/gl/clock.h"
#include "chain/guest/chain_handle.h"
#include "chain/guest/failure.h"
#include "chain/guest/governor.h"

namespace postchain::guest {

class Budgets {
  public:
    // PC_ERROR_CHAIN: no pass reads a number of samples. PC_ERROR_ARGUMENT: a value of the budget.
    Failure set(ChainHandle& chain, const pc_budget& budget);
    void query(const ChainHandle& chain, pc_budget_state& state) const;
    // Before the chain's frame `tag`, a number that increases: takes the times of its newest
    // finished frame, tagged likewise, into account, and sets the chain's samples. True if the
    // chain has a budget: the frame must be timed.
    bool govern(ChainHandle& chain, gl::Clock& clock, uint64_t tag);
    // Takes the change of samples back that govern() has just made, if it made one.
    bool undo(ChainHandle& chain);
    // The chain with the samples of every part that govern() may choose; none without a budget.
    std::vector<Chain> variants(const ChainHandle& chain) const;
    // Chains that have a budget. Those of destroyed chains go with the next set() or govern().
    size_t size() const { return all_.size(); }

  private:
    // A parameter that is a number of samples.
    struct Samples {
        uint32_t pass;
        const Parameter* row;
        int64_t full;  // the host's
        int64_t now;
    };
    struct Governed {
        uint64_t chain;
        std::weak_ptr<const uint64_t> life;  // of the chain
        Governor governor;
        std::vector<Samples> samples;
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
    static int64_t scaled(const std::vector<Samples>& all, const Samples& one, double part);
    static void set_samples(ChainHandle& chain, Governed& governed, double part);

    std::vector<Governed> all_;
};

}  // namespace postchain::guest

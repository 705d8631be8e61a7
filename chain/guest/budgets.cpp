#include "chain/guest/budgets.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace postchain::guest {
namespace {

double now_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

// The nearest value that the row takes.
int64_t nearest(const Parameter& row, double value) {
    if (!row.allowed.empty())
        return *std::min_element(row.allowed.begin(), row.allowed.end(), [&](auto a, auto b) {
            return std::abs(double(a) - value) < std::abs(double(b) - value);
        });
    const int64_t rounded = std::max(int64_t(std::llround(value)), int64_t(row.min));
    return row.odd ? rounded | 1 : rounded;
}

}  // namespace

const Budgets::Governed* Budgets::find(uint64_t chain) const {
    for (const Governed& one : all_)
        if (one.chain == chain) return &one;
    return nullptr;
}

void Budgets::set_samples(ChainHandle& chain, Governed& governed, double part) {
    for (Samples& samples : governed.samples) {
        const int64_t before = chain.integer(samples.pass, *samples.row);
        if (before != samples.now) samples.full = before;  // the host has set it meanwhile
        samples.now = nearest(*samples.row, double(samples.full) * part);
        if (samples.now != before) chain.set(samples.pass, samples.row->key, samples.now);
    }
}

Failure Budgets::set(ChainHandle& chain, const pc_budget& budget) {
    if (!(budget.milliseconds >= 0) || !std::isfinite(budget.milliseconds))
        return {PC_ERROR_ARGUMENT,
                concat("milliseconds: ", budget.milliseconds, "; give a time, or 0 for no budget")};
    if (budget.least != 0 && !(budget.least >= 0.25f && budget.least <= 1))
        return {PC_ERROR_ARGUMENT, concat("least: ", budget.least, " is not within 0.25 and 1")};
    const auto found = std::find_if(all_.begin(), all_.end(),
                                    [&](const Governed& one) { return one.chain == chain.id(); });
    if (found != all_.end()) {
        set_samples(chain, *found, 1);
        all_.erase(found);
    }
    if (budget.milliseconds == 0) return {};
    const double least = budget.least == 0 ? 0.25 : double(budget.least);
    Governed governed{chain.id(), Governor(double(budget.milliseconds), least), {}};
    for (const auto& [pass, row] : chain.samples()) {
        const int64_t full = chain.integer(pass, *row);
        governed.samples.push_back({pass, row, full, full});
    }
    if (governed.samples.empty())
        return {PC_ERROR_CHAIN,
                "no pass of the chain has samples, so nothing makes it quicker; leave passes out"};
    all_.push_back(std::move(governed));
    return {};
}

void Budgets::query(const ChainHandle& chain, pc_budget_state& state) const {
    const Governed* governed = find(chain.id());
    state.milliseconds = governed ? float(governed->governor.budget_ms()) : 0;
    state.part = governed ? float(governed->governor.part()) : 1;
    state.frame_ms = governed ? float(governed->governor.milliseconds()) : 0;
    state.changes = governed ? uint32_t(governed->governor.changes()) : 0;
}

bool Budgets::govern(ChainHandle& chain, const gl::Times* newest, uint64_t tag) {
    Governed* governed = find(chain.id());
    if (!governed) return false;
    const auto end =
        governed->ran.begin() + std::ptrdiff_t(std::min(governed->runs, governed->ran.size()));
    if (newest && newest->tag > governed->last &&
        std::find(governed->ran.begin(), end, newest->tag) != end) {
        governed->last = newest->tag;
        governed->governor.add(newest->milliseconds());
    }
    if (governed->governor.change(now_seconds())) {
        set_samples(chain, *governed, governed->governor.part());
        governed->runs = 0;
    }
    governed->ran[governed->runs++ % governed->ran.size()] = tag;
    return true;
}

}  // namespace postchain::guest

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

// Adaptive sampling stays on, because it selects a program.
int64_t Budgets::scaled(const std::vector<Samples>& all, const Samples& one, double part) {
    const int64_t value = nearest(*one.row, double(one.full) * part);
    for (const Samples& least : all)
        if (&least != &one && least.pass == one.pass && one.row->key == "max_samples" &&
            one.full > least.full)
            return std::max(value, nearest(*least.row, double(least.full) * part) + 1);
    return value;
}

void Budgets::set_samples(ChainHandle& chain, Governed& governed, double part) {
    for (Samples& samples : governed.samples) {
        const int64_t before = chain.integer(samples.pass, *samples.row);
        if (before != samples.now) samples.full = before;  // the host has set it meanwhile
        samples.now = scaled(governed.samples, samples, part);
        if (samples.now == before) continue;
        (void)chain.set(samples.pass, samples.row->key, samples.now);  // within the row's range
    }
}

void Budgets::forget_destroyed() {
    std::erase_if(all_, [](const Governed& one) { return one.life.expired(); });
}

Failure Budgets::set(ChainHandle& chain, const pc_budget& budget) {
    forget_destroyed();
    if (budget.reserved != 0) return {PC_ERROR_VERSION, "pc_budget.reserved is not 0"};
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
    Governed governed{chain.id(), chain.life(), Governor(double(budget.milliseconds), least), {}};
    for (const auto& [pass, row] : chain.samples()) {
        const int64_t full = chain.integer(pass, *row);
        governed.samples.push_back({pass, row, full, full});
    }
    if (governed.samples.empty())
        return {
            PC_ERROR_CHAIN,
            "no pass of the chain reads a number of samples, so nothing makes it quicker; leave "
            "passes out, or choose a method that has samples"};
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

std::vector<Chain> Budgets::variants(const ChainHandle& chain) const {
    std::vector<Chain> all;
    const Governed* governed = find(chain.id());
    if (!governed) return all;
    for (const double part : Governor::kParts) {
        Chain variant = chain.chain().clone();
        for (const Samples& samples : governed->samples)
            samples.row->set(variant.links[samples.pass].pass->parameters(),
                             scaled(governed->samples, samples, part));
        all.push_back(std::move(variant));
    }
    return all;
}

bool Budgets::undo(ChainHandle& chain) {
    Governed* governed = find(chain.id());
    if (!governed || !governed->changed) return false;
    governed->changed = false;
    governed->governor.take_back();
    set_samples(chain, *governed, governed->governor.part());
    return true;
}

bool Budgets::govern(ChainHandle& chain, gl::Clock& clock, uint64_t tag) {
    forget_destroyed();
    Governed* governed = find(chain.id());
    if (!governed) return false;
    const gl::Times* newest = clock.newest(
        std::span(governed->ran).first(std::min(governed->runs, governed->ran.size())));
    if (newest && newest->tag > governed->last) {
        governed->last = newest->tag;
        governed->governor.add(newest->milliseconds());
    }
    governed->changed = governed->governor.change(now_seconds());
    if (governed->changed) {
        set_samples(chain, *governed, governed->governor.part());
        governed->runs = 0;
    }
    governed->ran[governed->runs++ % governed->ran.size()] = tag;
    return true;
}

}  // namespace postchain::guest

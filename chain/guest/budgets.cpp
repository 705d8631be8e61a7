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

int64_t value_of(const Chain& chain, uint32_t pass, const Parameter& row) {
    return std::get<int64_t>(row.get(chain.links[pass].pass->parameters()));
}

Chain with_part(const ChainVersion& chain, double part) {
    Chain scaled = chain.chain->clone();
    for (const auto& [pass, row] : samples_of(*chain.chain))
        row->set(scaled.links[pass].pass->parameters(),
                 nearest(*row, double(value_of(*chain.chain, pass, *row)) * part));
    return scaled;
}

}  // namespace

void SampleController::add(double milliseconds) {
    times_[frames_++ % kMaxFrames] = milliseconds;
}

double SampleController::milliseconds() const {
    const size_t count = std::min(frames_, kMaxFrames);
    if (count == 0) return 0;
    auto sorted = times_;
    const auto middle = sorted.begin() + std::ptrdiff_t(count / 2);
    std::nth_element(sorted.begin(), middle, sorted.begin() + std::ptrdiff_t(count));
    return *middle;
}

bool SampleController::change(double now) {
    if (frames_ < kMinFrames || now - changed_ < kMinSeconds) return false;
    const double time = milliseconds();
    const auto predicted = [&](size_t level) { return time * kParts[level] / part(); };
    size_t next = level_;
    while (next + 1 < kParts.size() && kParts[next + 1] >= least_ && predicted(next) > budget_ms_)
        ++next;
    if (next == level_ && level_ > 0 && predicted(level_ - 1) <= 0.9 * budget_ms_) --next;
    if (next == level_) return false;
    before_ = level_;
    level_ = next;
    frames_ = 0;
    changed_ = now;
    ++changes_;
    return true;
}

const Budgets::Governed* Budgets::find(uint64_t chain) const {
    for (const Governed& one : all_)
        if (one.chain == chain) return &one;
    return nullptr;
}

void Budgets::forget_destroyed() {
    std::erase_if(all_, [](const Governed& one) { return one.life.expired(); });
}

Failure Budgets::set(const ChainVersion& chain, const pc_budget& budget) {
    forget_destroyed();
    if (budget.reserved != 0) return {PC_ERROR_VERSION, "pc_budget.reserved is not 0"};
    if (!(budget.milliseconds >= 0) || !std::isfinite(budget.milliseconds))
        return {PC_ERROR_ARGUMENT,
                concat("milliseconds: ", budget.milliseconds, "; give a time, or 0 for no budget")};
    if (budget.least != 0 && !(budget.least >= 0.25f && budget.least <= 1))
        return {PC_ERROR_ARGUMENT, concat("least: ", budget.least, " is not within 0.25 and 1")};
    const double least = budget.least == 0 ? 0.25 : double(budget.least);
    if (budget.milliseconds > 0 && samples_of(*chain.chain).empty())
        return {
            PC_ERROR_CHAIN,
            "no pass of the chain reads a number of samples, so nothing makes it quicker; leave "
            "passes out, or choose a method that has samples"};
    std::erase_if(all_, [&](const Governed& one) { return one.chain == chain.id; });
    if (budget.milliseconds > 0)
        all_.push_back(
            {chain.id, chain.life, SampleController(double(budget.milliseconds), least)});
    return {};
}

void Budgets::query(const ChainVersion& chain, pc_budget_state& state) const {
    const Governed* governed = find(chain.id);
    state.milliseconds = governed ? float(governed->controller.budget_ms()) : 0;
    state.part = governed ? float(governed->controller.part()) : 1;
    state.frame_ms = governed ? float(governed->controller.milliseconds()) : 0;
    state.changes = governed ? uint32_t(governed->controller.changes()) : 0;
}

ChainVersion Budgets::version(const ChainVersion& chain) {
    Governed* governed = find(chain.id);
    const double part = governed ? governed->controller.part() : 1;
    if (part == 1) return chain;
    if (governed->revision != chain.revision || governed->part != part) {
        governed->scaled = {std::make_shared<const Chain>(with_part(chain, part)), chain.id,
                            ChainHandle::new_revision(), chain.life};
        governed->revision = chain.revision;
        governed->part = part;
    }
    return governed->scaled;
}

std::vector<Chain> Budgets::variants(const ChainVersion& chain) const {
    std::vector<Chain> all;
    if (!find(chain.id)) return all;
    for (const double part : SampleController::kParts) all.push_back(with_part(chain, part));
    return all;
}

bool Budgets::undo(const ChainVersion& chain) {
    Governed* governed = find(chain.id);
    if (!governed || !governed->changed) return false;
    governed->changed = false;
    governed->controller.take_back();
    return true;
}

void Budgets::Governed::take_times(gl::Clock& clock) {
    const Times* newest = clock.newest(std::span(ran).first(std::min(runs, ran.size())));
    if (!newest || newest->tag <= last) return;
    last = newest->tag;
    controller.add(newest->milliseconds());
}

bool Budgets::govern(const ChainVersion& chain, gl::Clock& clock, uint64_t tag) {
    forget_destroyed();
    // Before a chain runs again, the clock may have written over its times.
    for (Governed& one : all_) one.take_times(clock);
    Governed* governed = find(chain.id);
    if (!governed) return false;
    governed->changed = governed->controller.change(now_seconds());
    if (governed->changed) governed->runs = 0;
    governed->ran[governed->runs++ % governed->ran.size()] = tag;
    return true;
}

}  // namespace postchain::guest

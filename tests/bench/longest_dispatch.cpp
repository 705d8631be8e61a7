// Prints a Markdown table of the longest dispatches of the shipped chains, for an engine's frame
// with neighbors and without known facts: how long a step would take in one dispatch on a small
// integrated GPU, and its longest band (chain/plan/bands.h), from the fetches that the steps count.
//
//   longest_dispatch [--size=WIDTHxHEIGHT] [--steps] [CHAIN...]
//
// --steps: every step. Needs no GL. Fails if a band is longer than 100 ms.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "chain/plan/bands.h"
#include "tests/bench/engine_plan.h"

namespace {

using namespace postchain;
using bench::engine_frame;

constexpr double kMaxMs = 100;
constexpr double kTapsPerMs = kBandTaps / 50;

struct Row {
    std::string name;
    double whole_ms = 0, band_ms = 0;
    int bands = 0;
};

Row row_of(const Plan& plan, const Step& step) {
    const double taps = taps_of_group(step);
    Row row;
    row.name = plan.name_of(step);
    auto columns = unsigned(step.groups[0]), rows = unsigned(step.groups[1]);
    if (step.work_list >= 0) {
        columns = unsigned(plan.textures[size_t(step.work_list)].width);
        rows = 1;
    }
    for (Bands bands(columns, rows); bands.more(); ++row.bands) {
        const double ms = bands.next(kBandTaps / taps).groups() * taps / kTapsPerMs;
        row.band_ms = std::max(row.band_ms, ms);
        row.whole_ms += ms;
    }
    return row;
}

std::vector<Row> rows_of(const std::string& chain, const FrameDescription& frame) {
    const Plan plan = bench::plan_of(chain, frame, {.device = DeviceClass::gpu});
    std::vector<Row> rows;
    for (const Step& step : plan.steps) rows.push_back(row_of(plan, step));
    std::stable_sort(rows.begin(), rows.end(),
                     [](const Row& a, const Row& b) { return a.whole_ms > b.whole_ms; });
    return rows;
}

}  // namespace

int main(int argc, char** argv) {
    bench::Arguments arguments(argc, argv,
                               "longest_dispatch [--size=WIDTHxHEIGHT] [--steps] [CHAIN...]");
    const auto [width, height] = arguments.size(3840, 2160);
    const bool steps = arguments.flag("--steps");
    std::vector<std::string> chains = arguments.words();
    if (chains.empty()) chains = shipped_chains();
    bool good = true;
    std::printf(
        "| %dx%d | longest step | whole, ms | bands | longest band, ms |\n"
        "|---|---|---|---|---|\n",
        width, height);
    for (const std::string& chain : chains) {
        const std::vector<Row> rows = rows_of(chain, engine_frame(width, height));
        for (size_t i = 0; i < (steps ? rows.size() : std::min<size_t>(rows.size(), 1)); ++i)
            std::printf("| %s | %s | %.0f | %d | %.0f |\n", chain.c_str(), rows[i].name.c_str(),
                        rows[i].whole_ms, rows[i].bands, rows[i].band_ms);
        for (const Row& row : rows) good = good && row.band_ms <= kMaxMs;
    }
    return good ? 0 : 1;
}

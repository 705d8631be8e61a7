// Plans each frame of a sequence and predicts its cost for a farm's scheduler: memory and extra
// layers from its header and plans, time from the sidecar of a frame filtered on a similar machine.
// Writes nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "chain/plan/plan.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/filter/cryptomatte_filter.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/resolved_values.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

struct Memory {
    uint64_t frame = 0;     // bytes of one frame in flight and its neighbors
    uint64_t textures = 0;  // peak over the steps, with imported planes and outputs
    // Upper limit of `run` on this sequence, with the software renderer's textures.
    uint64_t process = 0;
};

// The cost of a frame's extra layers and filtered cryptomattes, from its plans.
struct LayerCost {
    int layers = 0;           // layers, with the layers of ids
    size_t ids = 0;           // ids of cryptomattes
    int runs = 0;             // runs of the chain
    size_t dispatches = 0;    // in all runs
    uint64_t peak_bytes = 0;  // textures of the largest run
    double fetches = 0;       // in all runs, as a multiple of color's; layers that are 0 cost less
};

struct PlanReport {
    int frame = 0;
    Result<Plan> plan;
    std::vector<std::string> warnings;
    Memory memory;                           // if there is a plan
    std::optional<ResolvedValues> resolved;  // if there is a plan: the values of its passes
    FrameLayers layers;
    std::optional<LayerCost> layer_cost;  // if there is a plan, and layers are filtered
};
// False ends the visit.
using PlanVisitor = std::function<bool(const PlanReport&)>;

// In the order of the frames. Errors (input): no frames; a frame's own errors are in its plan.
Status plan_sequence(const Chain& chain, const RunSettings& settings, const PlanVisitor& visitor);

// Plan and times of a frame that was filtered.
struct Calibration {
    struct Pass {
        std::string name;
        double ms = 0;
        uint64_t taps = 0;
    };
    std::string path;
    uint64_t pixels = 0;
    double read_ms = 0;  // with conversion
    double write_ms = 0;
    std::vector<Pass> passes;  // passes of its chain that ran
};

// Errors (input): unreadable, or not the sidecar of a written frame.
Result<Calibration> read_calibration(const std::string& path);

// Seconds of one frame by itself, without compiling programs. Neighboring frames overlap, so a run
// takes less per frame.
struct Seconds {
    double read = 0, filter = 0, write = 0;
    double all() const { return read + filter + write; }
};

// Scales the calibration's times: reading and writing by pixels, each pass by its texture fetches.
// Empty if the plan runs a pass that the calibration did not.
std::optional<Seconds> seconds_of(const Plan& plan, const Calibration& calibration);

// The plan of a frame that has one, with the keys `estimate`, `resolved` and `layer_cost`.
io::Json planned_json(const PlanReport& planned, const std::optional<Seconds>& seconds);

// Lines to read.
std::string estimate_text(const Memory& memory, const std::optional<Seconds>& seconds);
std::string layer_cost_text(const LayerCost& cost);

}  // namespace postchain::sequence

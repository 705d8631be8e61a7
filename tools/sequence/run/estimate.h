// What a frame will take, for the scheduler of a farm: memory from its header and plan, time from
// the sidecar of a frame that was filtered on such a machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chain/plan.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::sequence {

struct Memory {
    uint64_t frame = 0;     // bytes of one frame on its way, with its neighbors
    uint64_t textures = 0;  // largest sum alive at one step, imported planes and outputs too
    uint64_t process =
        0;  // of `run` on this sequence at most, the software renderer's textures too
};

// `frames`: of the sequence or of one part; more than kFramesInFlight are never in memory.
Memory memory_of(const FrameInputs& inputs, const Plan& plan, size_t frames);

// A frame that was filtered: its plan and its times.
struct Pilot {
    struct Pass {
        std::string name;
        double ms = 0;
        uint64_t taps = 0;
    };
    std::string path;
    uint64_t pixels = 0;
    double read_ms = 0;  // converting included
    double write_ms = 0;
    std::vector<Pass> passes;  // of its chain, those that ran
};

// Errors (input): not readable, or no sidecar of a written frame.
Result<Pilot> read_pilot(const std::string& path);

// Seconds of one frame alone; neighboring frames overlap, so a run takes less for each. Compiling
// the programs, once in a process, is not in it.
struct Seconds {
    double read = 0, filter = 0, write = 0;
    double all() const { return read + filter + write; }
};

// The pilot's times in proportion: of reading and writing to the pixels, of a pass to its texture
// fetches. Nothing where the plan runs a pass that the pilot did not.
std::optional<Seconds> seconds_of(const Plan& plan, const Pilot& pilot);

io::Json estimate_json(const Memory& memory, const std::optional<Seconds>& seconds);
std::string estimate_text(const Memory& memory, const std::optional<Seconds>& seconds);

}  // namespace postchain::sequence

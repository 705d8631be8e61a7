// The class of device that a plan is made for.
#pragma once

namespace postchain {

// Chooses among the forms of a step: its program (macro SOFTWARE_RENDERER), its work groups, and
// how many invocations share a block. All forms of a step compute the same bits
// (docs/performance.md).
//
//   software  a CPU's vectors: an invocation does more, nothing is shared in a group's memory
//   gpu       a group shares its reads and its work
enum class DeviceClass { software, gpu };

}  // namespace postchain

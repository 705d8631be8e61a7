// Checks of the values of a result: against its input, the constant, another run, the reference.
// Each adds nothing if it is not wanted or does not apply.
#pragma once

#include "tools/stress/measurement.h"

namespace postchain::stress {

Status check_finite(Measurement& measured);
Status check_range(Measurement& measured);
Status check_constant(Measurement& measured);
Status check_elided(Measurement& measured);
Status check_repeat(Measurement& measured);
Status check_reference(Measurement& measured);
Status check_identity(Measurement& measured);
Status check_counted(Measurement& measured);

}  // namespace postchain::stress

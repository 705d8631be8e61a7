// Transfers, color spaces and views that a job's settings name. Names in an OpenColorIO
// configuration are looked up when its file is read.
#pragma once

#include <optional>

#include "tools/sequence/image/transfer.h"
#include "tools/sequence/settings/job_settings.h"

namespace postchain::sequence {

// Transfer of the stored values of inputs and of outputs; none = decided by the file, then the
// format. Errors (usage): an unknown name, or an OpenColorIO name without a configuration.
Result<std::optional<io::Transfer>> input_transfer_of(const JobSettings& job);
Result<std::optional<io::Transfer>> output_transfer_of(const JobSettings& job);

bool needs_ocio(const JobSettings& job);

// The view that previews show; none = their own curve. Errors (usage): a configuration that is
// unused or missing, a view that nothing shows.
Result<std::optional<io::DisplayView>> preview_view_of(const JobSettings& job);

}  // namespace postchain::sequence

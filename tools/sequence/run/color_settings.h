// Which curve, color space or view the settings of a job name. Names of a configuration of
// OpenColorIO are looked up when its file is read.
#pragma once

#include <optional>

#include "tools/sequence/image/transfer.h"
#include "tools/sequence/run/job_settings.h"

namespace postchain::sequence {

// What stored values of inputs and of outputs mean; none: as the file, else the format, says.
// Errors (usage): a word that is none, a configuration that is not named.
Result<std::optional<io::Transfer>> input_transfer_of(const JobSettings& job);
Result<std::optional<io::Transfer>> output_transfer_of(const JobSettings& job);

// Whether a transfer of inputs or outputs is one of an OpenColorIO configuration.
bool needs_ocio(const JobSettings& job);

// The view that previews show; none: they have a curve of their own. Errors (usage): a
// configuration that nothing uses or that is not named, a view that nothing shows.
Result<std::optional<io::DisplayView>> preview_view_of(const JobSettings& job);

}  // namespace postchain::sequence

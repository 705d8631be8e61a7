// The commit from which this program was built.
#pragma once

namespace postchain::study {

// "fc31...9e", with "-dirty" if the tree had changes; "unknown" without git.
extern const char* const kSourceRevision;

}  // namespace postchain::study

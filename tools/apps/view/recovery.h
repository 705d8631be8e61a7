// A file with the edits that are not saved, which outlives a viewer that is killed.
#pragma once

#include <optional>
#include <string>

#include "tools/apps/view/document.h"

namespace postchain::view {

// The edits as the text of a recovery file, JSON.
std::string recovery_text(const DocumentState& state);
// Errors (input): not a recovery file.
Result<DocumentState> state_of_recovery(const std::string& text, const PassRegistry& registry);

// The recovery file of one open chain. A lock tells the files of running viewers from those that a
// viewer left when it was killed.
class Recovery {
  public:
    // `chain_name`: a file or a shipped chain. An empty folder, or one that cannot be made: no
    // file.
    Recovery(const std::string& folder, const std::string& chain_name);
    ~Recovery();
    Recovery(const Recovery&) = delete;
    Recovery& operator=(const Recovery&) = delete;

    // The edits that an earlier viewer left; empty: none.
    std::string left() const;
    // Where to write; empty: nowhere.
    const std::string& path() const { return path_; }
    void discard();

  private:
    std::string path_, lock_path_;
    int lock_ = -1;
};

}  // namespace postchain::view

// The chain that is open: its document, its file, and the file that keeps edits until they are
// saved.
#pragma once

#include <string>
#include <vector>

#include "tools/apps/view/document.h"
#include "tools/apps/view/messages.h"
#include "tools/apps/view/playback.h"

namespace postchain::view {

struct ChainToOpen {
    std::string name;  // as given: a file or a shipped chain
    std::string text;
    bool is_file = false;
    std::vector<std::string> sets;  // of --set; hold for the file until it is saved
    Chain chain;
    std::string recovery_folder;  // for edits that are not saved; empty: they are not kept
};

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

class OpenChain {
  public:
    // Restores the edits that a viewer left when it was killed. `run` states the inputs, which are
    // not written over.
    OpenChain(ChainToOpen given, const sequence::RunSettings& run, Messages& messages);

    Document& document() { return document_; }
    const Document& document() const { return document_; }
    const std::string& name() const { return given_.name; }
    bool is_file() const { return given_.is_file; }

    // Reads the file if it has changed.
    void reload_if_changed();
    // Writes the edits into the recovery file, once a second.
    void keep_edits(Clock::time_point now);
    // Writes the chain file, which is the open one from then on. Errors: those of new_file(), also
    // for the open file if another program has changed it.
    Status save(const std::string& path, bool replace);
    // The edits are not wanted: nothing of them is kept.
    void discard_edits();

  private:
    void reload();

    ChainToOpen given_;
    const sequence::RunSettings& run_;
    Messages& messages_;
    Document document_;
    Recovery recovery_;
    io::FileStamp stamp_;
    uint64_t kept_revision_ = 0;  // of the document, in the recovery file
    Clock::time_point kept_at_;
};

}  // namespace postchain::view

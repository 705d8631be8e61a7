// The text of a saved chain: the file's own text with the edits in their places.
#pragma once

#include <string>

#include "tools/apps/view/document.h"

namespace postchain::view {

struct ChainFileText {
    std::string text;
    bool kept = false;                // the file's comments and order of keys are kept
    std::map<uint64_t, OffPass> off;  // for Document::saved()
};

// Comments stay with the pass below them and move with it. A pass that is switched off becomes a
// comment, and its lines again when it is switched on. If the edits cannot be made in place (passes
// in one line, anchors, a value over several lines), the chain is written anew below the comments
// at the file's top. `file_text`: of the document's file, may be empty.
ChainFileText chain_file_text(const std::string& file_text, const Document& document);

}  // namespace postchain::view

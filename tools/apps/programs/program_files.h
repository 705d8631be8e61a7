// A folder with one file for each program, and index.json, which says how to run them
// (docs/programs.md).
#pragma once

#include <map>
#include <string>

#include "chain/plan/plan.h"
#include "tools/apps/programs/translate.h"

namespace postchain::programs {

struct Program {
    ProgramKey key;
    std::string source;
    std::vector<uint32_t> words;  // as vk::compile() makes them
};
using Programs = std::map<uint64_t, Program>;  // by program_key()

struct FilesWritten {
    size_t files = 0, bytes = 0;
};

// Every file is translated before the first is written, and index.json is written last. Files of
// programs that an earlier call left are removed. Errors (output): the folder is neither new, nor
// empty, nor of an earlier call, or a file cannot be written.
Result<FilesWritten> write_files(const Programs& programs, Language language,
                                 const std::string& folder);

}  // namespace postchain::programs

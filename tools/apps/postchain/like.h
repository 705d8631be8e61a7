// --like: takes chain, camera and settings from an output's record; options given override them.
#pragma once

#include <optional>

#include "tools/apps/postchain/options.h"
#include "tools/sequence/record/record.h"

namespace postchain {

// Adds --like to `run`; CHAIN and --input are then optional.
void add_like(CLI::App& run, Options& options);

// Fills the missing options of `run` from the record of options.like and warns about parts that no
// longer hold. Does nothing without --like. Errors (input): those of read_record().
Result<std::optional<sequence::Record>> apply_like(const CLI::App& run, Options& options);

}  // namespace postchain

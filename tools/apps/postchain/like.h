// --like: the chain, camera and settings of an output's record, where the command line says
// nothing else.
#pragma once

#include <optional>

#include "tools/apps/postchain/options.h"
#include "tools/sequence/run/record.h"

namespace postchain {

// Adds --like to `run`, with which neither CHAIN nor --input is required.
void add_like(CLI::App& run, Options& options);

// Fills what `run` was not given from the record of options.like; says what of it does not hold any
// more. Nothing without --like. Errors (input): as read_record().
Result<std::optional<sequence::Record>> apply_like(const CLI::App& run, Options& options);

}  // namespace postchain

// A chain that another text names: a study, a request of the service.
#pragma once

#include <functional>
#include <string>

#include "config/chain_find.h"

namespace postchain {

// The path at which a file is opened, or why it must not be.
using FileOf = std::function<Result<std::string>(const std::string& path)>;

// A shipped chain by its name, otherwise the file at `file_of(name_or_path)`.
Result<ChainText> find_named_chain(const std::string& name_or_path, const FileOf& file_of);

}  // namespace postchain

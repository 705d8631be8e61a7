// For programs that start the command: --check, what a start would refuse, and --schema, the
// settings of a subcommand. Each prints one JSON object on stdout (docs/command.md).
#pragma once

#include <optional>
#include <string>

#include "config/chain_file.h"
#include "tools/apps/common/options.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain {

// --schema, and --check if the subcommand starts something. `required`: keys of the arguments.
void add_checks(CLI::App& subcommand, Options& options, const std::vector<std::string>& required);
void add_schema(CLI::App& subcommand, const std::vector<std::string>& required);

std::string key_of(std::string option);  // "--on-existing" -> "on_existing"
// Keys of a subcommand, as its options are added.
void add_property(const CLI::App& subcommand, const std::string& key, io::Json schema);
void add_property(const CLI::App& subcommand, const Parameter& row);  // unless it is for a person
// The schema of a subcommand that has --schema.
std::optional<io::Json> schema_of(const CLI::App& subcommand);

// The faults of one --check.
class Checks {
  public:
    // A fault unless it is ok; false then. `key`: of the setting, unless the message begins with
    // one.
    bool take(const std::string& key, const Status& status);
    // Errors are faults, the others warnings.
    bool take(const std::string& key, const Diagnostics& diagnostics);
    // No value after a fault.
    template <class T>
    std::optional<T> take(const std::string& key, Result<T> result) {
        if (!take(key, result.status())) return std::nullopt;
        return std::move(*result);
    }
    std::optional<ChainFile> chain(const std::string& key, const Options& options);
    std::optional<sequence::RunSettings> settings(const Options& options);
    // Faults of files and folders that a confined process may not open, such as a link.
    void reads(const std::string& key, const io::InputSpec& input);
    void writes(const std::string& key, const std::string& folder);

    bool ok() const { return faults_.empty(); }
    // Prints `found` and the warnings, or the faults. Returns the exit code.
    int print(io::Json found) const;

  private:
    io::Json faults_ = io::Json::array(), warnings_ = io::Json::array();
    int exit_code_ = 0;
};

// Absolute, by its name: links are not followed.
std::string whole_path(const std::string& path);

}  // namespace postchain

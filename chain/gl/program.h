// Compute programs by ProgramKey, compiled once. Sources are embedded, or read from a folder
// (development).
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "chain/base/status.h"
#include "chain/gl/device.h"
#include "chain/plan/plan.h"
#include "chain/plan/program_source.h"

namespace postchain::gl {

// Location of the uniform of common/first_group.glsl.
inline constexpr int kFirstGroup = 0;
// Likewise of the first layer that a step does (common/layers.glsl).
inline constexpr int kFirstLayer = 1;

struct Program {
    unsigned name = 0;          // GL's
    std::string uniforms_type;  // type of the uniform block at binding 0; empty = it has none
    size_t uniforms_bytes = 0;  // std140, a multiple of 16
    bool in_bands = false;      // takes its place from common/first_group.glsl
    bool operator==(const Program&) const = default;
};

// The value of POSTCHAIN_SHADER_DIR; empty: embedded sources.
std::string shader_folder_of_environment();

class ProgramCache {
  public:
    // `folder`: of the sources; empty: the embedded files.
    explicit ProgramCache(LogCallback log = {}, std::string folder = {})
        : log_(std::move(log)), folder_(std::move(folder)) {}
    ~ProgramCache();
    ProgramCache(const ProgramCache&) = delete;
    ProgramCache& operator=(const ProgramCache&) = delete;
    // From now on binaries are taken from the store and given to it. `device`: vendor, renderer and
    // version: other devices have other keys.
    void use_binaries(ProgramStore store, std::string device);
    // Begins to compile it. Programs that are all begun before the first of them is got compile at
    // once, if the driver can.
    void begin(const ProgramKey& key);
    // The program, compiled on first use. StatusCode::gl with the compiler's log, its file numbers
    // replaced by names. In development mode a changed file is compiled again; if that fails the
    // last good program stays and `log` gets one message.
    Result<Program> get(const ProgramKey& key);
    // True if it is compiled. Only for embedded sources: files in a folder may have changed.
    bool has(const ProgramKey& key) const { return entries_.count(key.text()) > 0; }
    size_t compiled() const { return compiled_; }
    size_t loaded() const { return loaded_; }  // from the store
    // Its programs went with their context.
    void abandon() {
        entries_.clear();
        begun_.clear();
    }

  private:
    // A program that may still be compiling.
    struct Begun {
        unsigned shader = 0, program = 0;  // GL's
        std::vector<std::string> files;    // of the source, by number
        uint64_t source_hash = 0;
    };
    static Begun compile(const ProgramKey& key, const std::string& source,
                         std::vector<std::string> files);
    static Result<unsigned> finish(const ProgramKey& key, const Begun& begun);
    // Takes it from the store; false if it is not there, or of another driver.
    bool load(const ProgramKey& key, const std::string& source);
    void store(const ProgramKey& key, uint64_t source_hash, unsigned program) const;
    std::string binary_key(const ProgramKey& key, uint64_t source_hash) const;
    struct Entry {
        Program program;
        uint64_t source_hash = 0;
    };
    LogCallback log_;
    std::string folder_;
    std::map<std::string, Entry> entries_;
    std::map<std::string, Begun> begun_;
    size_t compiled_ = 0;
    size_t loaded_ = 0;
    ProgramStore binaries_;
    std::string binaries_of_;  // the device
};

}  // namespace postchain::gl

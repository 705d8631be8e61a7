// The record of an output, its attribute "postchain/record": what made it, whole enough to make it
// again, and what its passes worked with. docs/sidecar.md describes its keys.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "tools/sequence/run/frame_report.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

inline constexpr const char* kRecordAttribute = "postchain/record";

// One JSON object on one line, of a frame that has been planned.
std::string record_text(const Chain& chain, const RunSettings& settings, const FrameReport& report);

struct Record {
    std::string version;  // of the command
    std::string work;     // FrameReport::provenance
    int frame = 0;
    std::string chain;                               // text of a chain file
    std::map<std::string, ParameterValue> settings;  // those of JobSettings that were given
    std::string camera;                              // text of a camera file: what it gave here
    std::string camera_hash;                         // of the camera file's text; empty: none
    std::vector<io::FileStamp> inputs;               // files that were read, neighbors' too
};

// Errors (input): no EXR file; without a record, or with one that is damaged.
Result<Record> read_record(const std::string& path);

}  // namespace postchain::sequence

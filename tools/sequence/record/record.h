// The record of an output, in its attribute "postchain/record": enough to make it again, and the
// values that its passes used. docs/sidecar.md describes its keys.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

inline constexpr const char* kRecordAttribute = "postchain/record";

// A one-line JSON object for a planned frame.
std::string record_text(const Chain& chain, const RunSettings& settings, const FrameReport& report);

struct Record {
    std::string version;  // version of the command
    std::string work;     // FrameReport::provenance
    int frame = 0;
    std::string chain;                               // as a chain file
    std::map<std::string, ParameterValue> settings;  // JobSettings that were given
    std::string camera;                              // as a camera file: the values it gave here
    std::string camera_hash;                         // hash of the camera file's text; empty = none
    std::vector<io::FileStamp> inputs;               // files that were read, with neighbors'
};

// Errors (input): not an EXR file; its record is missing or damaged.
Result<Record> read_record(const std::string& path);

}  // namespace postchain::sequence

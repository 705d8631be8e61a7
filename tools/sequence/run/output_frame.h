// The file of one filtered frame, by the extension of its name: the input's EXR with its color
// replaced, a new EXR of what was another picture, or another picture.
#pragma once

#include <string>
#include <vector>

#include "chain/image.h"
#include "tools/sequence/frame/frame_writer.h"
#include "tools/sequence/run/frame_source.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

// Whether the frame can be written so, from its header alone. Errors: those of
// io::check_rewritable() and io::picture_encoding(); (usage) settings of EXR files for another, or
// the other way round.
Status check_output(const FrameHeader& header, const std::string& path, const RunSettings& settings,
                    const io::WriteOptions& options);

// Writes the frame's color, `result`, of its window, linear and multiplied by alpha; it is changed.
// `layers` are those of io::write_filtered(); other files than the input's have none.
// `files` says what may be replaced. Errors: those of io::OutputFiles::permit(),
// io::write_filtered(), io::write_planes_exr() and io::write_picture().
Result<io::WriteReport> write_output(const std::string& path, SourceFrame& source, ImageF& result,
                                     const std::vector<io::FilteredLayer>& layers,
                                     const RunSettings& settings, const io::OutputFiles& files,
                                     io::WriteOptions options);

// What values are clamped to: "the largest half, 65504".
std::string largest_text(const std::string& path);

}  // namespace postchain::sequence

// Writes the file of a filtered frame in the format of its extension: the input's EXR with new
// color, a new EXR for a non-EXR input, or another image format.
#pragma once

#include <string>
#include <vector>

#include "chain/image.h"
#include "tools/sequence/frame/frame_writer.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Whether the frame can be written in this format, decided from its header. Errors: those of
// io::check_rewritable() and io::image_encoding(); (usage) EXR settings for another format, or
// the reverse.
Status check_output(const FrameHeader& header, const std::string& path, const RunSettings& settings,
                    const io::WriteOptions& options);

// Writes the frame's color `result`, of its window, linear and premultiplied; modifies it. `layers`
// as in io::write_filtered(); a new EXR can only have added ones. `files` says which files may
// be replaced. Errors: those of io::OutputFiles::permit(), io::write_filtered(),
// io::write_planes_exr() and io::write_picture().
Result<io::WriteReport> write_output(const std::string& path, SourceFrame& source, ImageF& result,
                                     const std::vector<io::FilteredLayer>& layers,
                                     const RunSettings& settings, const io::OutputFiles& files,
                                     io::WriteOptions options);

// RunSettings::overflow; if unset, pictures of a display are clamped: JPEG, and a view of
// OpenColorIO. Light above white is no fault there.
io::HalfOverflow overflow_of(const std::string& path, const RunSettings& settings);

// The value that clamping stores: "the largest half, 65504".
std::string largest_text(const std::string& path);

}  // namespace postchain::sequence

// Writes the outputs of a filtered frame: the image in the format of its extension (the input's EXR
// with new color, a new EXR for a non-EXR input, or another image format), preview and sidecar.
#pragma once

#include "chain/pass/chain.h"
#include "tools/sequence/planes/frame_writer.h"
#include "tools/sequence/run/runner.h"

namespace postchain::sequence {

// Whether the frame can be written as FrameReport::output, decided from its header. Errors: those
// of io::check_rewritable() and io::image_encoding(); (usage) EXR settings for another format, or
// the reverse.
Status check_output(const FrameHeader& header, const FrameReport& report,
                    const RunSettings& settings);

// Writes the frame; modifies its pixels and completes its report. `files` says which files may be
// replaced. Errors: (health) non-finite values under --strict; (input) an input has changed; those
// of io::OutputFiles::permit(), io::write_filtered(), io::write_planes_exr() and
// io::write_picture().
Status write_frame(const Chain& chain, const RunSettings& settings, const io::OutputFiles& files,
                   FrameInFlight& frame);

// Writes an image of a frame that some program made of it, with the layers that the frame filters:
// without record, preview and sidecar. `source`: read with io::Keep::all; `view` is
// modified. Errors: those of check_output() and write_frame().
Result<io::WriteReport> write_view(const std::string& path, const SourceFrame& source,
                                   FilteredView& view, const RunSettings& settings,
                                   const io::OutputFiles& files);

}  // namespace postchain::sequence

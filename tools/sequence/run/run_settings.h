// What a run is told, typed: made from text by run/job_settings.h, or by a program.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "chain/planner.h"
#include "tools/sequence/exr/write_options.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/image/picture_writer.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

enum class MissingPolicy {
    error,  // nothing is run
    skip,   // the others are run
    hold,   // the nearest earlier frame (else the nearest later one) stands in
};
enum class ErrorPolicy { stop, keep_going };

// Frames are taken as a renderer writes them (run/watch_feed.h).
struct Watch {
    std::optional<double> idle_s;  // seconds without a change after which the rest is given up
};

struct RunSettings {
    io::InputSpec input;
    std::vector<io::InputFile> other_inputs;  // chain, camera, profile, pictures
    std::optional<io::FrameRange> frames;     // none: all on disk
    io::Chunk chunk;                          // of the frames, the part that is run
    std::optional<Watch> watch;
    io::PathPattern output;
    bool make_folder = false;  // the folder of the output, and those above it
    SourceSettings source;
    PlanOptions plan;
    io::OnExisting on_existing = io::OnExisting::fail;
    io::HalfOverflow overflow = io::HalfOverflow::refuse;
    io::ExrSettings exr;
    io::PictureSettings picture;
    MissingPolicy missing = MissingPolicy::error;
    ErrorPolicy on_error = ErrorPolicy::stop;
    bool strict = false;                  // non-finite values are an error
    bool sidecar = true;                  // OUT.json beside each output
    bool preview = false;                 // OUT.png beside each output, display transform, 8 bits
    std::optional<io::DisplayView> view;  // that shows previews
    std::string dump_folder;              // every stage as EXR, the folder is made; empty = none
    std::string version;                  // of the command, for metadata
    // Those of the settings that the record of an output repeats and that are not the default.
    std::map<std::string, ParameterValue> given;

    // Files of OpenColorIO that are used, each once.
    std::set<std::string> ocio_configs() const;
};

// The settings with what the chain names besides, its mattes, and with what is written of layers.
RunSettings settings_for(RunSettings settings, const std::vector<const Chain*>& chains);

}  // namespace postchain::sequence

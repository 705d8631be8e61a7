// Typed settings of a run, made from text by settings/job_settings.h or by a program.
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
#include "tools/sequence/image/image_writer.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

enum class MissingPolicy {
    error,  // nothing is run
    skip,   // the other frames are run
    hold,   // the nearest earlier frame (otherwise the nearest later) is used instead
};
enum class ErrorPolicy { stop, keep_going };

// Processes frames while a renderer writes them (run/watch_feed.h).
struct Watch {
    std::optional<double> idle_s;  // seconds without changes until missing frames are given up
};

struct RunSettings {
    io::InputSpec input;
    std::vector<io::InputFile> other_inputs;  // chain, camera, profile, images
    std::optional<io::FrameRange> frames;     // none = all on disk
    io::Chunk chunk;                          // the part of the frames that is run
    std::optional<Watch> watch;
    io::PathPattern output;
    bool make_folder = false;  // creates the output folder and its parents
    SourceSettings source;
    PlanOptions plan;
    io::OnExisting on_existing = io::OnExisting::fail;
    std::optional<io::HalfOverflow> overflow;  // unset: overflow_of() the output
    io::ExrSettings exr;
    io::ImageSettings picture;
    MissingPolicy missing = MissingPolicy::error;
    ErrorPolicy on_error = ErrorPolicy::stop;
    bool strict = false;                  // non-finite values are an error
    bool sidecar = true;                  // OUT.json beside each output
    bool preview = false;                 // OUT.png beside each output, display transform, 8 bits
    std::optional<io::DisplayView> view;  // shown by previews
    std::string dump_folder;              // for every stage as EXR, created; empty = none
    std::string version;                  // of the command, for metadata
    // Settings repeated in the record of an output because they are not the default.
    std::map<std::string, ParameterValue> given;

    // OpenColorIO files in use, each once.
    std::set<std::string> ocio_configs() const;
};

// Adds the chains' mattes and the written layers to the settings.
RunSettings settings_for(RunSettings settings, const std::vector<const Chain*>& chains);

}  // namespace postchain::sequence

// Typed settings of a run, made from text by settings/job_settings.h or by a program, and its
// frames: the outputs and the files each is made from.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/pass/planner.h"
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

// Processes frames while a renderer writes them (run/frame_feed.h).
struct Watch {
    std::optional<double> idle_s;  // seconds without changes until missing frames are given up
};

// The settings that need no conversion: a job's rows set them (settings/job_settings.h).
struct RunChoices {
    bool make_folder = false;  // creates the output folder and its parents
    io::OnExisting on_existing = io::OnExisting::fail;
    MissingPolicy missing = MissingPolicy::error;
    ErrorPolicy on_error = ErrorPolicy::stop;
    std::optional<io::HalfOverflow> overflow;  // unset: clamp for JPEG and views
    bool strict = false;                       // non-finite values are an error
    bool sidecar = true;                       // OUT.json beside each output
    bool preview = false;     // OUT.png beside each output, display transform, 8 bits
    std::string dump_folder;  // for every stage as EXR, created; empty = none
};

struct RunSettings : RunChoices {
    io::InputSpec input;
    std::vector<io::InputFile> other_inputs;  // chain, camera, profile, images
    std::optional<io::FrameRange> frames;     // none = all on disk
    io::Chunk chunk;                          // the part of the frames that is run
    std::optional<Watch> watch;
    io::PathPattern output;
    SourceSettings source;
    PlanOptions plan;
    io::ExrSettings exr;
    io::ImageSettings picture;
    std::optional<io::DisplayView> view;  // shown by previews
    std::string version;                  // version of the command, for metadata
    // Settings repeated in the record of an output because they are not the default.
    std::map<std::string, ParameterValue> given;
};

// Adds the chains' mattes and the written layers to the settings.
RunSettings settings_for(RunSettings settings, const std::vector<const Chain*>& chains);

// One output, made from the files of the same or another frame.
struct FrameTask {
    int frame = 0;                      // number of the output frame
    int source = 0;                     // number of the input frame; differs if a frame is held
    std::map<Role, std::string> files;  // empty = missing
    std::string output;
};

// Called on the reader thread before a frame's first file is opened; an error fails that frame.
using FrameStart = std::function<Status(const FrameTask&)>;

enum class FrameStep { read, filter, write };
const char* name_of(FrameStep step);  // "read", "filtered", "written"

// Called when a step of a frame begins and ends, on the thread of the step. Must not throw.
using StepObserver = std::function<void(FrameStep step, int frame, bool begins)>;

// With --watch and no range, the frames are only known once they have come.
bool frames_are_unknown(const RunSettings& settings);

// The requested frames in order, with the files MissingPolicy gives each. `gaps` gets numbers
// missing on disk that were not requested. `writes`: outputs are written, each under its own name.
// With --watch: the awaited frames without files, or none if unknown. Errors: those that
// run_sequence() finds before reading.
Result<std::vector<FrameTask>> plan_tasks(const RunSettings& settings, bool writes,
                                          std::vector<int>& gaps);

// The missing files of a frame: the color pattern, or the separate planes.
std::string absent_files(int frame, const RunSettings& settings);

// The error (input) of a frame whose files are not on disk.
Status absent_frame(int frame, const RunSettings& settings);

// "1-4, 7"; at most `most` numbers and runs of consecutive numbers.
std::string frames_text(const std::vector<int>& frames, size_t most = 20);

// "2 frames missing: 3, 5", of gaps that are listed up to io::kMaxFrames.
std::string gaps_text(const std::vector<int>& gaps);

}  // namespace postchain::sequence

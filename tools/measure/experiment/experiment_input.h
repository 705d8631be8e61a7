// The input of an experiment: frames and their ground truth, surveyed before anything is run, then
// read frame by frame.
//
//   ground truth: files of -r, or generated from the scene that camera.json names
//     --survey: exists, same windows, finite, not black--> joined exposures of HDR-FLIP
//     --load--> image of one frame
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "chain/pass/chain.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/settings.h"
#include "tools/metrics/exposure.h"
#include "tools/metrics/pair.h"
#include "tools/scenes/scene.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::experiment {

class Truth {
  public:
    // `pattern`: as typed after -r; may have files for only some of `frames`. Errors (usage): bad
    // pattern; (input): no file for any of them.
    static Result<Truth> open(const std::string& pattern, const std::vector<int>& frames);

    bool has(int frame) const { return files_.contains(frame); }
    const std::vector<int>& frames() const { return frames_; }  // with a ground truth, in order

    // Reads every frame once; must come before load(). Errors (input), naming both files: its
    // window or data window does not cover that of the input's frame, NaN or Inf, all black.
    Status survey(const sequence::RunSettings& input, metrics::ToneMapper mapper);
    const metrics::ExposureRange& exposures() const { return exposures_; }
    // Where it changes most from frame to frame; none of a single frame.
    const std::optional<report::Slice>& slice() const { return slice_; }

    // Covers the filtered window of the input's frame.
    Result<metrics::RgbImage> load(int frame) const;
    const std::string& path(int frame) const { return files_.at(frame).at(Role::color); }
    // Name, size and modification time of the frame's file.
    std::string identity(int frame) const;

  private:
    Result<sequence::FrameHeader> open_frame(int frame) const;
    static Result<sequence::SourceFrame> read(sequence::FrameHeader header);
    std::map<int, std::map<Role, std::string>> files_;
    std::vector<int> frames_;
    std::map<int, io::Window> windows_;  // data windows of the input's frames, by number
    metrics::ExposureRange exposures_;
    std::optional<report::Slice> slice_;
};

// The requested frames. Errors (input): one is not on disk.
Result<io::FrameList> frames_on_disk(const sequence::RunSettings& input);

// Exposures of HDR-FLIP without a ground truth, from the unfiltered frames, and the frame size.
// Errors (input): frames that cannot be read, have different sizes or are all black.
struct InputSurvey {
    std::vector<int> frames;
    int width = 0;
    int height = 0;
    metrics::ExposureRange exposures;
};
Result<InputSurvey> survey_input(const sequence::RunSettings& input, metrics::ToneMapper mapper,
                                 bool with_exposures);

// The generated scene of a sequence: camera.json beside the input names it and describes that
// scene. If not found, the reason.
struct SceneOfInput {
    std::optional<scenes::SceneRequest> request;  // size, frames and camera filled
    std::string why_not;
};
SceneOfInput find_scene(const sequence::RunSettings& input, const InputSurvey& survey);

// Values of lens and shutter with which `chain` filters `header`'s frame, but not the camera of its
// generated ground truth: "f_stop 1.4 in place of 2.8".
std::vector<std::string> differences_from_truth(const Chain& chain,
                                                const sequence::FrameHeader& header,
                                                const Camera& camera_of_truth);

// Renders missing frames of `both` as both.####.exr (float) into this request's folder under
// `parent`; returns the pattern. Makes a GL context and leaves none current. `files`: of the
// report. Errors: those of the scenes and of writing.
Result<std::string> generate_truth(const scenes::SceneRequest& request, const std::string& parent,
                                   int samples, const io::OutputFiles& files,
                                   const egl::ContextOptions& context,
                                   const std::function<bool(int frame, double share)>& progress);

// If settings.truth is empty, renders the ground truth of the generated scene that the input
// belongs to, otherwise stores the reason in settings.no_truth. Rendering makes a GL context and
// leaves none current. `progress`: "truth of still, frame 3, 40 %"; false stops. `files`: from
// prepare_folder(). Errors: those of survey_input() and generate_truth().
Status find_truth(BenchSettings& settings, const io::OutputFiles& files,
                  const egl::ContextOptions& context,
                  const std::function<bool(const std::string&)>& progress);

struct ExperimentInput {
    std::optional<Truth> truth;
    metrics::ExposureRange exposures;                  // for all variants and frames
    std::map<int, std::map<Role, std::string>> files;  // files of each frame, by plane
    // Of input and ground truth, by frame, taken before the first read.
    std::map<int, std::vector<io::FileStamp>> stamps;

    bool has_truth(int frame) const { return truth && truth->has(frame); }
    // Errors (input): a file of these frames was changed since.
    Status check_unchanged(int first = -io::kMaxFrameNumber, int last = io::kMaxFrameNumber) const;
    // Differences over time need consecutive frame numbers with ground truth.
    bool follows(int frame) const { return has_truth(frame) && has_truth(frame - 1); }
};

// Fills in the report except the variants: folder, command, input, truth, reference, device,
// frames, size, metrics, constants, exposures. Writes nothing. Errors: those of survey_input() and
// Truth.
Result<ExperimentInput> open_input(report::Kind kind, const ExperimentSettings& settings,
                                   report::Report& report);

// The input's frame with color and the planes of `wanted` that it and its neighbors have. Errors
// (input).
Result<sequence::SourceFrame> read_frame(const ExperimentInput& input,
                                         const sequence::RunSettings& run, int frame,
                                         RoleSet wanted);

// "frame 1 is filtered without the frame before: ...", for the report's notes.
std::vector<std::string> notes_on_neighbors(const sequence::SourceFrame& frame);

}  // namespace postchain::experiment

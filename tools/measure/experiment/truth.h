// The truth of a sequence: looked at once before anything is run, then read frame by frame.
//
//   files of -r, or generated from the scene that camera.json names
//     --survey: there, same windows, finite, not black--> joined exposures of HDR-FLIP
//     --load--> Picture of one frame
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "tools/measure/metrics/exposure.h"
#include "tools/measure/metrics/pair.h"
#include "tools/measure/scenes/scene.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::experiment {

class Truth {
  public:
    // `pattern`: as typed after -r. It may have files for a part of `frames` only. Errors (usage):
    // bad pattern; (input): no file for any of them.
    static Result<Truth> open(const std::string& pattern, const std::vector<int>& frames);

    bool has(int frame) const { return files_.contains(frame); }
    const std::vector<int>& frames() const { return frames_; }  // those that have a truth, in order

    // Reads every frame once; must come before load(). Errors (input), naming both files: it does
    // not cover what is filtered of the input's frame, NaN or Inf, nothing but black.
    Status survey(const sequence::RunSettings& input, metrics::ToneMapper mapper);
    const metrics::ExposureRange& exposures() const { return exposures_; }

    // Of the pixels that are filtered of the input's frame.
    Result<metrics::Picture> load(int frame) const;
    std::vector<std::string> paths() const;  // of all frames
    // Name, size and time of change of the frame's file.
    std::string identity(int frame) const;

  private:
    Result<sequence::SourceFrame> read(int frame) const;
    std::map<int, std::map<Role, std::string>> files_;
    std::vector<int> frames_;
    std::map<int, io::Window> windows_;  // of the input's frames, by number
    metrics::ExposureRange exposures_;
};

// Exposures of HDR-FLIP where there is no truth: of the unfiltered frames. Also says how large
// they are. Errors (input): frames that cannot be read, of different sizes, all black.
struct InputSurvey {
    std::vector<int> frames;
    int width = 0;
    int height = 0;
    metrics::ExposureRange exposures;
};
Result<InputSurvey> survey_input(const sequence::RunSettings& input, metrics::ToneMapper mapper,
                                 bool with_exposures);

// The generated scene that a sequence was rendered from: camera.json beside the input names it and
// its description is that scene's. Nothing when there is none, with the reason.
struct SceneOfInput {
    std::optional<scenes::SceneRequest> request;  // size, frames and camera filled
    std::string why_not;
};
SceneOfInput find_scene(const sequence::RunSettings& input, const InputSurvey& survey);

// Renders `both` of every frame that is not there yet as both.####.exr (float) into a folder of
// this request under `parent`; returns the pattern. Makes a GL context of its own and leaves none
// current. `files`: of the report. Errors: those of the scenes and of writing.
Result<std::string> generate_truth(const scenes::SceneRequest& request, const std::string& parent,
                                   int samples, const io::OutputFiles& files,
                                   const egl::ContextOptions& context,
                                   const std::function<bool(int frame, double share)>& progress);

}  // namespace postchain::experiment

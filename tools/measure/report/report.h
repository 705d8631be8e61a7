// Results of an experiment: plain data, written as JSON, CSV and Markdown, and as the page.
//
//   run_experiment.h --> Report
//   Report --report_json.h--> report.json   (docs/report.md)
//          --report.cpp--> report.csv
//          --report_text.h--> report.md
//          --page/page.h----> index.html
//
// Pixels are stored as EXR files (float, lossless) in the report's folder and loaded one at a time,
// so that memory does not grow with frames and variants.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "chain/plan/plan.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::report {

enum class Kind { ab, bench };
const char* name_of(Kind kind);  // "ab", "bench"

// A column of the tables.
enum class Better {
    lower,   // an error
    higher,  // psnr, ssim
    one,     // a ratio to ground truth: closer to 1 is better
};
const char* name_of(Better better);  // "lower", "higher", "one"
// "lower is better", "higher is better", "best at 1"; against the first chain (`reference` of a
// report is "a"), of which no way is better: "lower is more alike", ...
const char* words_of(Better better, std::string_view reference);
struct MetricInfo {
    std::string name;  // key: "hdr_flip"
    std::string help;  // one line, with its epsilon
    Better better = Better::lower;
};

// One metric of one variant. `frames` parallels Report::frames; the first frame's temporal
// errors and frames that failed have no value.
struct Series {
    std::vector<std::optional<double>> frames;
    std::optional<double> mean;
};
using Metrics = std::map<std::string, Series>;  // by MetricInfo::name

// Milliseconds over `n` repetitions.
struct TimeFigure {
    double median_ms = 0;
    double spread_ms = 0;  // upper minus lower quartile
    int n = 0;
};
inline constexpr int kTrustedRepeats = 5;  // the median of fewer says little
struct PassCost {
    std::string pass;  // "0.motion_blur"
    bool elided = false;
    TimeFigure time;
};
struct Timing {
    int frame = 0;  // the frame that was filtered repeatedly
    std::vector<PassCost> passes;
    TimeFigure total;         // sum of the passes of one repetition; no transfers
    std::string source;       // "wall clock around glFinish", "GL_TIMESTAMP"
    bool trustworthy = true;  // false: few repetitions, or something else ran on this machine
    std::string why_not;
};

// precision: GPU against the double reference. sampling: the double reference against the same
// filter converged. model: converged against the truth. total: GPU against the truth.
struct ErrorParts {
    std::optional<double> precision, sampling, model, total;
};
struct ErrorSplit {
    std::vector<int> frames;  // averaged over
    // MSE alone adds up: total = precision + sampling + model + cross.
    ErrorParts mse;
    std::optional<double> cross;
    // The other metrics, side by side; they do not add up.
    std::map<std::string, ErrorParts> others;
    int seeds = 0;                         // averaged in the converged image
    double converged_noise = 0;            // its remaining MSE, from the scatter over seeds
    std::vector<std::string> convergence;  // "motion_blur.samples 25 -> 401", "... seed averaged"
    std::vector<std::string> notes;        // omitted parts, and why
};

struct Variant {
    std::string name;                                        // "paper", "motion_blur.samples=5"
    std::vector<std::pair<std::string, std::string>> sweep;  // key, value
    std::string chain_text;                                  // a chain file (write_chain)
    uint64_t chain_hash = 0;
    Metrics metrics;
    std::optional<Timing> timing;
    std::optional<ErrorSplit> split;
    std::vector<std::string> passes;                // their types, as in the chain
    std::vector<std::pair<int, Elision>> elisions;  // frame, elided work
    std::string failure;                            // empty: none; the others continued
    bool pareto = false;                            // no other is both faster and closer
    bool resumed = false;                           // taken from an earlier, interrupted run
};

struct Interval {
    double low = 0;
    double high = 0;
};
enum class Finding { too_few_frames, no_measurable_difference, a_better, b_better };
const char* name_of(Finding finding);

// Variant 1 against variant 0 in one metric. Differences are B - A; for Better::one they are
// |B - 1| - |A - 1|, so that below 0 favors B, except with Better::higher.
struct MetricComparison {
    std::string metric;
    std::vector<std::optional<double>> differences;  // per frame
    int n = 0;                                       // frames with a value
    std::optional<double> mean;
    std::optional<Interval> t_interval;  // paired, 95 %; from two frames on
    std::optional<Interval> bootstrap;   // 95 %, tiles drawn within frames; means over pixels only
    int tiles = 0;                       // drawn per replicate
    Finding finding = Finding::too_few_frames;
    std::string words;  // one sentence
};
struct Comparison {
    std::vector<MetricComparison> metrics;
    uint64_t bootstrap_seed = 0;
    int bootstrap_replicates = 0;
    int bootstrap_tile_px = 0;
    std::string claims;   // the report's two claims, in words
    std::string verdict;  // in words
};

// The variant on which the page opens: the winner, and its metric.
struct Winner {
    size_t variant = 0;
    std::string metric;
    std::string words;  // "lowest mean HDR-FLIP of 3 variants: 0.1"
};

enum class ImageKind {
    input,  // unfiltered
    truth,
    color,      // a variant's result
    error,      // error map of a variant or of the scored input; one channel
    converged,  // without ground truth: a variant's reference; variants may share it
    slice,      // of the ground truth or a variant: Report::slice over the scored frames
};
const char* name_of(ImageKind kind);
struct StoredImage {
    ImageKind kind = ImageKind::color;
    int variant = -1;  // index into Report::variants; -1: input or ground truth
    int frame = 0;
    std::string map;   // ImageKind::error: hdr_flip or flip; the page makes other maps
    std::string path;  // relative to Report::folder
    int width = 0, height = 0, channels = 0;  // linear RGB, or 1
};

// A part of one row of pixels, which is shown over time.
struct Slice {
    int row = 0;
    int left = 0, width = 0;  // pixels, inside the image
};

// A region with large errors, or a chosen one.
struct Crop {
    int frame = 0;
    int x = 0, y = 0, width = 0, height = 0;  // pixels, inside the image
    std::string why;                          // "paper: mean HDR-FLIP 0.41"
};

inline constexpr const char* kNoiseSigma = "sigma";  // key in Report::truth_noise

struct Report {
    Kind kind = Kind::ab;
    std::string title;
    std::string folder;     // output; not part of the JSON
    io::OutputFiles files;  // which files may be written there; not part of the JSON
    std::vector<std::string> command;
    std::string version;  // postchain's version

    std::string input;                 // as typed
    std::optional<std::string> truth;  // as typed, or "generated (wheels, 256 samples)"
    std::string no_truth;              // why there is none
    // The metrics' reference: "truth"; without it "converged" (bench: each variant's own filter
    // converged) or "a" (ab: the first variant's image, which then has no values).
    std::string reference;
    std::vector<int> frames;         // in order
    std::vector<int> scored_frames;  // measured frames; without ground truth all frames
    int width = 0, height = 0;       // pixels
    std::vector<int> page_frames;    // frames whose images are kept

    std::vector<MetricInfo> metrics;
    std::vector<std::pair<std::string, double>> constants;  // epsilons and the like
    // Exposures of HDR-FLIP, from all references together; equal for every variant and frame.
    double exposure_start = 0, exposure_stop = 0;  // EV
    std::vector<double> exposures;
    std::string tone_mapper;
    std::string display_transform = "(max(x,0)/(1+max(x,0)))^(1/2.2)";

    std::string renderer;  // GL device and driver
    bool software = false;
    int threads = 0;
    std::string precision;           // fp16, fp32
    std::vector<std::string> seeds;  // "motion_blur.seed 0"

    std::vector<Variant> variants;  // ab: A, then B
    // The unfiltered input, scored like a variant's result; empty without ground truth. Flicker and
    // grid are properties of filters, so it has none.
    Metrics input_metrics;
    // Effect of the ground truth's own noise (metrics/noise.h): "sigma", and by metric the score of
    // an image without any error. Empty without ground truth.
    Metrics truth_noise;
    std::optional<Comparison> comparison;  // ab
    std::optional<Winner> winner;          // none: not decided, or no ground truth
    std::vector<std::string> under;        // bench: "flip=0.1: motion_blur.samples=9 (12.1 ms)"
    std::string pareto_metric;             // bench: the error of the Pareto set

    std::vector<StoredImage> images;
    std::vector<Crop> crops;
    std::optional<Slice> slice;         // of several scored frames with a ground truth
    std::vector<std::string> warnings;  // doubtful metrics, variants no better than the input
    std::vector<std::string> notes;     // omitted parts, minor doubts

    // Writes a text file of the report, whole or not at all. Errors (output), also if `files`
    // forbids it.
    Status write(const std::string& path, std::string_view text) const;
    // The stored image, or nullptr.
    const StoredImage* find(ImageKind of, int variant, int frame,
                            const std::string& map = {}) const;
};

// ---- Lists for the tables.

// A row of the tables of metrics: each variant, then the unfiltered input if it was scored.
struct ScoredRow {
    std::string name;
    const Metrics* metrics;
    const Variant* variant;  // null: the input
};
inline constexpr const char* kInputName = "input";
std::vector<ScoredRow> scored_rows(const Report& report);
std::optional<double> mean_of(const Metrics& metrics, const std::string& metric);

// Variants with a time, the fastest first.
std::vector<const Variant*> by_time(const Report& report);

// One sentence that names untrustworthy times and the reason; empty: none.
std::string doubt_about_times(const Report& report);

// Work that the plans of a variant elided over a sequence: one row for each item and rule.
struct ElisionRow {
    std::string variant;  // its name, or "all"
    std::string what;     // item_text()
    std::string rule;
    // In words. They differ between frames, because figures in them change; the first is that of
    // the first frame.
    std::vector<std::string> reasons;
    std::vector<int> frames;
    Saving saving;  // sum over the frames
    bool operator==(const ElisionRow&) const = default;
};
// In the order of first appearance. Rows that are equal in all variants come first and once, under
// "all". report.json and all tables of elided work use them.
std::vector<ElisionRow> elision_rows(const Report& report);

}  // namespace postchain::report

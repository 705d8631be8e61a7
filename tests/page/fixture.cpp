#include "tests/page/fixture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tools/measure/report/images.h"

namespace postchain::report::testing {

namespace {

void store(Report& report, StoredImage entry, const ImageF& pixels) {
    if (const auto status = store_image(report, std::move(entry), pixels); !status.ok()) {
        std::fprintf(stderr, "%s\n", status.message().c_str());
        std::exit(1);
    }
}

// Time rises, the error falls and rises again: variant 2 is beaten by variant 1.
constexpr double kErrors[kGood] = {0.4, 0.1, 0.2};
constexpr double kTimes[kGood] = {10, 40, 200};  // ms

Variant make_variant(int index) {
    Variant variant;
    const std::string samples = std::to_string(5 << index);
    variant.name = "motion_blur.samples=" + samples;
    variant.sweep = {{"motion_blur.samples", samples}};
    variant.chain_text =
        "postchain: 1\npasses:\n  - motion_blur: {samples: " + samples + "}  # </script> & <b>\n";
    variant.chain_hash = 0x1000u + unsigned(index);
    if (index == kGood) {
        variant.failure = "out of GL memory: 1.2 GiB asked for";
        return variant;
    }
    const double error = kErrors[index];
    variant.metrics["hdr_flip"] = {{error * 0.9, error * 1.1}, error};
    variant.metrics["mse"] = {{error / 10, error / 10}, error / 10};
    variant.metrics["psnr"] = {{30.0, 30.0}, -10 * std::log10(error / 10)};
    Timing timing;
    timing.frame = kFrames[0];
    timing.source = "wall clock around glFinish";
    timing.passes = {{"0.motion_blur", false, {kTimes[index] * 0.75, 0.5, 5}},
                     {"1.fxaa", index == 0, {kTimes[index] * 0.25, 0.2, 5}}};
    timing.total = {kTimes[index], 0.6, 5};
    variant.timing = timing;
    ErrorSplit split;
    split.frames = {kFrames[0]};
    split.mse = {1e-9, error / 50, error / 10, error / 10};
    split.cross = -error / 50 - 1e-9;
    split.others["hdr_flip"] = {1e-5, error / 5, error, error};
    split.seeds = 4;
    split.converged_noise = 1e-6;
    split.convergence = {"motion_blur.samples " + samples + " -> 401"};
    variant.split = split;
    variant.pareto = index < 2;
    variant.passes = {"motion_blur", "fxaa"};
    variant.elisions = {{kFrames[0],
                         {.kind = ElisionKind::plane,
                          .item = "motion_back",
                          .rule = "unused_plane",
                          .fact = {"no step reads it"},
                          .saving = {.bytes = 512}}}};
    if (index != 0) return variant;
    Elision step{.pass = 1,
                 .rule = "off_by_rule",
                 .fact = {.name = "largest step", .value = 0.31, .limit = 0.5, .unit = "px"},
                 .saving = {2304, 1, 5184}};
    variant.elisions.emplace_back(kFrames[0], step);
    step.fact.value = 0.25;
    variant.elisions.emplace_back(kFrames[1], step);
    variant.elisions.push_back({kFrames[1],
                                {.pass = 0,
                                 .kind = ElisionKind::blocks,
                                 .item = "still blocks",
                                 .rule = "on_device",
                                 .fact = {"nothing moves there"}}});
    return variant;
}

}  // namespace

ImageF variant_image(int variant, int frame) {
    ImageF image(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            image.at(x, y, 0) = (float(x) + 0.5f) / kWidth * float(1 << variant) *
                                (frame == kFrames[0] ? 1.0f : 0.5f);
            image.at(x, y, 1) = (float(y) + 0.5f) / kHeight;
            image.at(x, y, 2) = float(variant + 1) / 4;
        }
    if (variant == 1) {
        image.at(5, 7, 0) = std::nanf("");
        image.at(6, 7, 0) = 1e6f;
        image.at(7, 7, 0) = -1;
    }
    return image;
}

ImageF truth_image(int frame) {
    ImageF image = variant_image(0, frame);
    for (size_t i = 0; i < image.pixels(); ++i) image.data[3 * i + 1] *= 2;
    return image;
}

ImageF error_map(int variant, bool from_the_right) {
    ImageF image(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            image.at(x, y) = float(from_the_right ? kWidth - 1 - x : x) / (kWidth - 1) *
                             float(variant + 1) / kGood;
    return image;
}

Report make_report(const std::string& folder) {
    Report report;
    report.kind = Kind::bench;
    report.title = "A <test> & its \"report\"";
    report.folder = folder;
    report.files = io::OutputFiles(io::OnExisting::overwrite);
    report.files.write(io::OutputFolder{folder, "a report", ".mark", "", ""});
    report.command = {"postchain", "bench", "paper"};
    report.version = "0.1.0";
    report.input = "in.####.exr";
    report.truth = "truth.####.exr";
    report.reference = "truth";
    report.width = kWidth;
    report.height = kHeight;
    report.metrics = {{"hdr_flip", "HDR-FLIP at 67.02 pixels per degree", Better::lower},
                      {"mse", "mean (I-R)^2", Better::lower},
                      {"psnr", "dB, after the display transform", Better::higher}};
    report.constants = {{"relmse_epsilon", 0.01}};
    report.exposure_start = -2;
    report.exposure_stop = 1;
    report.exposures = {-2, -0.5, 1};
    report.tone_mapper = "aces";
    report.renderer = "llvmpipe";
    report.software = true;
    report.threads = 2;
    report.precision = "fp32";
    report.seeds = {"motion_blur.seed 0"};
    report.pareto_metric = "hdr_flip";
    report.under = {"hdr_flip=0.2: motion_blur.samples=10 (40 ms)"};
    report.crops = {{kFrames[0], 8, 8, 32, 32, "motion_blur.samples=10: mean HDR-FLIP 0.2"}};
    for (int v = 0; v <= kGood; ++v) report.variants.push_back(make_variant(v));
    for (const int frame : kFrames) {
        report.frames.push_back(frame);
        report.page_frames.push_back(frame);
        store(report, stored_image(ImageKind::truth, -1, frame, "truth"), truth_image(frame));
        store(report, stored_image(ImageKind::input, -1, frame, "input"),
              ImageF(kWidth, kHeight, 3, 0.5f));
        for (int v = 0; v < kGood; ++v) {
            const std::string name = std::to_string(v);
            store(report, stored_image(ImageKind::color, v, frame, "color" + name),
                  variant_image(v, frame));
            store(report, stored_image(ImageKind::error, v, frame, "error" + name, "hdr_flip"),
                  error_map(v));
            store(report, stored_image(ImageKind::error, v, frame, "flip" + name, "flip"),
                  error_map(v, true));
        }
    }
    return report;
}

Report make_blind_report(const std::string& folder) {
    Report report = make_report(folder);
    report.truth.reset();
    report.no_truth = "none was given";
    report.reference = "converged";
    std::erase_if(report.images,
                  [](const StoredImage& image) { return image.kind == ImageKind::truth; });
    for (Variant& variant : report.variants)
        if (variant.split) {
            variant.split->mse.model = variant.split->mse.total = variant.split->cross = {};
            variant.split->others["hdr_flip"].model = variant.split->others["hdr_flip"].total = {};
        }
    for (const int frame : kFrames)
        for (int v = 0; v < kGood; ++v)
            store(report, stored_image(ImageKind::converged, v, frame, v < 2 ? "many" : "more"),
                  v < 2 ? truth_image(frame) : ImageF(kWidth, kHeight, 3, 0.25f));
    return report;
}

Report make_scored_report(const std::string& folder) {
    Report report = make_report(folder);
    // Nearer than variant 0 (0.4), farther than the others; by mse and psnr worse than all.
    report.input_metrics["hdr_flip"] = {{0.3 * 0.9, 0.3 * 1.1}, 0.3};
    report.input_metrics["mse"] = {{0.5, 0.5}, 0.5};
    report.input_metrics["psnr"] = {{3.0, 3.0}, 3.0};
    report.truth_noise[kNoiseSigma] = {{0.0125, 0.0125}, 0.0125};
    report.truth_noise["mse"] = {{0.002, 0.002}, 0.002};
    report.winner = Winner{1, "hdr_flip", "motion_blur.samples=10 has the lowest mean HDR-FLIP"};
    report.warnings = {"1 of 4 variants is <no better> than doing nothing"};
    for (const int frame : kFrames)
        store(report, stored_image(ImageKind::error, -1, frame, "input_error", "hdr_flip"),
              error_map(kGood - 1));
    return report;
}

Report make_ab_report(const std::string& folder) {
    Report report = make_scored_report(folder);
    report.kind = Kind::ab;
    report.under.clear();
    report.pareto_metric.clear();
    report.variants.resize(2);
    std::erase_if(report.images, [](const StoredImage& image) { return image.variant > 1; });
    report.winner = Winner{0, "hdr_flip", "it says so"};
    report.scored_frames = report.frames;
    report.slice = Slice{40, 16, 64};
    for (int v = -1; v < 2; ++v) {
        ImageF slice(64, 2, 3);
        for (int i = 0; i < 2; ++i) {
            const ImageF whole = v < 0 ? truth_image(kFrames[i]) : variant_image(v, kFrames[i]);
            std::copy_n(whole.pixel(16, 40), 3 * 64, slice.pixel(0, i));
        }
        store(report, stored_image(ImageKind::slice, v, kFrames[0], concat("slice", v + 1)), slice);
    }
    const auto compared = [](const char* metric, Finding finding) {
        MetricComparison one;
        one.metric = metric;
        one.differences = {0.125, 0.25};
        one.n = 8;
        one.mean = 0.1875;
        one.t_interval = Interval{0.125, 0.25};
        one.finding = finding;
        one.words = "in words";
        return one;
    };
    report.comparison.emplace();
    report.comparison->metrics = {compared("hdr_flip", Finding::a_better),
                                  compared("mse", Finding::no_measurable_difference),
                                  compared("psnr", Finding::no_measurable_difference)};
    report.comparison->bootstrap_tile_px = 32;
    report.comparison->verdict = "A is nearer.";
    return report;
}

Report make_undecided_report(const std::string& folder) {
    Report report = make_ab_report(folder);
    report.reference = "a";
    report.winner.reset();
    for (MetricComparison& one : report.comparison->metrics) {
        one.finding = Finding::too_few_frames;
        one.n = 2;
    }
    report.comparison->metrics[1].differences = {0.0, 0.0};
    return report;
}

Report make_relative_report(const std::string& folder) {
    Report report = make_ab_report(folder);
    report.metrics[1] = {"relmse", "relative squared error", Better::lower};
    report.comparison->metrics[1].metric = "relmse";
    for (Variant& variant : report.variants) variant.metrics["relmse"] = {{0.5, 0.5}, 0.5};
    report.input_metrics["relmse"] = {{0.125, 0.125}, 0.125};
    return report;
}

}  // namespace postchain::report::testing

#include "tools/measure/experiment/settings.h"

#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/run/device.h"

namespace postchain::experiment {
namespace {

// For ExperimentSettings, and for types derived from it with other defaults.
template <class P>
ParameterTableBuilder<P> report_rows() {
    ParameterTableBuilder<P> builder = measuring_rows<P>();
    builder
        .text("output", &P::folder,
              {.unit = "DIR",
               .help = "folder of the report; created if it does not exist",
               .required = true})
        .text("assets", &P::assets,
              {.unit = "DIR",
               .help = "folder for the page's images, otherwise embedded in the page",
               .unset_means = "in the page"})
        .integer("page_frames", &P::page_frames,
                 {.min = 1, .max = 1000, .help = "frames whose images are kept, evenly spaced"})
        .integer("stability_frames", &P::stability_frames,
                 {.min = 0,
                  .max = kStabilityFrames,
                  .help = "frames on which flicker and grid are measured, evenly spaced"});
    return builder;
}

}  // namespace

void complete(ExperimentSettings& settings, RunContext context) {
    settings.run = std::move(context.run);
    for (const auto& chain : context.chain_files)
        settings.run.other_inputs.push_back({chain, "the chain file"});
    for (const auto& camera : context.cameras)
        for (auto& picture : io::inputs_of(camera))
            settings.run.other_inputs.push_back(std::move(picture));
    settings.input = std::move(context.input);
    settings.command = std::move(context.command);
    settings.threads = sequence::threads_of(context.threads);
    settings.flip.threads = context.threads;
}

const ParameterTable& flip_parameters() {
    static const ParameterTable table =
        ParameterTableBuilder<metrics::FlipSettings>()
            .number("ppd", &metrics::FlipSettings::pixels_per_degree,
                    {.min = metrics::kMinPixelsPerDegree,
                     .max = metrics::kMaxPixelsPerDegree,
                     .help = "pixels per degree of visual angle, for FLIP"})
            .choice("tone_mapper", &metrics::FlipSettings::tone_mapper,
                    metrics::tone_mapper_names(), {.help = "tone mapper of HDR-FLIP"})
            .table();
    return table;
}

const ParameterTable& ab_parameters() {
    static const ParameterTable table =
        report_rows<ExperimentSettings>()
            .choice("on_existing", &ExperimentSettings::on_existing, {"fail", "overwrite"},
                    {.help = "if the folder has a report"})
            .table();
    return table;
}

const ParameterTable& bench_parameters() {
    static const ParameterTable table =
        report_rows<BenchSettings>()
            .choice("on_existing",
                    static_cast<io::OnExisting BenchSettings::*>(&BenchSettings::on_existing),
                    {"fail", "overwrite", "skip"},
                    {.help = "if the folder has a report; skip: keep results of the same chain, "
                             "inputs and device"})
            .integer("max_variants", &BenchSettings::max_variants,
                     {.min = 1, .max = 100000, .help = "refuse a larger product of the sweeps"})
            .integer(
                "split_frames", &BenchSettings::split_frames,
                {.min = 0,
                 .max = 1000,
                 .help =
                     "number of frames on which the error is split into precision, sampling and "
                     "model"})
            .integer(
                "truth_samples", &BenchSettings::truth_samples,
                {.min = 1,
                 .max = 1 << 20,
                 .help = "samples per pixel for the ground truth of a generated scene, without "
                         "{truth}"_keyed})
            .table();
    return table;
}

}  // namespace postchain::experiment

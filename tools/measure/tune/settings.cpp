#include "tools/measure/tune/settings.h"

#include <charconv>
#include <cmath>

namespace postchain::tune {

const ParameterTable& tune_parameters() {
    static const ParameterTable table =
        experiment::measuring_rows<TuneSettings>()
            .text("output", &TuneSettings::folder,
                  {.unit = "FILE", .help = "the chain file to write", .required = true})
            .choice("on_existing",
                    static_cast<io::OnExisting TuneSettings::*>(&TuneSettings::on_existing),
                    {"fail", "overwrite"}, {.help = "if the chain file exists"})
            .text("budget", &TuneSettings::budget,
                  {.unit = "TIME",
                   .help = "find the least error within this time per frame on this device: 0.2, "
                           "0.2s, 200ms",
                   .unset_means = "--error decides"})
            .number("error", &TuneSettings::error,
                    {.min = 0,
                     .max = 1,
                     .min_excluded = true,
                     .help = "find the least time within this mean HDR-FLIP",
                     .unset_means = "--budget decides"})
            .integer("measure_frames", &TuneSettings::measure_frames,
                     {.min = 1, .max = 100, .help = "frames that are measured, evenly spaced"})
            .integer("max_chains", &TuneSettings::max_chains,
                     {.min = 1, .max = 1000, .help = "chains that are measured at most"})
            .table();
    return table;
}

Result<Goal> goal_of(const TuneSettings& settings) {
    if (settings.budget.empty() == !settings.error)
        return Status(StatusCode::usage,
                      settings.error ? "--budget and --error: give one of the two"
                                     : "give a time per frame (--budget 0.2s) or a mean HDR-FLIP "
                                       "(--error 0.07)");
    if (settings.error && !(*settings.error > 0))
        return Status(StatusCode::usage,
                      "--error: a mean HDR-FLIP is above 0; reports of bench have typical values");
    if (settings.error) return Goal{.budget_s = {}, .error = settings.error};
    const std::string& text = settings.budget;
    double value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::string unit(read.ptr, text.data() + text.size() - read.ptr);
    if (unit == "ms") value *= 1e-3;
    if (read.ec != std::errc() || (unit != "" && unit != "s" && unit != "ms") ||
        !std::isfinite(value) || value <= 0)
        return Status(StatusCode::usage, "--budget: '" + text +
                                             "' is not a time above 0; use a form like 0.2, 0.2s "
                                             "or 200ms");
    return Goal{.budget_s = value, .error = {}};
}

}  // namespace postchain::tune

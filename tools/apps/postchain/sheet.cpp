// postchain sheet: a contact sheet, one image with thumbnails of a sequence.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/sheet.h"

namespace postchain {
namespace {

Result<int> sheet_subcommand(const Options& options, sequence::SheetSettings sheet) {
    Options with_view = options;
    with_view.job.preview = true;  // uses the view of previews
    ASSIGN_OR_RETURN(sheet.run, run_settings_of(with_view));
    io::set_exr_threads(sequence::threads_of(options.threads));
    const StopOnSignal stop;
    const auto report = sequence::make_sheet(sheet, [&](int frame, size_t done, size_t total) {
        log::progress(concat("frame ", frame, ", ", done, " of ", total, " done"));
        return !stop.asked();
    });
    log::progress("");
    if (!report.ok() && stop.asked())
        return stop.interrupted("no sheet is written; run the same command again");
    if (!report.ok()) return report.status();
    for (const auto& text : report->unreadable) log::error(text);
    if (report->absent)
        log::warning(concat(report->absent, report->absent == 1 ? " image is" : " images are",
                            " not on disk; marked 'missing' on the sheet"));
    log::info(concat(sheet.output, ": ", report->frames, " of ", report->of, " frames"));
    return report->absent + report->unreadable.size() > 0 ? kExitSomeFailed : kExitOk;
}

}  // namespace

RunSubcommand add_sheet(CLI::App& subcommand, Options& o) {
    const auto sheet = std::make_shared<sequence::SheetSettings>();
    subcommand.add_option("IN", o.job.input, "the sequence, as for --input of run: out.####.exr")
        ->required();
    subcommand.add_option("-o,--output", sheet->output, "the sheet: a PNG")
        ->required()
        ->type_name("FILE");
    subcommand
        .add_option("--beside", sheet->beside,
                    "a second sequence, shown to the right of each frame: the input beside the "
                    "output")
        ->type_name("IN");
    subcommand
        .add_option("--cells", sheet->cells,
                    "maximum number of frames on the sheet; more are sampled evenly")
        ->check(number_within(CLI::Range(1, 10000)))
        ->capture_default_str();
    subcommand
        .add_option("--columns", sheet->columns,
                    "frames per row (default: about 16:9 for the sheet)")
        ->check(number_within(CLI::Range(1, 10000)));
    subcommand.add_option("--width", sheet->width, "thumbnail width in pixels")
        ->check(number_within(CLI::Range(16, 4096)))
        ->capture_default_str();
    add_on_existing(subcommand, "if the sheet exists", sheet->on_existing);
    add_displayed(subcommand, o);
    return [&o, sheet] { return sheet_subcommand(o, *sheet); };
}

}  // namespace postchain

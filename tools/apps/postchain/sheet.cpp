// postchain sheet: a contact sheet, one image with thumbnails of a sequence.
//
//   frames of IN, evenly chosen --read, shrink, show--> thumbnails with their numbers --> one PNG
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/stop_on_signal.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/png.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain {
namespace {

struct SheetOptions {
    std::string output;
    std::string beside;  // a second pattern; empty = none
    int cells = 60;      // maximum
    int columns = 0;     // 0 = chosen so that the sheet is about 16:9
    int width = 240;     // of a thumbnail, pixels
    io::OnExisting on_existing = io::OnExisting::fail;
};

constexpr int kMaxPixels = 16384;  // on a side

// Content of a cell: a file for each side, or none.
struct SheetFrame {
    int number = 0;
    std::vector<std::string> files;  // empty = not on disk
};

struct SheetWork {
    sequence::RunSettings settings;
    std::vector<SheetFrame> frames;
    size_t of = 0;  // number of frames before selection
    int sides = 1;
    io::OutputFiles files;
};

Result<SheetWork> work_of(const Options& options, const SheetOptions& sheet) {
    SheetWork work;
    Options with_view = options;
    with_view.job.preview = true;  // uses the view of previews
    ASSIGN_OR_RETURN(work.settings, run_settings_of(with_view));
    if (!sheet.output.ends_with(".png"))
        return Status(StatusCode::usage, "--output: " + sheet.output + " does not end in .png");
    std::vector<io::PathPattern> patterns = {work.settings.input.color()};
    work.files = io::OutputFiles(sheet.on_existing);
    sequence::read_inputs(work.settings, work.files);
    if (!sheet.beside.empty()) {
        ASSIGN_OR_RETURN(auto beside, io::PathPattern::parse(sheet.beside).at("--beside"));
        work.files.read(beside, "the image beside it");
        patterns.push_back(std::move(beside));
    }
    work.files.write(
        io::OutputFile{sheet.output, "the contact sheet", "name another with --output"});
    RETURN_IF_ERROR(work.files.check());
    work.files.remove_left_temporaries();

    std::vector<std::map<int, std::string>> on_disk;
    for (const auto& pattern : patterns) on_disk.push_back(pattern.discover());
    std::vector<int> numbers;
    if (work.settings.frames)
        numbers = work.settings.frames->frames;
    else
        for (const auto& [number, path] : on_disk[0]) numbers.push_back(number);
    if (numbers.empty())
        return Status(StatusCode::input, patterns[0].text() + ": " + io::why_none(patterns[0]));
    work.of = numbers.size();
    work.sides = int(patterns.size());
    for (const size_t i : io::evenly_chosen(numbers.size(), size_t(sheet.cells))) {
        SheetFrame frame{numbers[i], {}};
        for (const auto& files : on_disk) {
            const auto found = files.find(frame.number);
            frame.files.push_back(found == files.end() ? "" : found->second);
        }
        work.frames.push_back(std::move(frame));
    }
    return work;
}

// The display window, black outside the data window.
Result<ImageF> read_shown(const SheetWork& work, const std::string& path, int number) {
    ASSIGN_OR_RETURN(auto color, sequence::read_color(work.settings.source, path, number));
    log::detail(concat(path, ": profile ", color.profile));
    return io::placed(color.rgba(), color.input.window, color.input.display_window);
}

// Fitted to the cell, with the image's proportions.
Result<Image<uint8_t>> thumbnail_of(const SheetWork& work, const ImageF& picture,
                                    const io::SheetLayout& layout) {
    const double scale =
        std::min(double(layout.width) / picture.width, double(layout.height) / picture.height);
    const int width = std::clamp(int(std::lround(picture.width * scale)), 1, layout.width);
    const int height = std::clamp(int(std::lround(picture.height * scale)), 1, layout.height);
    return io::shown_image(io::shrunk(picture, width, height), {.view = work.settings.view});
}

// The number of columns that brings the sheet closest to 16:9.
int fitting_columns(io::SheetLayout layout) {
    int best = 1;
    double least = std::numeric_limits<double>::infinity();
    for (layout.columns = 1; layout.columns <= layout.cells; ++layout.columns) {
        const double shape = double(layout.image_width()) / double(layout.image_height());
        const double off = std::abs(std::log(shape * 9 / 16));
        if (off < least) best = layout.columns;
        least = std::min(least, off);
    }
    return best;
}

// Layout for the first readable frame. Errors (input): none is readable.
Result<io::SheetLayout> layout_of(const SheetWork& work, const SheetOptions& sheet) {
    Status first(StatusCode::input,
                 work.settings.input.color().text() + ": none of the frames is on disk");
    bool tried = false;
    for (const SheetFrame& frame : work.frames)
        for (const std::string& path : frame.files) {
            if (path.empty()) continue;
            const auto picture = read_shown(work, path, frame.number);
            if (!picture.ok()) {
                // No other frame would do better.
                if (picture.status().code() != StatusCode::input) return picture.status();
                if (!tried) first = picture.status();
                tried = true;
                continue;
            }
            io::SheetLayout layout;
            layout.cells = int(work.frames.size());
            layout.sides = work.sides;
            layout.width = sheet.width;
            layout.height = std::max(
                1, int(std::lround(double(sheet.width) * picture->height / picture->width)));
            layout.columns =
                sheet.columns > 0 ? std::min(sheet.columns, layout.cells) : fitting_columns(layout);
            if (layout.image_width() > kMaxPixels || layout.image_height() > kMaxPixels)
                return Status(StatusCode::usage,
                              concat("the sheet would have ", layout.image_width(), "x",
                                     layout.image_height(), " pixels; the limit is ", kMaxPixels,
                                     " a side; choose fewer --cells or a smaller "
                                     "--width"));
            return layout;
        }
    return first;
}

Result<int> sheet_subcommand(const Options& options, const SheetOptions& sheet) {
    ASSIGN_OR_RETURN(const SheetWork work, work_of(options, sheet));
    io::set_exr_threads(sequence::threads_of(options.threads));
    const StopOnSignal stop;
    ASSIGN_OR_RETURN(const auto layout, layout_of(work, sheet));
    io::ContactSheet page(layout);
    size_t absent = 0, unreadable = 0;
    for (size_t i = 0; i < work.frames.size(); ++i) {
        const SheetFrame& frame = work.frames[i];
        if (stop.asked())
            return stop.interrupted("no sheet is written; run the same command again");
        log::progress(concat("frame ", frame.number, ", ", i, " of ", work.frames.size(), " done"));
        page.label(int(i), concat(frame.number));
        for (int side = 0; side < work.sides; ++side) {
            const std::string& path = frame.files[size_t(side)];
            if (path.empty()) {
                ++absent;
                page.say(int(i), side, "missing");
                continue;
            }
            const auto picture = read_shown(work, path, frame.number);
            if (!picture.ok()) {
                ++unreadable;
                log::error(picture.status().message());
                page.say(int(i), side, "unreadable");
                continue;
            }
            ASSIGN_OR_RETURN(const auto thumbnail, thumbnail_of(work, *picture, layout));
            page.put(int(i), side, thumbnail);
        }
    }
    log::progress("");
    page.footer(work.frames.size() < work.of
                    ? concat(work.frames.size(), " of ", work.of, " frames")
                    : concat(work.of, work.of == 1 ? " frame" : " frames"));
    ASSIGN_OR_RETURN(const auto png, io::encode_png(page.picture()).at(sheet.output));
    ASSIGN_OR_RETURN(const auto permit, work.files.permit(sheet.output));
    RETURN_IF_ERROR(io::atomic_write_text(sheet.output, png, permit).status());
    if (absent)
        log::warning(concat(absent, absent == 1 ? " image is" : " images are",
                            " not on disk; marked 'missing' on the sheet"));
    log::info(concat(sheet.output, ": ", work.frames.size(), " of ", work.of, " frames"));
    return absent + unreadable > 0 ? kExitSomeFailed : kExitOk;
}

}  // namespace

RunSubcommand add_sheet(CLI::App& subcommand, Options& o) {
    const auto sheet = std::make_shared<SheetOptions>();
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
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    subcommand
        .add_option("--columns", sheet->columns,
                    "frames per row (default: about 16:9 for the sheet)")
        ->check(CLI::Range(1, 10000));
    subcommand.add_option("--width", sheet->width, "thumbnail width in pixels")
        ->check(CLI::Range(16, 4096))
        ->capture_default_str();
    add_on_existing(subcommand, "if the sheet exists", sheet->on_existing);
    add_displayed(subcommand, o);
    return [&o, sheet] { return sheet_subcommand(o, *sheet); };
}

}  // namespace postchain

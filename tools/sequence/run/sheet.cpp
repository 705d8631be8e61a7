#include "tools/sequence/run/sheet.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tools/sequence/files/output_files.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/png.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {
namespace {

constexpr int kMaxPixels = 16384;  // on a side

// Content of a cell: a file for each side, or none.
struct SheetFrame {
    int number = 0;
    std::vector<std::string> files;  // empty = not on disk
};

struct SheetWork {
    RunSettings settings;
    std::vector<SheetFrame> frames;
    size_t of = 0;  // number of frames before selection
    int sides = 1;
    io::OutputFiles files;
};

Result<SheetWork> work_of(const SheetSettings& sheet) {
    SheetWork work;
    work.settings = sheet.run;
    if (!sheet.output.ends_with(".png"))
        return Status(StatusCode::usage,
                      "{output}: "_keyed + sheet.output + " does not end in .png");
    std::vector<io::PathPattern> patterns = {work.settings.input.color()};
    work.files = io::OutputFiles(sheet.on_existing);
    read_inputs(work.settings, work.files);
    if (!sheet.beside.empty()) {
        ASSIGN_OR_RETURN(auto beside, io::PathPattern::parse(sheet.beside).at("{beside}"_keyed));
        work.files.read(beside, "the image beside it");
        patterns.push_back(std::move(beside));
    }
    work.files.write(
        io::OutputFile{sheet.output, "the contact sheet", "name another with {output}"_keyed});
    RETURN_IF_ERROR(work.files.check());
    RETURN_IF_ERROR(work.files.check_folders());
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
    ASSIGN_OR_RETURN(auto color, read_color(work.settings.source, path, number));
    return io::placed(color.rgba, color.window, color.display_window);
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
Result<io::SheetLayout> layout_of(const SheetWork& work, const SheetSettings& sheet) {
    Status first(StatusCode::input,
                 work.settings.input.color().text() +
                     ": none of the frames is on disk; check pattern and frame numbers");
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
                                     " a side; choose fewer {cells} or a smaller "
                                     "{width}"_keyed));
            return layout;
        }
    return first;
}

}  // namespace

Result<SheetReport> make_sheet(const SheetSettings& sheet, const SheetProgress& progress) {
    ASSIGN_OR_RETURN(const SheetWork work, work_of(sheet));
    ASSIGN_OR_RETURN(const auto layout, layout_of(work, sheet));
    io::ContactSheet page(layout);
    SheetReport report;
    report.frames = work.frames.size();
    report.of = work.of;
    for (size_t i = 0; i < work.frames.size(); ++i) {
        const SheetFrame& frame = work.frames[i];
        if (!progress(frame.number, i, work.frames.size()))
            return Status(StatusCode::canceled, "stopped; no sheet is written");
        page.label(int(i), concat(frame.number));
        for (int side = 0; side < work.sides; ++side) {
            const std::string& path = frame.files[size_t(side)];
            if (path.empty()) {
                ++report.absent;
                page.say(int(i), side, "missing");
                continue;
            }
            const auto picture = read_shown(work, path, frame.number);
            if (!picture.ok()) {
                report.unreadable.push_back(picture.status().message());
                page.say(int(i), side, "unreadable");
                continue;
            }
            ASSIGN_OR_RETURN(const auto thumbnail, thumbnail_of(work, *picture, layout));
            page.put(int(i), side, thumbnail);
        }
    }
    page.footer(work.frames.size() < work.of
                    ? concat(work.frames.size(), " of ", work.of, " frames")
                    : concat(work.of, work.of == 1 ? " frame" : " frames"));
    ASSIGN_OR_RETURN(const auto png, io::encode_png(page.picture()).at(sheet.output));
    RETURN_IF_ERROR(work.files.put(sheet.output, png));
    return report;
}

}  // namespace postchain::sequence

#include "tools/sequence/source/frame_scan.h"

#include <algorithm>
#include <cmath>

#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

constexpr int64_t kStripBytes = int64_t(64) << 20;
constexpr int64_t kNextBytes = int64_t(256) << 20;
// Color, depth and both motion vectors, in the file's types and as float.
constexpr int64_t kPixelBytes = 2 * 9 * 4;

}  // namespace

int strip_rows(const FrameHeader& header) {
    const int64_t row = std::max<int64_t>(1, int64_t(header.window.width()) * kPixelBytes);
    int64_t rows = std::max<int64_t>(1, kStripBytes / row);
    const int at_once =
        header.files.color_file().rows_at_once(header.assignment.at(Role::color).part);
    rows = std::max<int64_t>(1, rows / at_once) * at_once;
    return int(std::min<int64_t>(rows, header.window.height()));
}

Result<SourceFrame> scan_source_frame(const SourceSettings& settings, const FrameHeader& header,
                                      RoleSet wanted, int rows, const StripObserver& observer) {
    const int height = header.window.height();
    SourceFrame frame;
    SourceFindings all;
    RETURN_IF_ERROR(
        check_memory(header.files.color_file().path(),
                     frame_bytes(header, planes_of(header, wanted), io::Keep::nothing, rows),
                     settings.max_memory));
    for (int first = 0; first < height; first += rows) {
        const int end = std::min(height, first + rows);
        ASSIGN_OR_RETURN(auto strip, read_source_strip(settings, header, planes_of(header, wanted),
                                                       io::Keep::nothing, first, end));
        frame.read_ms += strip.read_ms;
        frame.convert_ms += strip.convert_ms;
        if (observer) observer(strip.planes, first);
        if (first == 0)
            all = strip.findings;
        else
            all.add(strip.findings);
        if (end < height) continue;
        strip.findings = all;
        strip.planes.clear();
        conclude(frame, settings, header, std::move(strip));
    }
    return frame;
}

Result<SignCheck> scan_signs(const SourceSettings& settings, const FrameHeader& header,
                             const FrameHeader& next, double longest_px, int rows) {
    SignCheck none;
    const io::Window &display = color_part(header).display_window,
                     &next_display = color_part(next).display_window;
    if (display != next_display) {
        none.why_not = "the next frame has another display window, " + next_display.text();
        return none;
    }
    const io::Window& window = header.window;
    const int64_t row = std::max<int64_t>(1, int64_t(window.width()) * 4 * 4);
    const double margin_limit = double(std::max<int64_t>(rows, kNextBytes / row / 2));
    const int margin = int(std::ceil(std::min(longest_px + 1, margin_limit)));
    SignChecker checker;
    for (int first = 0; first < window.height(); first += rows) {
        const int end = std::min(window.height(), first + rows);
        ASSIGN_OR_RETURN(auto strip,
                         read_source_strip(settings, header,
                                           planes_of(header, {Role::inverse_depth, Role::motion,
                                                              Role::motion_back}),
                                           io::Keep::nothing, first, end));
        io::Window around = window;
        around.min_y = window.min_y + std::max(0, first - margin);
        around.max_y = window.min_y + std::min(window.height(), end + margin) - 1;
        const io::Window there = around.intersected(next.window);
        ImageF color(around.width(), around.height(), 4);
        if (!there.empty()) {
            ASSIGN_OR_RETURN(auto rows_of_next,
                             read_source_strip(settings, next, {Role::color}, io::Keep::nothing,
                                               there.min_y - next.window.min_y,
                                               there.max_y + 1 - next.window.min_y));
            io::Window read = next.window;
            read.min_y = there.min_y;
            read.max_y = there.max_y;
            color = io::placed(rows_of_next.planes.at(Role::color), read, around);
        }
        checker.add(strip.planes, {first, first, end, window.height()}, color,
                    around.min_y - window.min_y);
    }
    return checker.result();
}

}  // namespace postchain::sequence

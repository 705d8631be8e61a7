#include "tools/sequence/source/frame_source.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <utility>

#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

constexpr int64_t kStripBytes = int64_t(64) << 20;
// Color, depth and both motion vectors, in the file's types and as float.
constexpr int64_t kPixelBytes = 2 * 9 * 4;

// Rows of a frame: first .. end - 1 of FrameHeader::window.
struct SourceRows {
    io::StoredFrame stored;
    FrameDescription description;
    FramePlanes planes;  // canonical
    FrameFindings findings;
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    MatteFindings mattes;
};

// Adds the planes that are not channels of a role: layers, cryptomattes and mattes.
Status decode_layers(const FrameHeader& header, RoleSet present, io::StoredFrame& read,
                     SourceRows& rows) {
    io::PixelFile& file = header.files.color_file();
    if (present.has(Role::layers) && !header.layers.filtered.empty()) {
        ASSIGN_OR_RETURN(read.planes[Role::layers], read_layers(header.layers, file, read));
    }
    if (present.has(Role::layers) && header.layers.filtered_cryptomattes > 0) {
        auto cryptomattes = std::make_shared<FrameCryptomattes>();
        cryptomattes->window = read.window;
        for (size_t i = 0; i < header.layers.filtered_cryptomattes; ++i) {
            const io::Cryptomatte& one = header.layers.cryptomattes[i];
            ASSIGN_OR_RETURN(auto ranks, io::read_ranks(file, one, read.window));
            rows.mattes.add_cryptomatte(file.path(), one, ranks);
            cryptomattes->names.push_back(one.name);
            cryptomattes->ranks.push_back(std::move(ranks));
        }
        rows.cryptomattes = std::move(cryptomattes);
    }
    if (present.has(Role::mattes)) {
        ASSIGN_OR_RETURN(read.planes[Role::mattes],
                         read_mattes(header.layers, file, read, rows.mattes));
    }
    return Status();
}

// Reads the rows `first` .. `end` - 1 in the files' own convention.
Status decode(const FrameHeader& header, RoleSet present, io::Keep keep, int first, int end,
              SourceRows& rows) {
    io::PlanesArea area{header.window, header.match.options};
    area.window.min_y = header.window.min_y + first;
    area.window.max_y = header.window.min_y + end - 1;
    const RoleSet made = header.makes_motion ? RoleSet{Role::motion, Role::motion_back} : RoleSet{};
    constexpr RoleSet kNoChannels = {Role::layers, Role::mattes, Role::behind};
    ASSIGN_OR_RETURN(auto read, io::read_frame(header.files, header.match.roles,
                                               present - kNoChannels - made, keep, area));
    for (Role role : {Role::motion, Role::motion_back})
        if (made.has(role) && present.has(role)) {
            const ImageF& color = read.planes.at(Role::color);
            read.planes[role] = ImageF(color.width, color.height, channels_of(role));
        }
    RETURN_IF_ERROR(decode_layers(header, present, read, rows));
    rows.stored = std::move(read);
    return Status();
}

// Converts decoded rows to canonical planes, and analyzes them.
Status convert(const FrameHeader& header, SourceRows& rows) {
    FramePlanes& planes = rows.planes = std::move(rows.stored.planes);
    rows.description = describe(header);
    FrameFindings& findings = rows.findings;
    ASSIGN_OR_RETURN(
        findings.health,
        convert_frame(planes, rows.description, header.match.options).at(color_path(header)));
    findings.half_depth = rows.stored.half_depth;
    findings.edges = count_mixed_edges(planes);
    findings.clear_edges = fill_clear_edges(planes);
    if (header.zoom) {
        findings.zoom_motion_added =
            add_zoom_motion(*header.zoom, header.sky.has_value(), planes, rows.description);
        findings.health.motion_all_zero = false;
    }
    if (header.makes_motion) {
        findings.motion_from_camera = set_camera_motion(*header.sky, planes, rows.description);
        findings.health.motion_all_zero = findings.health.motion_in_0_1 = false;
    } else if (header.sky)
        findings.sky_motion_from_camera = fill_sky_motion(*header.sky, planes, rows.description);
    else
        findings.sky = count_sky(planes);
    return Status();
}

// Why the stored depth seems to have another encoding; empty: it does not. A depth buffer's values
// lie between the clip planes by themselves.
std::string doubt_of_depth(const SourceFrame& frame) {
    const DepthEncoding encoding = frame.header.match.options.depth;
    const bool inverse = encoding == DepthEncoding::inverse;
    if (!frame.description.planes.has(Role::inverse_depth) ||
        !(inverse || encoding == DepthEncoding::linear))
        return "";
    const double most = frame.description.bounds.max_inverse_depth;
    if (inverse && most == 0) return "depth, read as 1/distance, is 0 everywhere: infinitely far";
    // Without a clip plane: distances of the sky, read as 1/distance.
    constexpr double kNearest = 1e-4;
    const auto& near = frame.description.camera.near_clip;
    const double nearest = near ? *near * (1 - 1e-3) : inverse ? kNearest : 0;
    if (!std::isfinite(most) || most * nearest <= 1) return "";
    const std::string remedy =
        inverse ? "is it a distance? Then give {profile=generic}, or a profile of "
                  "your own with encoding: linear"_keyed
                : "is it a distance in scene units? Otherwise state its encoding in a "
                  "profile of your own";
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%.3g", 1 / most);
    return concat("the nearest depth, read as ", inverse ? "1/distance" : "distance", ", is ",
                  digits, ", before the near clip plane", near ? concat(" at ", *near) : "", "; ",
                  remedy);
}

// Stored as pixels, so that 0..1 is less than a pixel.
bool are_plain_pixels(const MotionConvention& motion) {
    return motion.unit == MotionUnit::pixels && motion.bias == 0 && std::abs(motion.scale_x) == 1 &&
           std::abs(motion.scale_y) == 1;
}

Result<SourceRows> read_rows(const FrameHeader& header, RoleSet present, io::Keep keep, int first,
                             int end) try {
    SourceRows rows;
    const auto start = Clock::now();
    RETURN_IF_ERROR(decode(header, present, keep, first, end, rows));
    const double read_ms = milliseconds_since(start);
    RETURN_IF_ERROR(convert(header, rows));
    rows.findings.read_ms = read_ms;
    rows.findings.convert_ms = milliseconds_since(start) - read_ms;
    return rows;
} catch (const std::bad_alloc&) {
    return Status(StatusCode::memory,
                  concat(color_path(header), ": not enough memory: needs ",
                         bytes_text(frame_bytes(header, present, keep, end - first)),
                         "; free some or render smaller"));
}

// Fills a frame, except its planes. `header` is the rows'.
void conclude(SourceFrame& frame, const SourceSettings& settings, FrameHeader header,
              SourceRows rows) {
    const std::string path = color_path(header);
    frame.stored = std::move(rows.stored);
    frame.description = std::move(rows.description);
    for (const auto& [role, where] : header.match.roles)
        if (!frame.description.planes.has(role)) frame.description.not_converted.add(role);
    if (rows.cryptomattes && !rows.cryptomattes->ranks.empty())
        frame.cryptomattes = std::move(rows.cryptomattes);
    frame.warnings = std::move(header.warnings);
    frame.warnings.insert(frame.warnings.end(), rows.mattes.warnings.begin(),
                          rows.mattes.warnings.end());
    if (rows.mattes.faulty > 0)
        frame.strict_fault =
            Status(StatusCode::health,
                   concat(path, ": ", rows.mattes.faulty,
                          " faulty values in mattes under {strict=true}; nothing written"_keyed));
    frame.header = std::move(header);
    frame.findings = std::move(rows.findings);
    FrameFindings& findings = frame.findings;
    if (frame.header.sky_is_still) findings.sky = {};
    InputHealth& health = findings.health;
    const auto warn = [&](const std::string& text) {
        frame.warnings.push_back(path + ": " + text);
    };
    const auto count = [&](uint64_t pixels, const char* what) {
        if (pixels) warn(concat(pixels, " pixels ", what));
    };
    count(health.nonfinite_color, "with non-finite color (or beyond 1e34) were replaced");
    count(health.nonfinite_depth, "with non-finite depth are treated as infinitely far");
    count(health.nonfinite_motion, "with non-finite motion are treated as static");
    if (auto& first = health.first_nonfinite) {
        (*first)[0] += frame.header.window.min_x;
        (*first)[1] += frame.header.window.min_y;
        warn("the first non-finite pixel is " + findings.first_nonfinite_text());
        frame.strict_fault =
            Status(StatusCode::health,
                   concat(path, ": ", health.nonfinite(),
                          " non-finite pixels under {strict=true}, the first at "_keyed,
                          findings.first_nonfinite_text(), "; nothing written"));
    }
    count(health.negative_depth, "with depth <= 0 are treated as infinitely far");
    if (const std::string doubt = doubt_of_depth(frame); !doubt.empty()) warn(doubt);
    count(health.sentinel_motion, "with the 'no vector' sentinel are treated as static");
    count(
        findings.sky.without_motion(),
        "of sky have no motion although everything else moves; they stay sharp (a camera file with "
        "camera_matrix_world gives them camera motion)");
    if (findings.motion_from_camera && settings.camera_motion == CameraMotion::missing)
        warn(concat("no motion vectors (looked for ", frame.header.match.missing[Role::motion],
                    "): the camera's are used, and objects that move by themselves stay sharp "
                    "({camera_motion=all}, if that is meant)"_keyed));
    if (frame.description.planes.has(Role::motion) && health.motion_all_zero)
        warn(health.sentinel_motion > 0
                 ? "every motion vector is zero or the sentinel: there will be no motion blur"
                 : "every motion vector is zero: there will be no motion blur (Cycles writes zero "
                   "vectors when its own motion blur is on; switch it off)");
    else if (frame.description.planes.has(Role::motion) && health.motion_in_0_1 &&
             health.fastest_stored_px > 0 && are_plain_pixels(frame.header.match.options.motion))
        warn(
            "every motion vector lies in 0..1: is the channel clamped, or does it hold fractions "
            "of the image? Write vectors of both signs in pixels, or state `unit`, `bias` and "
            "`scale` in a profile of your own");
    if (findings.half_depth)
        warn(
            "depth is half float: its steps of 2^-11 are visible in the circle of confusion; write "
            "depth as float");
}

}  // namespace

RoleSet planes_of(const FrameHeader& header, RoleSet wanted) {
    RoleSet present = RoleSet{Role::color} | (wanted & roles_in_files(header));
    // Vectors at clear edges and of the sky depend on depth, and conversion goes through `motion`.
    if (present.has(Role::motion) || present.has(Role::motion_back))
        present = present | (roles_in_files(header) & RoleSet{Role::inverse_depth, Role::motion});
    return present;
}

double color_change(const ImageF& color, const ImageF& next) {
    constexpr int kBlock = 8;
    const int width = std::min(color.width, next.width);
    const int height = std::min(color.height, next.height);
    double sum = 0;
    size_t values = 0;
    for (int top = 0; top < height; top += kBlock)
        for (int left = 0; left < width; left += kBlock)
            for (int c = 0; c < 3; ++c) {
                double difference = 0;
                int pixels = 0;
                for (int y = top; y < std::min(top + kBlock, height); ++y)
                    for (int x = left; x < std::min(left + kBlock, width); ++x, ++pixels) {
                        const double a = std::max(0.0, double(color.at(x, y, c)));
                        const double b = std::max(0.0, double(next.at(x, y, c)));
                        difference += a / (1 + a) - b / (1 + b);
                    }
                sum += std::abs(difference / pixels);
                ++values;
            }
    return values ? sum / double(values) : 0;
}

std::optional<double> part_of_hard_edges(const ImageF& color) {
    constexpr double kStep = 0.2, kEven = 0.02, kPart = 0.15;
    constexpr int kLines = 256;           // along each axis, so that large frames take no longer
    constexpr uint64_t kLeastEdges = 64;  // below that chance decides
    uint64_t hard = 0, soft = 0;
    std::vector<double> shown;
    // The values from `first` to `last` rise by a step, and beside them lie two even sides.
    const auto is_edge = [&](size_t first, size_t last) {
        const double step = std::abs(shown[last] - shown[first]), even = kEven + 0.1 * step;
        return step > kStep && std::abs(shown[first] - shown[first - 1]) < even &&
               std::abs(shown[last + 1] - shown[last]) < even;
    };
    const auto count = [&](int length, const auto& pixel_at) {
        shown.resize(size_t(length));
        for (int i = 0; i < length; ++i) {
            const float* pixel = pixel_at(i);
            const double light = std::max(0.0, double(pixel[0]) + pixel[1] + pixel[2]) / 3;
            shown[size_t(i)] = std::sqrt(light / (1 + light));
        }
        for (size_t i = 1; i + 2 < shown.size(); ++i) {
            hard += is_edge(i, i + 1);
            if (i + 3 >= shown.size() || !is_edge(i, i + 2)) continue;
            const double part = (shown[i + 1] - shown[i]) / (shown[i + 2] - shown[i]);
            soft += part > kPart && part < 1 - kPart;
        }
    };
    for (int y = 0; y < color.height; y += std::max(1, color.height / kLines))
        count(color.width, [&](int x) { return color.pixel(x, y); });
    for (int x = 0; x < color.width; x += std::max(1, color.width / kLines))
        count(color.height, [&](int y) { return color.pixel(x, y); });
    if (hard + soft < kLeastEdges) return std::nullopt;
    return double(hard) / double(hard + soft);
}

std::string doubt_of_speed(double max_speed_px, double change) {
    constexpr double kSlow = 0.25, kChange = 0.01;
    if (!(max_speed_px > 0) || max_speed_px > kSlow || change < kChange) return "";
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%.3g", max_speed_px);
    return concat("the longest motion vector is ", digits,
                  " px, but the next frame's color differs: are vectors fractions of the image? "
                  "State `unit: fraction` or a `scale` in a profile of your own");
}

SharedPlanes shared(FramePlanes planes) {
    SharedPlanes shared;
    for (auto& [role, plane] : planes)
        shared[role] = std::make_shared<const ImageF>(std::move(plane));
    return shared;
}

Result<SourceFrame> read_source_frame(const SourceSettings& settings, FrameHeader header,
                                      RoleSet wanted, io::Keep keep) {
    const RoleSet present = planes_of(header, wanted);
    RETURN_IF_ERROR(check_memory(color_path(header),
                                 frame_bytes(header, present, keep, header.window.height()),
                                 settings.max_memory));
    ASSIGN_OR_RETURN(auto rows, read_rows(header, present, keep, 0, header.window.height()));
    SourceFrame frame;
    frame.planes = shared(std::move(rows.planes));
    conclude(frame, settings, std::move(header), std::move(rows));
    return frame;
}

int strip_rows(const FrameHeader& header) {
    const int64_t row = std::max<int64_t>(1, int64_t(header.window.width()) * kPixelBytes);
    int64_t rows = std::max<int64_t>(1, kStripBytes / row);
    const int at_once = header.files.color_file().rows_at_once(color_channels(header).part);
    rows = std::max<int64_t>(1, rows / at_once) * at_once;
    return int(std::min<int64_t>(rows, header.window.height()));
}

Result<int> scan_source_frame(const SourceSettings& settings, const FrameHeader& header, int rows,
                              const StripObserver& observer) {
    const RoleSet present = {Role::color};
    const int height = header.window.height();
    RETURN_IF_ERROR(check_memory(color_path(header),
                                 frame_bytes(header, present, io::Keep::nothing, rows),
                                 settings.max_memory));
    int strips = 0;
    for (int first = 0; first < height; first += rows, ++strips) {
        ASSIGN_OR_RETURN(const auto strip, read_rows(header, present, io::Keep::nothing, first,
                                                     std::min(height, first + rows)));
        observer(strip.planes, first);
    }
    return strips;
}

std::string FrameFindings::first_nonfinite_text() const {
    const auto& first = health.first_nonfinite;
    return first ? concat("(", (*first)[0], ", ", (*first)[1], ")") : "none";
}

ImageF stored_color(const SourceFrame& frame) {
    return frame.stored.kept->interleaved(color_channels(frame.header).channels,
                                          frame.stored.window, 4, 1);
}

Result<ColorFile> read_color(const SourceSettings& settings, const std::string& path, int frame) {
    ASSIGN_OR_RETURN(auto header, open_source_frame(settings, {{Role::color, path}}, frame));
    // Two images and their copies; error maps are not counted.
    const uint64_t bytes =
        frame_bytes(header, {Role::color}, io::Keep::nothing, header.window.height());
    RETURN_IF_ERROR(check_memory(path, 2 * bytes, settings.max_memory));
    ASSIGN_OR_RETURN(auto stored, io::read_frame(header.files, header.match.roles, {Role::color},
                                                 io::Keep::nothing));
    const io::ExrPart& part = color_part(header);
    ColorFile color{std::move(stored.planes.at(Role::color)), stored.window, part.display_window,
                    io::luma_weights(part.chromaticities), header.match.profile};
    if (header.match.options.unpremultiplied) {
        ImageF& rgba = color.rgba;
        for (size_t i = 0; i < rgba.pixels(); ++i)
            for (size_t c = 0; c < 3; ++c) rgba.data[4 * i + c] *= rgba.data[4 * i + 3];
    }
    return color;
}

}  // namespace postchain::sequence

#include "tools/sequence/source/camera_motion.h"

#include <filesystem>
#include <string_view>

namespace postchain::sequence {
namespace {

// Camera of frame `number` of the same sequence, read from its color file.
std::optional<io::CameraMetadata> metadata_of_frame(const SourceSettings& settings, int part,
                                                    int number) {
    if (!settings.color_frames || !settings.color_frames->has_token()) return std::nullopt;
    const std::string path = settings.color_frames->format(number);
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return std::nullopt;
    const auto file = io::open_pixels(path);
    if (!file.ok() || size_t(part) >= (*file)->parts().size()) return std::nullopt;
    return io::camera_metadata((*file)->parts()[size_t(part)]);
}

// The sky's vectors are made from the frames' metadata too.
bool fills_sky(CameraMotion wanted) {
    return wanted == CameraMotion::sky || wanted == CameraMotion::zoom;
}

void find_views(const SourceSettings& settings, const io::CameraMetadata& metadata, int frame,
                const Display& display, FrameHeader& header) {
    const CameraMotion wanted = settings.camera_motion;
    if (wanted == CameraMotion::none) return;
    const CameraFile* file = settings.camera ? &*settings.camera : nullptr;
    const bool has_motion = header.assignment.contains(Role::motion);
    const bool has_depth = header.assignment.contains(Role::inverse_depth);
    const bool in_file = file && file->rotations.contains(frame);
    const bool makes_all = has_depth && (wanted == CameraMotion::all || !has_motion);
    if (!in_file && (!metadata.pose || (!makes_all && !fills_sky(wanted)))) return;
    const int part = header.assignment.at(Role::color).part;
    header.looked_for_cameras = !in_file;
    header.sky = sky_views(
        file,
        [&](int number) -> std::optional<io::CameraMetadata> {
            if (number == frame) return metadata;
            return metadata_of_frame(settings, part, number);
        },
        frame, display, settings.cuts);
    header.makes_motion = header.sky && makes_all && header.sky->have_places();
    header.sky_is_still = header.sky && !header.sky->turns();
    if (header.sky && !header.makes_motion && (!has_motion || header.sky_is_still))
        header.sky.reset();
}

// The file says that Cycles rendered it.
bool is_from_cycles(const io::ExrPart& part) {
    const auto found = part.attributes.lower_bound("cycles.");
    return found != part.attributes.end() && found->first.starts_with("cycles.");
}

// Cycles computes both positions of a motion vector with the focal length of the frame
// (Camera::device_update: "Support perspective (zoom, fov) motion" is open).
void find_zoom(const SourceSettings& settings, const io::CameraMetadata& metadata, int frame,
               const Display& display, FrameHeader& header) {
    const CameraMotion wanted = settings.camera_motion;
    if (header.makes_motion || wanted == CameraMotion::none ||
        !header.assignment.contains(Role::motion))
        return;
    const bool zooms = settings.camera && settings.camera->zooms();
    if (zooms && (wanted == CameraMotion::zoom || is_from_cycles(color_part(header))))
        header.zoom = zoom_of(*settings.camera, metadata.camera, frame, display, settings.cuts);
    if (wanted == CameraMotion::zoom && !zooms)
        header.warnings.push_back(
            concat(header.files.color_file().path(),
                   ": --camera-motion zoom adds no zoom: no camera file states focal_length_mm "
                   "frame by frame; add it under `frames`, or use --camera-motion sky"));
}

// Why a camera matrix is available but yields no motion vectors: "worldToCamera (singular)". Empty
// if there is no matrix or it does yield them.
std::string why_no_camera_motion(const SourceSettings& settings, const io::CameraMetadata& metadata,
                                 int frame, const FrameHeader& header) {
    if (header.makes_motion || settings.camera_motion == CameraMotion::none) return "";
    std::string matrix;
    if (settings.camera && settings.camera->rotations.contains(frame)) {
        matrix = "camera_matrix_world of the camera file";
        if (!settings.camera->places.contains(frame))
            return matrix + " (no position: rows of three numbers)";
    } else {
        std::string unused;
        for (const io::FoundAttribute& found : metadata.found)
            if (found.row->gives == std::string_view("camera matrix")) {
                if (found.gives.empty())
                    unused +=
                        concat(unused.empty() ? "" : ", ", found.row->name, " (", found.why, ")");
                else if (matrix.empty())
                    matrix = found.row->name;
            }
        if (matrix.empty()) return unused;
    }
    if (!header.assignment.contains(Role::inverse_depth)) return matrix + " (no depth)";
    const bool focal = (metadata.pose && metadata.pose->focal_widths) ||
                       (header.camera.focal_length_mm && header.camera.sensor_width_mm);
    return matrix + (focal ? " (neither the frame before nor the one after has one)"
                           : " (unknown focal length: set focal_length_mm and sensor_width_mm)");
}

}  // namespace

void find_camera_motion(const SourceSettings& settings, const io::CameraMetadata& metadata,
                        int frame, const Display& display, FrameHeader& header) {
    find_views(settings, metadata, frame, display, header);
    find_zoom(settings, metadata, frame, display, header);
    if (const std::string why = why_no_camera_motion(settings, metadata, frame, header);
        !why.empty()) {
        if (const auto looked_for = header.match.missing.find(Role::motion);
            looked_for != header.match.missing.end())
            looked_for->second +=
                ", or made from the camera matrix, which was found but not used: " + why;
        else if (settings.camera_motion == CameraMotion::all)
            header.warnings.push_back(
                concat(header.files.color_file().path(),
                       ": motion vectors are the file's own; the camera matrix was found "
                       "but not used: ",
                       why));
        return;
    }
    const CameraMotion wanted = settings.camera_motion;
    const bool asked = wanted == CameraMotion::all || wanted == CameraMotion::sky;
    if (asked && !header.makes_motion && !header.sky && !metadata.pose &&
        !(settings.camera && settings.camera->rotations.contains(frame)) &&
        header.assignment.contains(Role::motion))
        header.warnings.push_back(concat(
            header.files.color_file().path(), ": --camera-motion ",
            wanted == CameraMotion::all ? "all" : "sky",
            " has no effect: neither the camera file nor the metadata has a camera matrix of "
            "this frame; add camera_matrix_world to the camera file, or leave it out"));
}

}  // namespace postchain::sequence

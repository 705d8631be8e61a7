#include "tools/sequence/source/frame_header.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>

#include "tools/sequence/exr/exr_settings.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::sequence {

std::string names_in(const io::PixelFile& file) {
    constexpr size_t kShown = 40;
    std::string text;
    size_t count = 0;
    for (const auto& part : file.parts())
        for (const auto& channel : part.channels)
            if (count++ < kShown) text += " " + channel.name;
    return count > kShown ? concat(text, " and ", count - kShown, " more") : text;
}

namespace {

// Profile of the files: the one named, otherwise the one detected from all their channels.
struct Writer {
    Profile profile;
    bool detected = false;
    std::string why = "named";

    bool is_named_or_any() const { return !detected || profile.detect_channels.empty(); }
};

Result<Writer> writer_of(const SourceSettings& settings, const io::FrameFiles& files) {
    if (settings.profile) return Writer{.profile = *settings.profile};
    FileChannels all = io::channels_of(files.color_file());
    std::set<const io::PixelFile*> seen = {&files.color_file()};
    for (const auto& [role, file] : files.files) {
        if (!seen.insert(file.get()).second) continue;
        const FileChannels more = io::channels_of(*file);
        all.parts.insert(all.parts.end(), more.parts.begin(), more.parts.end());
    }
    ASSIGN_OR_RETURN(auto match,
                     detect_profile(builtin_profiles(), all, settings.view_layer, settings.view));
    for (const Profile& profile : builtin_profiles())
        if (profile.name == match.profile) return Writer{profile, true, match.why};
    return Status(StatusCode::internal, "a detected profile is not among those detected from");
}

// A file is read by the profile detected from it, otherwise by the one of all files.
Result<ProfileMatch> match_file(const SourceSettings& settings, const Writer& writer,
                                const io::PixelFile& file) {
    const FileChannels channels = io::channels_of(file);
    if (!settings.profile) {
        auto own = detect_profile(builtin_profiles(), channels, settings.view_layer, settings.view);
        if (own.ok())
            for (const Profile& profile : builtin_profiles())
                if (profile.name == own->profile && !profile.detect_channels.empty()) return own;
    }
    auto match = match_profile(writer.profile, channels, settings.view_layer, settings.view);
    if (!match.ok()) return match;
    match->detected = writer.detected;
    match->why = writer.why;
    return match;
}

// Channels of a file with a single plane and no known names: one channel is depth, the usual pairs
// are motion.
std::optional<RoleChannels> plain_channels(const io::PixelFile& file, Role role) {
    static const std::vector<std::vector<std::string>> known = {
        {"Z"}, {"Y"}, {"R"}, {"R", "G"}, {"X", "Y"}, {"U", "V"}, {"u", "v"}};
    const size_t needed = size_t(channels_of(role));
    const FileChannels channels = io::channels_of(file);
    for (size_t part = 0; part < channels.parts.size(); ++part) {
        const auto& names = channels.parts[part].channels;
        if (names.size() == needed && needed == 1) return RoleChannels{int(part), names};
        for (const auto& candidate : known) {
            bool all = candidate.size() == needed;
            for (const auto& name : candidate)
                all = all && std::find(names.begin(), names.end(), name) != names.end();
            if (all) return RoleChannels{int(part), candidate};
        }
    }
    return std::nullopt;
}

void take_role(Role role, const ProfileMatch& from, ProfileMatch& match) {
    match.roles[role] = from.roles.at(role);
    if (role == Role::inverse_depth) match.options.depth = from.options.depth;
    if (role == Role::motion) match.options.motion = from.options.motion;
    if (role == Role::motion_back) match.options.motion_back = from.options.motion_back;
    match.missing.erase(role);
}

// Merges a separate depth or motion file into the match of color's file. Channels that the profile
// does not name are read by its first convention if the profile was named or is generic; otherwise
// they may belong to another writer. Returns the match of the file, if it has the role.
Result<std::optional<ProfileMatch>> add_own_file(const SourceSettings& settings,
                                                 const Writer& writer, const io::PixelFile& file,
                                                 Role role, ProfileMatch& match) {
    auto own = match_file(settings, writer, file);
    if (own.ok() && own->roles.count(role)) {
        if (!own->view.empty() && own->view != match.view)
            return Status(StatusCode::input, concat(file.path(), ": has no view ", match.view,
                                                    "; filter one after the other (",
                                                    setting("view", own->view), ")"));
        take_role(role, *own, match);
        return std::optional<ProfileMatch>(std::move(*own));
    }
    if (auto plain = plain_channels(file, role)) {
        if (!writer.is_named_or_any())
            return Status(StatusCode::input,
                          concat(file.path(), ": ", name_of(role), " has channels", names_in(file),
                                 ", which do not belong to ", writer.profile.title,
                                 " (detected: ", writer.why,
                                 "); use {profile} to state how they are stored"_keyed));
        match.roles[role] = *plain;
        const auto sources = writer.profile.roles.find(role);
        if (sources != writer.profile.roles.end() && !sources->second.empty()) {
            const auto& first = sources->second.front();
            if (role == Role::inverse_depth) match.options.depth = first.depth;
            if (role == Role::motion) match.options.motion = first.motion;
            if (role == Role::motion_back) match.options.motion_back = first.motion;
        }
    } else if (own.status().code() == StatusCode::usage) {  // a view or view layer that it lacks
        return own.status().at(file.path());
    } else {
        return Status(StatusCode::input,
                      concat(file.path(), ": no ", name_of(role), " channels found among",
                             names_in(file), "; name them in a profile"));
    }
    match.missing.erase(role);
    return std::optional<ProfileMatch>();
}

const Profile& profile_of(const SourceSettings& settings, const Writer& writer,
                          const ProfileMatch& match) {
    if (!settings.profile)
        for (const Profile& profile : builtin_profiles())
            if (profile.name == match.profile) return profile;
    return writer.profile;
}

// Finds the channels of every role in the frame's files. Returns the profile of color's.
Result<Profile> match_channels(const SourceSettings& settings, FrameHeader& header) {
    const io::PixelFile& color_file = header.files.color_file();
    auto writer = writer_of(settings, header.files);
    if (!writer.ok()) {
        RETURN_IF_ERROR(color_file.explain_no_color());
        return writer.status().at(color_file.path());
    }
    auto match = match_file(settings, *writer, color_file);
    if (!match.ok() || !match->roles.count(Role::color)) {
        RETURN_IF_ERROR(color_file.explain_no_color());
        if (!match.ok()) return match.status().at(color_file.path());
        return Status(
            StatusCode::input,
            concat(color_file.path(), ": no color; profile ", match->profile, " looks for ",
                   match->missing[Role::color], "; found:", names_in(color_file)));
    }
    header.match = std::move(*match);
    header.match.options.nonfinite_color = settings.nonfinite_color;
    std::map<Role, std::shared_ptr<io::PixelFile>> more;
    for (const auto& [role, file] : header.files.files) {
        if (role == Role::color) continue;
        ASSIGN_OR_RETURN(const auto own,
                         add_own_file(settings, *writer, *file, role, header.match));
        // A file of motion vectors has both directions. Color's file may have vectors too, but in
        // another convention.
        if (role != Role::motion || !own || !own->roles.count(Role::motion_back) ||
            header.files.files.contains(Role::motion_back))
            continue;
        take_role(Role::motion_back, *own, header.match);
        more[Role::motion_back] = file;
    }
    header.files.files.merge(more);
    if (const io::ImageFile* picture = picture_of(color_file))
        header.match.options.unpremultiplied = picture->info().unassociated;
    return profile_of(settings, *writer, header.match);
}

// Motion vectors to or from a frame of another shot mean nothing: those on the frame's other side
// are used in their place.
void keep_motion_of_shot(bool cut_before, bool cut_after, FrameHeader& header) {
    auto& roles = header.match.roles;
    if (cut_before) roles.erase(Role::motion_back);
    if (!cut_after || !roles.contains(Role::motion)) return;
    const auto back = roles.find(Role::motion_back);
    header.motion_crosses_cut = back == roles.end();
    if (header.motion_crosses_cut) return;
    roles[Role::motion] = back->second;
    auto& files = header.files.files;
    if (const auto file = files.find(Role::motion_back); file != files.end())
        files[Role::motion] = file->second;
    else
        files.erase(Role::motion);
    header.match.options.motion = header.match.options.motion_back;
    roles.erase(back);
}

// How color's part, which is deep, is flattened: by the channels of this profile.
Status set_flattening(const Profile& profile, FrameHeader& header) {
    io::PixelFile& file = header.files.color_file();
    const RoleChannels& color = color_channels(header);
    io::Flattening& flattening = file.flattening;
    if (color.channels.size() == 4) flattening.alpha = color.channels[3];
    const auto depth = header.match.roles.find(Role::inverse_depth);
    const bool own = depth != header.match.roles.end() && depth->second.part == color.part &&
                     !header.files.files.contains(Role::inverse_depth);
    if (own) {
        const DepthEncoding encoding = header.match.options.depth;
        if (encoding == DepthEncoding::inverse || encoding == DepthEncoding::reverse ||
            encoding == DepthEncoding::reverse_infinite)
            return Status(StatusCode::input,
                          concat(file.path(), ": is deep, and its depth decreases with distance (",
                                 "profile ", profile.name,
                                 "); deep samples are sorted by a depth that increases: write the "
                                 "distance, or use a profile that says so ({profile})"_keyed));
        flattening.depth = depth->second.channels[0];
    }
    std::set<std::string> names(color.channels.begin(), color.channels.end());
    for (const FileLayer& layer :
         find_layers(io::channels_of(file), header.match, data_names(profile)))
        if (layer.is_color() && layer.channels.part == color.part)
            names.insert(layer.channels.channels.begin(), layer.channels.channels.end());
    flattening.color = std::move(names);
    return Status();
}

// Planes of several files or parts cover each other pixel by pixel only if one display window holds
// them all. Another pixel aspect is a warning: not every format has one.
Status check_displays(FrameHeader& header) {
    const io::ExrPart& color = color_part(header);
    const std::string path = color_path(header);
    for (const auto& [role, where] : header.match.roles) {
        const io::PixelFile& file = header.files.file_of(role);
        const io::ExrPart& part = file.parts()[size_t(where.part)];
        if (part.display_window != color.display_window)
            return Status(StatusCode::input,
                          concat(file.path(), ": ", name_of(role), " has display window ",
                                 part.display_window.text(), ", color (", path, ") ",
                                 color.display_window.text(), "; render both at one size"));
        if (part.pixel_aspect != color.pixel_aspect)
            header.warnings.push_back(concat(file.path(), ": ", name_of(role), " has pixel aspect ",
                                             part.pixel_aspect, ", color (", path, ") ",
                                             color.pixel_aspect, ", which is used"));
    }
    return Status();
}

// DWA packs channels by their names, .R and .Y among them, as colors. PXR24's steps of 2^-16 show
// in neither plane.
void warn_of_loss(FrameHeader& header) {
    for (const auto& [role, where] : header.match.roles) {
        if (role == Role::color) continue;
        const io::PixelFile& file = header.files.file_of(role);
        const io::ExrPart& part = file.parts()[size_t(where.part)];
        const auto compression = io::ExrCompression::parse(part.compression);
        if (!compression.ok() || compression->method == io::ExrMethod::pxr24) continue;
        std::string lossy;
        for (const auto& channel : part.channels)
            if (std::ranges::find(where.channels, channel.name) != where.channels.end() &&
                compression->changes(channel))
                lossy += " " + channel.name;
        if (!lossy.empty())
            header.warnings.push_back(concat(file.path(), ": ", name_of(role),
                                             " is stored with loss (", part.compression, ":", lossy,
                                             "); write depth and motion vectors as zip"));
    }
}

void set_window(DataWindow choice, FrameHeader& header) {
    const io::ExrPart& part = color_part(header);
    header.window = part.data_window;
    if (choice == DataWindow::keep) return;
    const io::Window whole = part.data_window.united(part.display_window);
    if (fits(whole))
        header.window = whole;
    else
        header.warnings.push_back(concat(color_path(header), ": the display window ",
                                         part.display_window.text(),
                                         " is too large to filter (at most ", io::kMaxSide,
                                         " pixels a side): light that leaves the data window ",
                                         part.data_window.text(), " is lost"));
}

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
    const bool has_motion = header.match.roles.contains(Role::motion);
    const bool has_depth = header.match.roles.contains(Role::inverse_depth);
    const bool in_file = file && file->rotations.contains(frame);
    const bool makes_all = has_depth && (wanted == CameraMotion::all || !has_motion);
    if (!in_file && (!metadata.pose || (!makes_all && !fills_sky(wanted)))) return;
    const int part = color_channels(header).part;
    header.looked_for_cameras = !in_file;
    header.sky = sky_views(
        file,
        [&](int number) -> std::optional<io::CameraMetadata> {
            if (number == frame) return metadata;
            return metadata_of_frame(settings, part, number);
        },
        frame, display, settings.cuts);
    header.makes_motion = header.sky && makes_all && header.sky->have_positions();
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
        !header.match.roles.contains(Role::motion))
        return;
    const bool zooms = settings.camera && settings.camera->zooms();
    if (zooms && (wanted == CameraMotion::zoom || is_from_cycles(color_part(header))))
        header.zoom = zoom_of(*settings.camera, metadata.camera, frame, display, settings.cuts);
    if (wanted == CameraMotion::zoom && !zooms)
        header.warnings.push_back(
            concat(color_path(header),
                   ": {camera_motion=zoom} adds no zoom: no camera file states focal_length_mm "
                   "frame by frame; add it under `frames`, or use {camera_motion=sky}"_keyed));
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
    if (!header.match.roles.contains(Role::inverse_depth)) return matrix + " (no depth)";
    const bool focal = (metadata.pose && metadata.pose->focal_widths) ||
                       (header.camera.focal_length_mm && header.camera.sensor_width_mm);
    return matrix + (focal ? " (neither the frame before nor the one after has one)"
                           : " (unknown focal length: set focal_length_mm and sensor_width_mm)");
}

// Sets `sky`, `sky_is_still`, `makes_motion` and `looked_for_cameras` of a header whose roles and
// camera are known. If a matrix exists but gives no vectors, the reason is added to the names that
// were looked for, or, if the file has vectors and CameraMotion::all was asked for, to the
// warnings.
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
                concat(color_path(header),
                       ": motion vectors are the file's own; the camera matrix was found "
                       "but not used: ",
                       why));
        return;
    }
    const CameraMotion wanted = settings.camera_motion;
    const bool asked = wanted == CameraMotion::all || wanted == CameraMotion::sky;
    if (asked && !header.makes_motion && !header.sky && !metadata.pose &&
        !(settings.camera && settings.camera->rotations.contains(frame)) &&
        header.match.roles.contains(Role::motion))
        header.warnings.push_back(concat(
            color_path(header), ": {camera_motion="_keyed,
            wanted == CameraMotion::all ? "all" : "sky",
            "} has no effect: neither the camera file nor the metadata has a camera matrix of "
            "this frame; add camera_matrix_world to the camera file, or leave it out"_keyed));
}

// The camera of the file's metadata, overridden by the camera file, and the motion made from it.
void set_camera(const SourceSettings& settings, FrameHeader& header) {
    const io::ExrPart& part = color_part(header);
    const int frame = header.files.frame_number;
    const Display display{part.display_window.width(), part.display_window.height(),
                          double(part.pixel_aspect)};
    const CameraFile* camera = settings.camera ? &*settings.camera : nullptr;
    io::CameraMetadata metadata = io::camera_metadata(part);
    header.camera = frame_camera(metadata.camera, camera, frame, display);
    header.camera_origins = metadata.origins;
    if (camera) {
        for (auto& [key, origin] : camera->origins_for(frame))
            header.camera_origins[key] = std::move(origin);
        if (auto warning = camera->check_resolution(display))
            header.warnings.push_back(warning->text());
    }
    find_camera_motion(settings, metadata, frame, display, header);
    if (header.makes_motion) header.motion_crosses_cut = false;
    header.camera_attributes = std::move(metadata.found);
}

}  // namespace

// 64-bit arithmetic, because a header may state any window.
bool fits(const io::Window& w) {
    return int64_t(w.max_x) - w.min_x < io::kMaxSide && int64_t(w.max_y) - w.min_y < io::kMaxSide;
}

const RoleChannels& color_channels(const FrameHeader& header) {
    return header.match.roles.at(Role::color);
}

const io::ExrPart& color_part(const FrameHeader& header) {
    return header.files.color_file().parts()[size_t(color_channels(header).part)];
}

std::string color_path(const FrameHeader& header) {
    return header.files.color_file().path();
}

FrameDescription describe(const FrameHeader& header) {
    const io::ExrPart& part = color_part(header);
    const io::Window &window = header.window, &display = part.display_window;
    FrameDescription frame;
    frame.width = window.width();
    frame.height = window.height();
    frame.display_width = display.width();
    frame.display_height = display.height();
    frame.origin_x = window.min_x - display.min_x;
    frame.origin_y = window.min_y - display.min_y;
    frame.pixel_aspect = double(part.pixel_aspect);
    frame.frame_number = header.files.frame_number;
    frame.luma_weights = io::luma_weights(part.chromaticities);
    frame.camera = header.camera;
    frame.bounds.camera_cut = header.motion_crosses_cut;
    return frame;
}

RoleSet roles_in_files(const FrameHeader& header) {
    RoleSet roles;
    for (const auto& [role, where] : header.match.roles) roles.add(role);
    if (header.layers.any_filtered()) roles.add(Role::layers);
    if (!header.layers.mattes.empty()) roles.add(Role::mattes);
    if (header.has_behind) roles.add(Role::behind);
    if (header.makes_motion) roles = roles | RoleSet{Role::motion, Role::motion_back};
    return roles;
}

Result<FrameHeader> open_source_frame(const SourceSettings& settings,
                                      const std::map<Role, std::string>& files, int frame) {
    if (settings.view == kAllViews && !settings.all_views)
        return Status(StatusCode::usage,
                      "{view=all}: only run filters all views of a file; choose one"_keyed);
    // The layer behind is a frame of its own (neighbor_planes.h).
    std::map<Role, std::string> own = files;
    const bool has_behind = own.erase(Role::behind) > 0;
    ASSIGN_OR_RETURN(auto opened, io::open_frame(own, frame, {}, settings.input_transfer));
    auto header = header_of(settings, std::move(opened));
    if (header.ok() && has_behind) header->has_behind = true;
    return header;
}

Result<FrameHeader> header_of(const SourceSettings& settings, io::FrameFiles files) {
    FrameHeader header;
    header.files = std::move(files);
    for (const auto& [role, file] : header.files.files) file->flattening.behind = settings.behind;
    ASSIGN_OR_RETURN(const Profile profile, match_channels(settings, header));
    // Vectors are no layers, even those across a cut.
    ASSIGN_OR_RETURN(header.layers, find_frame_layers(settings.layers, data_names(profile),
                                                      header.files.color_file(), header.match));
    header.warnings = header.layers.warnings;
    if (color_part(header).deep) {
        RETURN_IF_ERROR(set_flattening(profile, header));
        header.has_behind = !settings.behind;
    }
    const int frame = header.files.frame_number;
    keep_motion_of_shot(settings.cuts.contains(frame - 1), settings.cuts.contains(frame), header);
    RETURN_IF_ERROR(check_displays(header));
    warn_of_loss(header);
    set_window(settings.data_window, header);
    set_camera(settings, header);
    return header;
}

}  // namespace postchain::sequence

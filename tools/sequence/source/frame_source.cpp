#include "tools/sequence/source/frame_source.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "chain/depth_at.h"
#include "chain/matte.h"
#include "config/profile_match.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/source/camera_motion.h"
#include "tools/sequence/source/memory.h"
#include "tools/sequence/source/source_strip.h"

namespace postchain::sequence {
namespace {

// Profile of the files: the one named, otherwise the one detected from all their channels.
struct Writer {
    Profile profile;
    bool detected = false;
    std::string why = "named";

    bool is_named_or_any() const { return !detected || profile.detect_channels.empty(); }
};

Result<Writer> writer_of(const SourceSettings& settings, const io::OpenFrame& files) {
    if (settings.profile) return Writer{.profile = *settings.profile};
    FileChannels all = io::channels_of(files.color_file());
    std::set<const io::PixelFile*> seen = {&files.color_file()};
    for (const auto& [role, file] : files.files) {
        if (!seen.insert(file.get()).second) continue;
        const FileChannels more = io::channels_of(*file);
        all.parts.insert(all.parts.end(), more.parts.begin(), more.parts.end());
    }
    ASSIGN_OR_RETURN(auto match,
                     detect_profile(builtin_profiles(), all, settings.layer, settings.view));
    for (const Profile& profile : builtin_profiles())
        if (profile.name == match.profile) return Writer{profile, true, match.why};
    return Status(StatusCode::internal, "a detected profile is not among those detected from");
}

// A file is read by the profile detected from it, otherwise by the one of all files.
Result<ProfileMatch> match_file(const SourceSettings& settings, const Writer& writer,
                                const io::PixelFile& file) {
    const FileChannels channels = io::channels_of(file);
    if (!settings.profile) {
        auto own = detect_profile(builtin_profiles(), channels, settings.layer, settings.view);
        if (own.ok())
            for (const Profile& profile : builtin_profiles())
                if (profile.name == own->profile && !profile.detect_channels.empty()) return own;
    }
    auto match = match_profile(writer.profile, channels, settings.layer, settings.view);
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

// " R G B Z", for messages.
std::string names_in(const io::PixelFile& file) {
    constexpr size_t kShown = 40;
    std::string text;
    size_t count = 0;
    for (const auto& part : file.parts())
        for (const auto& channel : part.channels)
            if (count++ < kShown) text += " " + channel.name;
    return count > kShown ? concat(text, " and ", count - kShown, " more") : text;
}

// Merges a separate depth or motion file into the match of color's file. Channels that the profile
// does not name are read by its first convention if the profile was named or is generic; otherwise
// they may belong to another writer.
Status add_own_file(const SourceSettings& settings, const Writer& writer, const io::PixelFile& file,
                    Role role, ProfileMatch& match) {
    auto own = match_file(settings, writer, file);
    if (own.ok() && own->roles.count(role)) {
        if (!own->view.empty() && own->view != match.view)
            return Status(StatusCode::input,
                          concat(file.path(), ": has no view ", match.view,
                                 "; filter one after the other (--view ", own->view, ")"));
        match.roles[role] = own->roles.at(role);
        if (role == Role::inverse_depth) match.options.depth = own->options.depth;
        if (role == Role::motion) match.options.motion = own->options.motion;
        if (role == Role::motion_back) match.options.motion_back = own->options.motion_back;
    } else if (auto plain = plain_channels(file, role)) {
        if (!writer.is_named_or_any())
            return Status(StatusCode::input,
                          concat(file.path(), ": ", name_of(role), " has channels", names_in(file),
                                 ", which do not belong to ", writer.profile.title, " (detected: ",
                                 writer.why, "); use --profile to state how they are stored"));
        match.roles[role] = *plain;
        const auto sources = writer.profile.roles.find(role);
        if (sources != writer.profile.roles.end() && !sources->second.empty()) {
            const auto& first = sources->second.front();
            if (role == Role::inverse_depth) match.options.depth = first.depth;
            if (role == Role::motion) match.options.motion = first.motion;
            if (role == Role::motion_back) match.options.motion_back = first.motion;
        }
    } else {
        return Status(StatusCode::input, concat(file.path(), ": no ", name_of(role),
                                                " channels found among", names_in(file)));
    }
    match.missing.erase(role);
    return Status();
}

// Motion vectors to or from a frame of another shot mean nothing: those on the frame's other side
// are used in their place.
void keep_motion_of_shot(bool cut_before, bool cut_after, FrameHeader& header) {
    auto& assignment = header.assignment;
    if (cut_before) assignment.erase(Role::motion_back);
    if (!cut_after || !assignment.contains(Role::motion)) return;
    const auto back = assignment.find(Role::motion_back);
    header.motion_crosses_cut = back == assignment.end();
    if (header.motion_crosses_cut) return;
    assignment[Role::motion] = back->second;
    header.match.options.motion = header.match.options.motion_back;
    assignment.erase(back);
}

const Profile& profile_of(const SourceSettings& settings, const Writer& writer,
                          const ProfileMatch& match) {
    if (!settings.profile)
        for (const Profile& profile : builtin_profiles())
            if (profile.name == match.profile) return profile;
    return writer.profile;
}

// How color's part, which is deep, is flattened: by the channels of this profile.
Status set_flattening(const Profile& profile, FrameHeader& header) {
    io::PixelFile& file = header.files.color_file();
    const RoleChannels& color = header.match.roles.at(Role::color);
    io::Flattening& flattening = file.flattening;
    if (color.channels.size() == 4) flattening.alpha = color.channels[3];
    const auto depth = header.assignment.find(Role::inverse_depth);
    const bool own = depth != header.assignment.end() && depth->second.part == color.part &&
                     !header.files.files.contains(Role::inverse_depth);
    if (own) {
        const DepthEncoding encoding = header.match.options.depth;
        if (encoding == DepthEncoding::inverse || encoding == DepthEncoding::reverse ||
            encoding == DepthEncoding::reverse_infinite)
            return Status(StatusCode::input,
                          concat(file.path(), ": is deep, and its depth decreases with distance (",
                                 "profile ", profile.name,
                                 "); deep samples are sorted by a depth that increases: write the "
                                 "distance, or use a profile that says so (--profile)"));
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
    const std::string path = header.files.color_file().path();
    for (const auto& [role, where] : header.assignment) {
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

}  // namespace

// 64-bit arithmetic, because a header may state any window.
bool fits(const io::Window& w) {
    return int64_t(w.max_x) - w.min_x < io::kMaxSide && int64_t(w.max_y) - w.min_y < io::kMaxSide;
}

const io::ExrPart& color_part(const FrameHeader& header) {
    return header.files.color_file().parts()[size_t(header.assignment.at(Role::color).part)];
}

RoleSet roles_in_files(const FrameHeader& header) {
    RoleSet roles;
    for (const auto& [role, where] : header.assignment) roles.add(role);
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
                      "--view all: only run filters all views of a file; choose one");
    // The layer behind is a frame of its own (behind_planes.h).
    std::map<Role, std::string> own = files;
    const bool has_behind = own.erase(Role::behind) > 0;
    ASSIGN_OR_RETURN(auto opened, io::open_frame(own, frame, {}, settings.input_transfer));
    auto header = header_of(settings, std::move(opened));
    if (header.ok() && has_behind) header->has_behind = true;
    return header;
}

Result<FrameHeader> header_of(const SourceSettings& settings, io::OpenFrame files) {
    const int frame = files.frame_number;
    FrameHeader header;
    header.files = std::move(files);
    for (const auto& [role, file] : header.files.files) file->flattening.behind = settings.behind;
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
        return Status(StatusCode::input, concat(color_file.path(), ": no color; looked for ",
                                                match->missing[Role::color], "\n", match->text()));
    }
    header.match = std::move(*match);
    for (const auto& [role, file] : header.files.files) {
        if (role == Role::color) continue;
        RETURN_IF_ERROR(add_own_file(settings, *writer, *file, role, header.match));
    }
    if (const io::ImageFile* picture = picture_of(color_file))
        header.match.options.unpremultiplied = picture->info().unassociated;
    for (const auto& [role, where] : header.match.roles)
        header.assignment[role] = {where.part, where.channels};
    keep_motion_of_shot(settings.cuts.contains(frame - 1), settings.cuts.contains(frame), header);

    ASSIGN_OR_RETURN(
        header.layers,
        find_frame_layers(settings.layers, data_names(profile_of(settings, *writer, header.match)),
                          color_file, header.match));
    header.warnings = header.layers.warnings;

    RETURN_IF_ERROR(check_displays(header));
    const auto& part = color_part(header);
    if (part.deep) {
        RETURN_IF_ERROR(set_flattening(profile_of(settings, *writer, header.match), header));
        header.has_behind = !settings.behind;
    }
    header.window = part.data_window;
    if (settings.data_window == DataWindow::grow) {
        const io::Window whole = part.data_window.united(part.display_window);
        if (fits(whole))
            header.window = whole;
        else
            header.warnings.push_back(concat(color_file.path(), ": the display window ",
                                             part.display_window.text(),
                                             " is too large to filter (at most ", io::kMaxSide,
                                             " pixels a side): light that leaves the data window ",
                                             part.data_window.text(), " is lost"));
    }
    const Display display{part.display_window.width(), part.display_window.height(),
                          double(part.pixel_aspect)};
    const CameraFile* camera = settings.camera ? &*settings.camera : nullptr;
    io::CameraMetadata metadata = io::camera_metadata(part);
    header.camera = frame_camera(metadata.camera, camera, frame, display);
    header.camera_origins = metadata.origins;
    if (camera)
        for (auto& [key, origin] : camera->origins_for(frame))
            header.camera_origins[key] = std::move(origin);
    if (camera)
        if (auto warning = camera->check_resolution(display))
            header.warnings.push_back(warning->text());
    find_camera_motion(settings, metadata, frame, display, header);
    if (header.makes_motion) header.motion_crosses_cut = false;
    header.camera_attributes = std::move(metadata.found);
    return header;
}

RoleSet planes_needed(const Chain& chain, const SourceSettings& settings, const FrameHeader& header,
                      const PlanOptions& options) {
    const auto& part = color_part(header);
    FrameDescription frame;
    frame.width = header.window.width();
    frame.height = header.window.height();
    frame.display_width = part.display_window.width();
    frame.display_height = part.display_window.height();
    frame.pixel_aspect = double(part.pixel_aspect);
    frame.origin_x = header.window.min_x - part.display_window.min_x;
    frame.origin_y = header.window.min_y - part.display_window.min_y;
    frame.frame_number = header.files.frame_number;
    frame.camera = header.camera;
    // Which planes are read does not depend on depth.
    for (const auto& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = 0;
    frame.bounds.camera_cut = header.motion_crosses_cut;
    frame.mattes = matte_indices(chain, settings.layers.mattes);
    RoleSet own = roles_in_files(header);
    // Cryptomattes are filtered as layers too, in chunks.
    frame.layers = std::max(int(header.layers.filtered.size()), int(own.has(Role::layers)));
    if (mattes_of(chain).empty()) own.remove(Role::mattes);
    const RoleSet usable = chain.required() | chain.optional();
    bool planned = false;
    const auto read_with = [&](const std::vector<Neighbor>& neighbors) {
        frame.planes = own;
        for (Neighbor neighbor : neighbors)
            for (Role role : kNeighborRoles)
                if (own.has(role) && usable.has(is_stacked(role) ? role_of(neighbor, Role::color)
                                                                 : role_of(neighbor, role)))
                    frame.planes.add(role_of(neighbor, role));
        const auto plan = make_plan(chain, frame, options);
        if (!plan.ok()) return RoleSet();
        planned = true;
        return plan->reads;
    };
    RoleSet all = read_with({});
    if (!usable.of(Neighbor::before).empty() || !usable.of(Neighbor::after).empty()) {
        all = all | read_with({Neighbor::before}) | read_with({Neighbor::after}) |
              read_with({Neighbor::before, Neighbor::after});
    }
    // If a pass reads the depth at a place, planning needs it.
    if (!frame.bounds.inverse_depth_at.empty()) all.add(Role::inverse_depth);
    return planned ? all : usable;
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
    RETURN_IF_ERROR(check_memory(header.files.color_file().path(),
                                 frame_bytes(header, present, keep, header.window.height()),
                                 settings.max_memory));
    ASSIGN_OR_RETURN(auto strip,
                     read_source_strip(settings, header, present, keep, 0, header.window.height()));
    SourceFrame frame;
    frame.read_ms = strip.read_ms;
    frame.convert_ms = strip.convert_ms;
    frame.planes = shared(std::move(strip.planes));
    conclude(frame, settings, std::move(header), std::move(strip));
    return frame;
}

std::string SourceFrame::first_nonfinite_text() const {
    const auto& first = health.first_nonfinite;
    return first ? concat("(", (*first)[0], ", ", (*first)[1], ")") : "none";
}

FrameDescription planned_description(const Chain& chain, const SourceFrame& frame) {
    FrameDescription description = frame.description;
    std::vector<std::string> mattes;
    for (const MatteSource& matte : frame.layers.mattes) mattes.push_back(matte.name);
    description.mattes = matte_indices(chain, mattes);
    if (mattes_of(chain).empty())
        for (Role role : {Role::mattes, Role::mattes_before, Role::mattes_after})
            description.planes.remove(role);
    find_depths(chain, frame.planes, description);
    find_speeds(chain, frame.planes, description);
    description.camera = description.camera.overlaid_by(chain.camera);
    return description;
}

Result<Plan> plan_source_frame(const Chain& chain, const SourceFrame& frame,
                               const PlanOptions& options) {
    FrameDescription description = planned_description(chain, frame);
    if (!frame.layers.fill_mask.empty()) description = with_fill_mask(std::move(description));
    auto plan = make_plan(chain, description, options);
    if (plan.ok()) return plan;
    const Status status = plan.status();
    std::string text = frame.input.files.color_file().path() + ": " + status.message();
    if (status.code() == StatusCode::input) {
        for (const auto& [role, names] : frame.match.missing)
            if (chain.required().has(role))
                text += concat("; ", name_of(role), " was looked for as ", names);
        text += "; found were";
        for (const auto& [role, file] : frame.input.files.files) text += names_in(*file);
        text += " (profile " + frame.match.profile + ")";
    }
    return Status(status.code(), text);
}

ImageF stored_color(const io::InputFrame& input) {
    return input.kept->interleaved(input.assignment.at(Role::color).channels, input.window, 4, 1);
}

void to_file_convention(ImageF& color, const ConvertOptions& conversion, const ImageF& stored) {
    if (!conversion.unpremultiplied) return;
    for (size_t pixel = 0; pixel < color.pixels(); ++pixel) {
        float* rgba = color.data.data() + 4 * pixel;
        const float* was = stored.data.data() + 4 * pixel;
        for (int c = 0; c < 3; ++c) {
            if (rgba[3] == was[3] && was[3] != 0 && rgba[c] == was[c] * was[3])
                rgba[c] = was[c];
            else if (rgba[3] != 0)
                rgba[c] /= rgba[3];
            else if (rgba[c] == 0 && was[3] == 0 && std::isfinite(was[c]))
                rgba[c] = was[c];
        }
    }
}

void layer_to_file_convention(ImageF& layer, const ConvertOptions& conversion,
                              const ImageF& color) {
    if (!conversion.unpremultiplied) return;
    for (size_t pixel = 0; pixel < layer.pixels(); ++pixel)
        for (size_t c = 0; c < 3; ++c)
            if (const float alpha = color.data[4 * pixel + 3]; alpha != 0)
                layer.data[4 * pixel + c] /= alpha;
}

}  // namespace postchain::sequence

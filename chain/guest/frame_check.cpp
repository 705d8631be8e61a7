#include "chain/guest/frame_check.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "chain/guest/host_struct.h"

namespace postchain::guest {
namespace {

constexpr int kLastLevel = 30;
constexpr float kMinFStop = 0.01f;  // fifty times as fast as a lens in air can be

// A member of pc_frame, and the texels that the frame's rectangle has in it. `prefix`: of its name,
// "before." of a neighbor's.
struct Member {
    std::string_view prefix;
    const char* member;
    const pc_texture& texture;
    pc_slice slice;
    int width, height;
    HostTexture& checked;

    std::string name() const { return concat(prefix, member); }
};

Failure check_slice(const Member& member) {
    const pc_slice& slice = member.slice;
    const bool array = slice.target == GL_TEXTURE_2D_ARRAY;
    if (!array && slice.target != 0 && slice.target != GL_TEXTURE_2D)
        return {
            PC_ERROR_INPUT,
            concat(member.name(), "_slice.target: 0x", std::hex, slice.target,
                   " is not GL_TEXTURE_2D_ARRAY, GL_TEXTURE_2D or 0, which means GL_TEXTURE_2D")};
    if (slice.layer < 0 || (!array && slice.layer != 0))
        return {PC_ERROR_INPUT,
                concat(member.name(), "_slice.layer: ", slice.layer,
                       array ? " is below 0" : "; set target to GL_TEXTURE_2D_ARRAY too")};
    if (slice.level < 0 || slice.level > kLastLevel)
        return {PC_ERROR_INPUT, concat(member.name(), "_slice.level: ", slice.level,
                                       " is not within 0 and ", kLastLevel)};
    member.checked.array = array;
    member.checked.image = {slice.layer, slice.level};
    return {};
}

// Checks that a texture covers its rectangle and has a format that the member accepts.
Failure check_texture(const Member& member, const HostFormat* (*find)(unsigned)) {
    const pc_texture& given = member.texture;
    HostTexture& texture = member.checked;
    texture = {};
    if (given.name == 0) return {};
    texture.name = given.name;
    texture.width = member.width;
    texture.height = member.height;
    texture.format = find(given.internal_format);
    if (!texture.format)
        return {PC_ERROR_INPUT,
                concat(member.name(), ".internal_format: ", text_of_format(given.internal_format),
                       " is not a sized format of float, normalized or depth values")};
    if (given.width <= 0 || given.height <= 0)
        return {PC_ERROR_INPUT,
                concat(member.name(), ": its size is ", given.width, "x", given.height)};
    if (given.x < 0 || given.y < 0 || given.x > given.width - member.width ||
        given.y > given.height - member.height)
        return {PC_ERROR_INPUT,
                concat(member.name(), ": a frame of ", member.width, "x", member.height, " at ",
                       given.x, ", ", given.y, " is not inside its ", given.width, "x",
                       given.height, " texels")};
    texture.at_origin = given.x == 0 && given.y == 0;
    return check_slice(member);
}

Failure check_numbers(const HostPlanes& frame) {
    const pc_frame& given = *frame.given;
    const struct {
        const char* name;
        float value;
    } all[] = {{"near_clip", given.near_clip},
               {"far_clip", given.far_clip},
               {"motion_scale[0]", given.motion_scale[0]},
               {"motion_scale[1]", given.motion_scale[1]},
               {"motion_bias[0]", given.motion_bias[0]},
               {"motion_bias[1]", given.motion_bias[1]},
               {"jitter_px[0]", given.jitter_px[0]},
               {"jitter_px[1]", given.jitter_px[1]},
               {"other_jitter_px[0]", given.other_jitter_px[0]},
               {"other_jitter_px[1]", given.other_jitter_px[1]},
               {"pre_exposure", given.pre_exposure},
               {"focal_length_mm", given.focal_length_mm},
               {"sensor_width_mm", given.sensor_width_mm},
               {"f_stop", given.f_stop},
               {"focus_distance", given.focus_distance},
               {"meters_per_unit", given.meters_per_unit},
               {"shutter_frames", given.shutter_frames},
               {"max_speed_px", given.max_speed_px},
               {"nearest", given.nearest},
               {"farthest", given.farthest},
               {"pixel_aspect", given.pixel_aspect},
               {"depth_range[0]", given.depth_range[0]},
               {"depth_range[1]", given.depth_range[1]},
               {"focus_radius", given.focus_radius},
               {"focus_seconds", given.focus_seconds},
               {"frame_seconds", given.frame_seconds}};
    for (const auto& [name, value] : all)
        if (!std::isfinite(value)) return {PC_ERROR_CHAIN, concat(name, " is ", value)};
    for (const auto& [name, matrix] : {std::pair("view_projection", given.view_projection),
                                       {"other_view_projection", given.other_view_projection}})
        for (int i = 0; i < 16; ++i)
            if (!std::isfinite(matrix[i]))
                return {PC_ERROR_CHAIN, concat(name, ": element ", i, " is not finite")};
    if (!knows_flags(given.flags))
        return {PC_ERROR_VERSION, concat("pc_frame.flags: ", given.flags,
                                         " has a bit that this library does not know")};
    if (frame.flag(PC_TOP_LEFT) && frame.flag(PC_BOTTOM_LEFT))
        return {PC_ERROR_ARGUMENT, "flags: PC_TOP_LEFT and PC_BOTTOM_LEFT; give one"};
    if (given.reserved != 0 || given.reserved_2 != 0 || given.reserved_3[0] != 0 ||
        given.reserved_3[1] != 0)
        return {PC_ERROR_VERSION, "pc_frame.reserved, reserved_2 or reserved_3 is not 0"};
    if (given.pre_exposure < 0)
        return {PC_ERROR_CHAIN, concat("pre_exposure is ", given.pre_exposure)};
    if (given.pixel_aspect < 0)
        return {PC_ERROR_CHAIN, concat("pixel_aspect is ", given.pixel_aspect)};
    if (given.depth_encoding > PC_DEPTH_REVERSE_INFINITE)
        return {PC_ERROR_ARGUMENT,
                concat("depth_encoding: ", given.depth_encoding, " is not a PC_DEPTH value")};
    if (given.depth_encoding > PC_DEPTH_INVERSE && given.depth.name) {
        const bool far =
            given.depth_encoding == PC_DEPTH_FORWARD || given.depth_encoding == PC_DEPTH_REVERSE;
        if (given.near_clip <= 0)
            return {PC_ERROR_CHAIN, "near_clip: must be > 0 for this depth_encoding"};
        if (far && given.far_clip <= given.near_clip)
            return {PC_ERROR_CHAIN, "far_clip: must be > near_clip for this depth_encoding"};
    }
    if (frame.has_depth_range()) {
        if (given.depth_range[0] == given.depth_range[1])
            return {PC_ERROR_CHAIN, concat("depth_range: both ends are ", given.depth_range[0])};
        if (given.depth_encoding <= PC_DEPTH_INVERSE)
            return {PC_ERROR_CHAIN,
                    "depth_range: this depth_encoding has no clip planes; leave it 0"};
    }
    if (given.focus_radius < 0 || given.focus_radius > 1)
        return {PC_ERROR_CHAIN, concat("focus_radius: ", given.focus_radius,
                                       " is not within 0 and 1 frame heights")};
    if (given.focus_seconds < 0)
        return {PC_ERROR_CHAIN, concat("focus_seconds is ", given.focus_seconds)};
    if (given.focus_seconds > 0 && !(given.frame_seconds > 0))
        return {PC_ERROR_CHAIN, "frame_seconds: must be > 0, because focus_seconds is set"};
    return {};
}

// The rectangle's size in a plane that may have another than the frame.
Failure check_plane_size(std::string_view prefix, const char* name, const int32_t (&given)[2],
                         const HostPlanes& frame, std::array<int, 2>& size) {
    size = {given[0], given[1]};
    if (given[0] == 0 && given[1] == 0) size = {frame.width, frame.height};
    const bool fits =
        size[0] > 0 && size[1] > 0 && size[0] <= frame.width && size[1] <= frame.height;
    if (!fits)
        return {PC_ERROR_INPUT,
                concat(prefix, name, ": ", given[0], "x", given[1], " is not within 1x1 and ",
                       frame.width, "x", frame.height, ", the frame")};
    return {};
}

bool any(const float (&values)[16]) {
    return std::any_of(values, values + 16, [](float value) { return value != 0; });
}

// Texels from the first one to the texture's end, or the nearest int.
int rest(int32_t side, int32_t first) {
    return int(std::clamp(int64_t(side) - first, int64_t(INT32_MIN), int64_t(INT32_MAX)));
}

// Bounds must hold, and so must their order.
Failure check_bounds(const pc_frame& given) {
    const std::pair<const char*, float> bounds[] = {{"max_speed_px", given.max_speed_px},
                                                    {"nearest", given.nearest},
                                                    {"farthest", given.farthest}};
    for (const auto& [name, value] : bounds)
        if (value < 0)
            return {PC_ERROR_CHAIN,
                    concat(name, " is ", value, "; give a bound, or 0 if it is unknown")};
    if (given.farthest > 0 && given.nearest > given.farthest)
        return {PC_ERROR_CHAIN, concat("nearest: ", given.nearest, " is beyond farthest, ",
                                       given.farthest, "; exchange them")};
    return {};
}

// Values of a camera that no lens has.
Failure check_lens(const pc_frame& given) {
    const std::pair<const char*, float> values[] = {
        {"near_clip", given.near_clip},
        {"far_clip", given.far_clip},
        {"focal_length_mm", given.focal_length_mm},
        {"sensor_width_mm", given.sensor_width_mm},
        {"f_stop", given.f_stop},
        {"focus_distance", given.focus_distance},
        {"meters_per_unit", given.meters_per_unit},
        {"shutter_frames", std::max(given.shutter_frames, 0.0f)}};
    for (const auto& [key, value] : values)
        if (value != 0) RETURN_IF_ERROR(camera_parameters().find(key)->check(double(value)));
    if (given.f_stop != 0 && given.f_stop < kMinFStop)
        return {PC_ERROR_CHAIN,
                concat("f_stop: ", given.f_stop, " is below ", kMinFStop,
                       "; give the focal length over the diameter of the aperture")};
    return {};
}

// The member's texture, and its channels.
Failure check_member(const Member& member, int least_channels, bool depth,
                     const HostFormat* (*find)(unsigned)) {
    RETURN_IF_ERROR(check_texture(member, find));
    const HostFormat* format = member.checked.format;
    if (format && (format->channels < least_channels || (format->depth && !depth)))
        return {PC_ERROR_INPUT, concat(member.name(), ": ", format->text, " has fewer than the ",
                                       least_channels, " channels that it needs")};
    return {};
}

// The planes of a frame or a neighbor, and their size.
Failure check_planes(std::string_view prefix, HostPlanes& planes,
                     const HostFormat* (*find)(unsigned)) {
    const pc_frame& given = *planes.given;
    if (given.color.name == 0)
        return {PC_ERROR_INPUT, concat(prefix, "color: name 0; give the texture to filter")};
    planes.width = given.width ? given.width : rest(given.color.width, given.color.x);
    planes.height = given.height ? given.height : rest(given.color.height, given.color.y);
    if (planes.width <= 0 || planes.height <= 0)
        return {PC_ERROR_INPUT, concat("the frame is ", planes.width, "x", planes.height,
                                       ": there is nothing to do")};
    std::array<int, 2> depth_size, motion_size;
    RETURN_IF_ERROR(check_plane_size(prefix, "depth_size", given.depth_size, planes, depth_size));
    RETURN_IF_ERROR(
        check_plane_size(prefix, "motion_size", given.motion_size, planes, motion_size));
    const struct {
        Member member;
        int least_channels;
        bool depth;
    } members[] = {{{prefix, "color", given.color, given.color_slice, planes.width, planes.height,
                     planes.color},
                    3,
                    false},
                   {{prefix, "depth", given.depth, given.depth_slice, depth_size[0], depth_size[1],
                     planes.depth},
                    1,
                    true},
                   {{prefix, "motion", given.motion, given.motion_slice, motion_size[0],
                     motion_size[1], planes.motion},
                    2,
                    false},
                   {{prefix, "exposure", given.exposure, {}, 1, 1, planes.exposure}, 1, true}};
    for (const auto& [member, least_channels, depth] : members)
        RETURN_IF_ERROR(check_member(member, least_channels, depth, find));
    planes.sky = planes.motion.name && planes.depth.name && any(given.view_projection) &&
                 any(given.other_view_projection);
    return {};
}

// Those that are not used are left out.
Failure check_neighbors(HostFrame& frame, const HostFormat* (*find)(unsigned)) {
    const pc_frame* const given[] = {frame.given->before, frame.given->after};
    const bool alone = frame.flag(PC_CAMERA_CUT) || frame.halved() || frame.depth.name == 0 ||
                       frame.motion.name == 0;
    for (const Neighbor neighbor : kNeighbors) {
        HostPlanes& planes = frame.neighbors[size_t(neighbor)];
        planes.given = given[size_t(neighbor)];
        if (!planes.given) continue;
        const std::string_view prefix = neighbor == Neighbor::before ? "before." : "after.";
        RETURN_IF_ERROR(check_planes(prefix, planes, find));
        if (Failure failure = check_numbers(planes); !failure.ok())
            return {failure.result, concat(prefix, failure.text)};
        if (planes.depth.name == 0 || planes.motion.name == 0)
            return {PC_ERROR_INPUT, concat(prefix, planes.depth.name ? "motion" : "depth",
                                           ": name 0; give the plane that the frame had")};
        if ((planes.exposure.name != 0) != (frame.exposure.name != 0))
            return {PC_ERROR_INPUT, concat(prefix, "exposure: give it in both frames, or in none")};
        if (alone || planes.flag(PC_CAMERA_CUT) || planes.width != frame.width ||
            planes.height != frame.height)
            planes = {};
    }
    return {};
}

}  // namespace

bool knows_flags(uint32_t flags) {
    return flags < 2 * PC_BOTTOM_LEFT;
}

Failure read_frame(const pc_frame* given, FrameCopy& copy, const pc_frame*& read) {
    RETURN_IF_ERROR(read_struct(given, "pc_frame", copy.frame, read));
    if (!read->before && !read->after) return {};
    copy.frame = *read;
    read = &copy.frame;
    std::array<const pc_frame*, kNeighbors.size()> neighbors = {copy.frame.before,
                                                                copy.frame.after};
    std::array<pc_frame, kNeighbors.size()> whole;
    if (neighbors[0])
        RETURN_IF_ERROR(read_struct(neighbors[0], "pc_frame.before", whole[0], neighbors[0]));
    if (neighbors[1])
        RETURN_IF_ERROR(read_struct(neighbors[1], "pc_frame.after", whole[1], neighbors[1]));
    set_neighbors(copy.frame, neighbors, copy.neighbors);
    return {};
}

void set_neighbors(pc_frame& frame, std::array<const pc_frame*, kNeighbors.size()> given,
                   std::array<pc_frame, kNeighbors.size()>& copy) {
    for (size_t i = 0; i < given.size(); ++i) {
        if (!given[i]) continue;
        if (given[i] != &copy[i]) copy[i] = *given[i];
        copy[i].flags &= ~kPlanFlags;
        copy[i].before = copy[i].after = nullptr;
    }
    frame.before = given[0] ? &copy[0] : nullptr;
    frame.after = given[1] ? &copy[1] : nullptr;
}

Failure check_frame(const pc_frame* given, HostFrame& frame, const HostFormat* (*find)(unsigned)) {
    frame = {};
    if (!given) return {PC_ERROR_ARGUMENT, "frame is NULL"};
    frame.given = given;
    RETURN_IF_ERROR(check_planes("", frame, find));
    const Member members[] = {
        {"", "mask", given->mask, given->mask_slice, frame.width, frame.height, frame.mask},
        {"", "output", given->output, given->output_slice, frame.width, frame.height,
         frame.output}};
    for (const Member& member : members)
        RETURN_IF_ERROR(
            check_member(member, &member.checked == &frame.output ? 3 : 1, false, find));
    if (frame.output.format && !frame.output.format->image)
        return {PC_ERROR_INPUT, concat("output: ", frame.output.format->text,
                                       " cannot be written by a compute shader; give GL_RGBA8, "
                                       "GL_RGBA16F or another of those in postchain.h")};
    if (given->debug_view && strnlen(given->debug_view, kLongestView + 1) > kLongestView)
        return {PC_ERROR_ARGUMENT, concat("debug_view: longer than ", kLongestView, " letters")};
    RETURN_IF_ERROR(check_numbers(frame));
    if (given->debug_view && std::string_view(given->debug_view).starts_with("host.color") &&
        frame.output.name == frame.color.name && !frame.output_is_color())
        return {PC_ERROR_ARGUMENT,
                "debug_view: host.color cannot be drawn into another rectangle of its texture"};
    if (frame.halved()) {
        if (frame.output.name == 0 || frame.output.name == frame.color.name)
            return {PC_ERROR_INPUT,
                    "output: PC_HALF_RESOLUTION needs one, and not the texture of color"};
        if (given->debug_view && *given->debug_view)
            return {PC_ERROR_ARGUMENT, "debug_view: give it without PC_HALF_RESOLUTION"};
    }
    return check_neighbors(frame, find);
}

Failure check_deeper(const HostFrame& frame) {
    const pc_frame& given = *frame.given;
    RETURN_IF_ERROR(check_bounds(given));
    RETURN_IF_ERROR(check_lens(given));
    const struct {
        const char* name;
        const float (&columns)[16];
    } matrices[] = {{"view_projection", given.view_projection},
                    {"other_view_projection", given.other_view_projection}};
    for (const auto& [name, columns] : matrices) {
        if (!any(columns)) continue;
        const glm::dmat3 rows = clip_directions(columns);
        double scale = 1;
        for (int i = 0; i < 3; ++i) scale *= glm::length(rows[i]);
        if (!(std::abs(glm::determinant(rows)) > 1e-9 * scale))
            return {PC_ERROR_INPUT,
                    concat(name, ": is singular; give world to clip space, columns first")};
    }
    const struct {
        const char* name;
        uint32_t texture;
    } planes[] = {{"depth", given.depth.name},
                  {"motion", given.motion.name},
                  {"mask", given.mask.name},
                  {"exposure", given.exposure.name}};
    for (const auto& [name, texture] : planes)
        if (given.output.name != 0 && given.output.name == texture)
            return {PC_ERROR_INPUT, concat("output: is the texture of ", name,
                                           ", which it would overwrite; only color may be both")};
    return {};
}

}  // namespace postchain::guest

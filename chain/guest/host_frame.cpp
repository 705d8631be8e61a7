#include "chain/guest/host_frame.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_access.hpp>
#include <glm/matrix.hpp>

namespace postchain::guest {
namespace {

constexpr int kLastLevel = 30;
constexpr size_t kLongestView = std::tuple_size_v<decltype(PlanKey::debug_view)> - 1;

// A member of pc_frame, and the texels that the frame's rectangle has in it.
struct Member {
    const char* name;
    const pc_texture& texture;
    pc_slice slice;
    int width, height;
    HostTexture& checked;
};

Failure check_slice(const Member& member) {
    const pc_slice& slice = member.slice;
    const bool array = slice.target == GL_TEXTURE_2D_ARRAY;
    if (!array && slice.target != 0 && slice.target != GL_TEXTURE_2D)
        return {
            PC_ERROR_INPUT,
            concat(member.name, "_slice.target: 0x", std::hex, slice.target,
                   " is not GL_TEXTURE_2D_ARRAY, GL_TEXTURE_2D or 0, which means GL_TEXTURE_2D")};
    if (slice.layer < 0 || (!array && slice.layer != 0))
        return {PC_ERROR_INPUT,
                concat(member.name, "_slice.layer: ", slice.layer,
                       array ? " is below 0" : "; set target to GL_TEXTURE_2D_ARRAY too")};
    if (slice.level < 0 || slice.level > kLastLevel)
        return {PC_ERROR_INPUT, concat(member.name, "_slice.level: ", slice.level,
                                       " is not within 0 and ", kLastLevel)};
    member.checked.array = array;
    member.checked.image = {slice.layer, slice.level};
    return {};
}

// Checks that a texture covers its rectangle and has a format that the member accepts.
Failure check_texture(const Member& member) {
    const pc_texture& given = member.texture;
    HostTexture& texture = member.checked;
    texture = {};
    if (given.name == 0) return {};
    texture.name = given.name;
    texture.width = member.width;
    texture.height = member.height;
    texture.format = find_format(given.internal_format);
    if (!texture.format)
        return {PC_ERROR_INPUT,
                concat(member.name, ".internal_format: ", text_of_format(given.internal_format),
                       " is not a sized format of float, normalized or depth values")};
    if (given.width <= 0 || given.height <= 0)
        return {PC_ERROR_INPUT,
                concat(member.name, ": its size is ", given.width, "x", given.height)};
    if (given.x < 0 || given.y < 0 || given.x > given.width - member.width ||
        given.y > given.height - member.height)
        return {PC_ERROR_INPUT,
                concat(member.name, ": a frame of ", member.width, "x", member.height, " at ",
                       given.x, ", ", given.y, " is not inside its ", given.width, "x",
                       given.height, " texels")};
    texture.at_origin = given.x == 0 && given.y == 0;
    return check_slice(member);
}

bool has_range(const pc_frame& given) {
    return given.depth_range[0] != 0 || given.depth_range[1] != 0;
}

Failure check_numbers(const pc_frame& given) {
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
    for (int i = 0; i < 16; ++i)
        if (!std::isfinite(given.view_projection[i]) ||
            !std::isfinite(given.other_view_projection[i]))
            return {PC_ERROR_CHAIN, concat("view_projection: element ", i, " is not finite")};
    constexpr uint32_t kFrameFlags = 2 * PC_GIVEN_SHUTTER - 1;
    if ((given.flags & ~kFrameFlags) != 0)
        return {PC_ERROR_VERSION, concat("pc_frame.flags: ", given.flags,
                                         " has a bit that this library does not know")};
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
    if (has_range(given)) {
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
Failure check_plane_size(const char* name, const int32_t (&given)[2], HostFrame& frame,
                         std::array<int, 2>& size) {
    size = {given[0], given[1]};
    if (given[0] == 0 && given[1] == 0) size = {frame.width, frame.height};
    const bool fits =
        size[0] > 0 && size[1] > 0 && size[0] <= frame.width && size[1] <= frame.height;
    if (!fits)
        return {PC_ERROR_INPUT,
                concat(name, ": ", given[0], "x", given[1], " is not within 1x1 and ", frame.width,
                       "x", frame.height, ", the frame")};
    return {};
}

bool any(const float (&values)[16]) {
    return std::any_of(values, values + 16, [](float value) { return value != 0; });
}

// Texels from the first one to the texture's end, or the nearest int.
int rest(int32_t side, int32_t first) {
    return int(std::clamp(int64_t(side) - first, int64_t(INT32_MIN), int64_t(INT32_MAX)));
}

float scale_of(float given) {
    return given == 0 ? 1 : given;
}

// Directions to x, y and w of clip space: the first three columns of a view projection.
glm::dmat3 directions(const float (&columns)[16]) {
    glm::dmat3 matrix;
    for (int column = 0; column < 3; ++column) {
        const float* c = columns + 4 * column;
        matrix[column] = {c[0], c[1], c[3]};
    }
    return matrix;
}

}  // namespace

bool HostFrame::has_gain() const {
    return exposure.name != 0 || (given->pre_exposure != 0 && given->pre_exposure != 1);
}

bool HostFrame::shows_fill() const {
    return given->debug_view && std::string_view(given->debug_view) == "fill";
}

bool HostFrame::motion_in_place() const {
    return is_plane(motion) && !sky && scale_of(given->motion_scale[0]) == 1 &&
           scale_of(given->motion_scale[1]) == 1 && given->motion_bias[0] == 0 &&
           given->motion_bias[1] == 0 && !flag(PC_MOTION_JITTERED);
}

bool HostFrame::output_is_an_input() const {
    return output.name != 0 &&
           (output.name == color.name || output.name == depth.name || output.name == motion.name ||
            output.name == mask.name || output.name == exposure.name);
}

bool HostFrame::output_is_color() const {
    return output.name != 0 && output.name == color.name && given->output.x == given->color.x &&
           given->output.y == given->color.y && output.image == color.image;
}

bool HostFrame::output_holds_color() const {
    const float most = output.format->largest();
    return most == 0 || (color.format->half && color.format->largest() <= most);
}

uint32_t HostFrame::arrays() const {
    return (color.array ? GUEST_ARRAY_COLOR : 0) | (depth.array ? GUEST_ARRAY_DEPTH : 0) |
           (motion.array ? GUEST_ARRAY_MOTION : 0) | (mask.array ? GUEST_ARRAY_MASK : 0);
}

Failure check_frame(const pc_frame* given, HostFrame& frame) {
    frame = {};
    if (!given) return {PC_ERROR_ARGUMENT, "frame is NULL"};
    frame.given = given;
    if (given->color.name == 0)
        return {PC_ERROR_INPUT, "color: name 0; give the texture to filter"};
    frame.width = given->width ? given->width : rest(given->color.width, given->color.x);
    frame.height = given->height ? given->height : rest(given->color.height, given->color.y);
    if (frame.width <= 0 || frame.height <= 0)
        return {PC_ERROR_INPUT, concat("the frame is ", frame.width, "x", frame.height,
                                       ": there is nothing to do")};
    std::array<int, 2> depth_size, motion_size;
    if (Failure failure = check_plane_size("depth_size", given->depth_size, frame, depth_size);
        !failure.ok())
        return failure;
    if (Failure failure = check_plane_size("motion_size", given->motion_size, frame, motion_size);
        !failure.ok())
        return failure;
    const int w = frame.width, h = frame.height;
    const struct {
        Member member;
        int least_channels;
        bool depth;
    } members[] = {
        {{"color", given->color, given->color_slice, w, h, frame.color}, 3, false},
        {{"depth", given->depth, given->depth_slice, depth_size[0], depth_size[1], frame.depth},
         1,
         true},
        {{"motion", given->motion, given->motion_slice, motion_size[0], motion_size[1],
          frame.motion},
         2,
         false},
        {{"mask", given->mask, given->mask_slice, w, h, frame.mask}, 1, false},
        {{"output", given->output, given->output_slice, w, h, frame.output}, 3, false},
        {{"exposure", given->exposure, {}, 1, 1, frame.exposure}, 1, true}};
    for (const auto& [member, least_channels, depth] : members) {
        if (Failure failure = check_texture(member); !failure.ok()) return failure;
        const HostFormat* format = member.checked.format;
        if (!format) continue;
        if (format->channels < least_channels || (format->depth && !depth))
            return {PC_ERROR_INPUT, concat(member.name, ": ", format->text, " has fewer than the ",
                                           least_channels, " channels that it needs")};
    }
    if (frame.output.format && !frame.output.format->image)
        return {PC_ERROR_INPUT, concat("output: ", frame.output.format->text,
                                       " cannot be written by a compute shader; give GL_RGBA8, "
                                       "GL_RGBA16F or another of those in postchain.h")};
    if (given->debug_view && strnlen(given->debug_view, kLongestView + 1) > kLongestView)
        return {PC_ERROR_ARGUMENT, concat("debug_view: longer than ", kLongestView, " letters")};
    if (Failure failure = check_numbers(*given); !failure.ok()) return failure;
    frame.sky = frame.motion.name && frame.depth.name && any(given->view_projection) &&
                any(given->other_view_projection);
    return {};
}

Failure check_deeper(const HostFrame& frame) {
    const pc_frame& given = *frame.given;
    const struct {
        const char* name;
        const float (&columns)[16];
    } matrices[] = {{"view_projection", given.view_projection},
                    {"other_view_projection", given.other_view_projection}};
    for (const auto& [name, columns] : matrices) {
        if (!any(columns)) continue;
        const glm::dmat3 rows = directions(columns);
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

FrameDescription describe(const HostFrame& frame, const Chain& chain) {
    const pc_frame& given = *frame.given;
    FrameDescription description;
    description.width = description.display_width = frame.width;
    description.height = description.display_height = frame.height;
    description.pixel_aspect = double(scale_of(given.pixel_aspect));
    description.frame_number = int(given.frame_number & 0x7fffffff);
    description.planes = {Role::color};
    if (frame.depth.name) description.planes.add(Role::inverse_depth);
    if (frame.motion.name) description.planes.add(Role::motion);
    if (frame.shows_fill()) {
        description.planes.add(Role::layers);
        description.layers = 1;
        description.fill_layer = 0;
    }
    description.without_mattes = frame.mask.name == 0;
    if (!description.without_mattes) {
        for (const ChainLink& link : chain.links)
            description.mattes.push_back(link.matte.empty() ? -1 : 0);
        if (stacked_planes(Role::mattes, description) > 0) description.planes.add(Role::mattes);
    }
    if (frame.focus) description.bounds.inverse_depth_at = *frame.focus;
    const auto set = [](std::optional<double>& value, float number) {
        if (number != 0) value = double(number);
    };
    Camera& camera = description.camera;
    set(camera.focal_length_mm, given.focal_length_mm);
    set(camera.sensor_width_mm, given.sensor_width_mm);
    set(camera.f_stop, given.f_stop);
    set(camera.focus_distance, given.focus_distance);
    set(camera.near_clip, given.near_clip);
    set(camera.far_clip, given.far_clip);
    set(camera.meters_per_unit, given.meters_per_unit);
    set(camera.shutter_frames, given.shutter_frames);
    if (given.shutter_frames < 0) camera.shutter_frames = 0;
    if (frame.flag(PC_GIVEN_SHUTTER)) camera.shutter_frames = std::max(given.shutter_frames, 0.0f);
    description.camera_place = "in pc_frame";
    FrameBounds& bounds = description.bounds;
    bounds.camera_cut = frame.flag(PC_CAMERA_CUT);
    bounds.color_is_half = frame.color.format->half && !frame.has_gain();
    if (given.max_speed_px > 0) bounds.max_speed_px = double(given.max_speed_px);
    if (given.nearest > 0) bounds.max_inverse_depth = 1 / double(given.nearest);
    if (given.farthest > 0) bounds.min_inverse_depth = 1 / double(given.farthest);
    return description;
}

PlanKey key_of(const HostFrame& frame, const Room& room, uint64_t chain, uint64_t revision) {
    const pc_frame& given = *frame.given;
    PlanKey key;
    key.chain = chain;
    key.revision = revision;
    key.room = room;
    key.flags = given.flags & (PC_TOP_LEFT | PC_HALF_PLANES | PC_NO_ELISION);
    key.formats = {frame.color.format, frame.depth.format, frame.motion.format,
                   frame.output.format};
    key.cases = {frame.color_in_place(),
                 frame.depth_in_place(),
                 frame.motion_in_place(),
                 frame.output.at_origin,
                 frame.output_is_an_input(),
                 frame.sky,
                 frame.has_gain(),
                 frame.exposure.name != 0,
                 frame.output_is_color(),
                 frame.mask.name != 0,
                 frame.output.format && frame.output_holds_color()};
    key.arrays = frame.arrays();
    if (given.debug_view) std::strncpy(key.debug_view.data(), given.debug_view, kLongestView);
    return key;
}

FrameKind kind_of(const HostFrame& frame, uint64_t chain, uint64_t revision) {
    FrameKind kind{chain,
                   revision,
                   frame.given->flags & (PC_HALF_PLANES | PC_NO_ELISION),
                   frame.depth.name != 0,
                   frame.motion.name != 0,
                   frame.mask.name != 0,
                   frame.exposure.name != 0,
                   frame.arrays(),
                   {}};
    if (frame.given->debug_view)
        std::strncpy(kind.debug_view.data(), frame.given->debug_view, kLongestView);
    return kind;
}

std::string difference_text(const FrameKind& kind, const std::vector<FrameKind>& prepared) {
    const FrameKind* nearest = nullptr;
    for (const FrameKind& other : prepared)
        if (other.chain == kind.chain) nearest = &other;
    if (!nearest) return "pc_prepare() was not called for this chain";
    const auto given = [](const char* member, bool now) {
        return concat(member, now ? ": given, and not" : ": not given, but", " to pc_prepare()");
    };
    const auto flag = [&](const char* name, uint32_t bit) {
        return concat("flags: ", name,
                      (kind.flags & bit) != 0 ? ", and not" : " is missing, but set",
                      " in pc_prepare()");
    };
    const char* remedy = "; call pc_prepare() with a frame like this one";
    const uint32_t flags = kind.flags ^ nearest->flags;
    if (kind.debug_view != nearest->debug_view)
        return concat("debug_view: pc_prepare() was not called with \"", kind.debug_view.data(),
                      "\"", remedy);
    if ((flags & PC_HALF_PLANES) != 0) return flag("PC_HALF_PLANES", PC_HALF_PLANES) + remedy;
    if (flags != 0) return flag("PC_NO_ELISION", PC_NO_ELISION) + remedy;
    if (kind.exposure != nearest->exposure) return given("exposure", kind.exposure) + remedy;
    if (kind.depth && !nearest->depth) return given("depth", true) + remedy;
    if (kind.motion && !nearest->motion) return given("motion", true) + remedy;
    if (kind.mask && !nearest->mask) return given("mask", true) + remedy;
    const std::pair<const char*, uint32_t> slices[] = {{"color", GUEST_ARRAY_COLOR},
                                                       {"depth", GUEST_ARRAY_DEPTH},
                                                       {"motion", GUEST_ARRAY_MOTION},
                                                       {"mask", GUEST_ARRAY_MASK}};
    for (const auto& [name, bit] : slices)
        if (((kind.arrays ^ nearest->arrays) & bit) != 0)
            return concat(name, "_slice.target: ", (kind.arrays & bit) != 0 ? "an" : "not an",
                          " array, unlike in pc_prepare()", remedy);
    return concat("the chain's values were changed since pc_prepare()", remedy);
}

FrameValues values_of(const HostFrame& frame) {
    const pc_frame& given = *frame.given;
    FrameValues values = {float(frame.width),
                          float(frame.height),
                          given.near_clip,
                          given.far_clip,
                          given.focal_length_mm,
                          given.sensor_width_mm,
                          given.f_stop,
                          given.focus_distance,
                          given.meters_per_unit,
                          given.shutter_frames,
                          given.max_speed_px,
                          given.nearest,
                          given.farthest,
                          given.pixel_aspect,
                          frame.flag(PC_CAMERA_CUT) ? 1.0f : 0.0f,
                          frame.flag(PC_GIVEN_SHUTTER) ? 1.0f : 0.0f};
    if (!frame.focus) return values;
    size_t next = values.size();
    for (const auto& [place, inverse_depth] : *frame.focus) values[--next] = float(inverse_depth);
    return values;
}

shared::GuestUniforms uniforms_of(const HostFrame& frame) {
    const pc_frame& given = *frame.given;
    shared::GuestUniforms uniforms{};
    uniforms.size = {frame.width, frame.height};
    uniforms.color_at = {given.color.x, given.color.y};
    uniforms.depth_at = {given.depth.x, given.depth.y};
    uniforms.motion_at = {given.motion.x, given.motion.y};
    uniforms.exposure_at = {given.exposure.x, given.exposure.y};
    uniforms.output_at = {given.output.x, given.output.y};
    uniforms.mask_at = {given.mask.x, given.mask.y};
    uniforms.depth_size = {frame.depth.width, frame.depth.height};
    uniforms.motion_size = {frame.motion.width, frame.motion.height};
    const auto each = [&](int gl::ImageOf::*member) {
        return glm::ivec4(frame.color.image.*member, frame.depth.image.*member,
                          frame.motion.image.*member, frame.mask.image.*member);
    };
    uniforms.layers = each(&gl::ImageOf::layer);
    uniforms.levels = each(&gl::ImageOf::level);
    if (has_range(given)) {
        uniforms.clips = 1;
        uniforms.depth_first = given.depth_range[0];
        uniforms.depth_factor = 1 / (given.depth_range[1] - given.depth_range[0]);
    }
    const float most = frame.output.format ? frame.output.format->largest() : 0;
    uniforms.output_max = most == 0 ? FLT_MAX : most;
    uniforms.bottom_up = frame.top_left() ? 0 : 1;
    const double n = 1 / double(given.near_clip), f = 1 / double(given.far_clip);
    const auto affine = [&](double offset, double slope) {
        uniforms.depth_offset = float(offset);
        uniforms.depth_slope = float(slope);
    };
    switch (given.depth_encoding) {
        case PC_DEPTH_LINEAR:
            uniforms.distance = 1;
            break;
        case PC_DEPTH_FORWARD:
            affine(n, f - n);
            break;
        case PC_DEPTH_FORWARD_INFINITE:
            affine(n, -n);
            break;
        case PC_DEPTH_REVERSE:
            affine(f, n - f);
            break;
        case PC_DEPTH_REVERSE_INFINITE:
            affine(0, n);
            break;
        default:
            affine(0, 1);
    }
    const bool to_next = frame.flag(PC_MOTION_TO_NEXT);
    uniforms.motion_scale = {scale_of(given.motion_scale[0]), scale_of(given.motion_scale[1])};
    uniforms.motion_bias = {given.motion_bias[0], given.motion_bias[1]};
    if (frame.flag(PC_MOTION_JITTERED)) {
        const float sign = to_next ? -1.0f : 1.0f;
        uniforms.motion_jitter = {sign * (given.jitter_px[0] - given.other_jitter_px[0]),
                                  sign * (given.jitter_px[1] - given.other_jitter_px[1])};
    }
    uniforms.gain = given.pre_exposure == 0 ? 1 : 1 / given.pre_exposure;
    if (frame.sky) {
        const glm::dmat3 there = directions(given.other_view_projection) *
                                 glm::inverse(directions(given.view_projection));
        const auto row = [&](int i) {
            const glm::dvec3 r = glm::row(there, i);
            return glm::vec4(float(r.x), float(r.y), float(r.z), 0);
        };
        uniforms.sky_x = row(0);
        uniforms.sky_y = row(1);
        uniforms.sky_w = row(2);
        uniforms.sky_sign = to_next ? 1.0f : -1.0f;
    }
    return uniforms;
}

}  // namespace postchain::guest

#include "chain/guest/host_frame.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_access.hpp>
#include <glm/matrix.hpp>

#include "chain/base/status.h"

namespace postchain::guest {
namespace {

#define FORMAT(name, ...) \
    { name, #name, __VA_ARGS__ }
// Format, channels, depth, image, half. A half has 11 bits: 8 normalized bits are no halves.
constexpr HostFormat kFormats[] = {
    FORMAT(GL_RGBA32F, 4, false, true, false),
    FORMAT(GL_RGBA16F, 4, false, true, true),
    FORMAT(GL_RGB32F, 3, false, false, false),
    FORMAT(GL_RGB16F, 3, false, false, true),
    FORMAT(GL_R11F_G11F_B10F, 3, false, true, true),
    FORMAT(GL_RGB9_E5, 3, false, false, false),
    FORMAT(GL_RGBA16, 4, false, true, false),
    FORMAT(GL_RGBA8, 4, false, true, false),
    FORMAT(GL_RGB10_A2, 4, false, true, false),
    FORMAT(GL_RGB8, 3, false, false, false),
    FORMAT(GL_SRGB8_ALPHA8, 4, false, false, false),
    FORMAT(GL_SRGB8, 3, false, false, false),
    FORMAT(GL_RGBA16_SNORM, 4, false, true, false),
    FORMAT(GL_RGBA8_SNORM, 4, false, true, false),
    FORMAT(GL_RG32F, 2, false, true, false),
    FORMAT(GL_RG16F, 2, false, true, true),
    FORMAT(GL_RG16, 2, false, true, false),
    FORMAT(GL_RG8, 2, false, true, false),
    FORMAT(GL_RG16_SNORM, 2, false, true, false),
    FORMAT(GL_RG8_SNORM, 2, false, true, false),
    FORMAT(GL_R32F, 1, false, true, false),
    FORMAT(GL_R16F, 1, false, true, true),
    FORMAT(GL_R16, 1, false, true, false),
    FORMAT(GL_R8, 1, false, true, false),
    FORMAT(GL_DEPTH_COMPONENT32F, 1, true, false, false),
    FORMAT(GL_DEPTH_COMPONENT32, 1, true, false, false),
    FORMAT(GL_DEPTH_COMPONENT24, 1, true, false, false),
    FORMAT(GL_DEPTH_COMPONENT16, 1, true, false, false),
    FORMAT(GL_DEPTH32F_STENCIL8, 1, true, false, false),
    FORMAT(GL_DEPTH24_STENCIL8, 1, true, false, false),
};
#undef FORMAT

constexpr size_t kArrayBits = 4;  // GUEST_ARRAY_...

float scale_of(float given) {
    return given == 0 ? 1 : given;
}

// The pixel of each place, and the radius around it.
void set_places(const HostFrame& frame, shared::GuestUniforms& uniforms) {
    const auto pixel = [](double fraction, int size) {
        return int(std::clamp(std::floor(fraction * size), 0.0, size - 1.0));
    };
    const int radius = int(std::lround(double(frame.given->focus_radius) * frame.height));
    for (const auto& entry : *frame.focus)
        uniforms.focus[uniforms.focus_count++] = {pixel(entry.first[0], frame.width),
                                                  pixel(entry.first[1], frame.height), radius, 0};
    uniforms.focus_slot = frame.focus_slot;
}

// Members that make `kind` another kind than the prepared one, which may have more planes.
int differences(const FrameKind& kind, const FrameKind& prepared) {
    return (kind.revision != prepared.revision) + std::popcount(kind.flags ^ prepared.flags) +
           (kind.depth > prepared.depth) + (kind.motion > prepared.motion) +
           (kind.mask > prepared.mask) + (kind.before > prepared.before) +
           (kind.after > prepared.after) + (kind.exposure != prepared.exposure) +
           std::popcount(kind.arrays ^ prepared.arrays) + (kind.debug_view != prepared.debug_view);
}

}  // namespace

float HostFormat::largest() const {
    if (half && channels == 3 && image) return 64512;  // floats of 11 and 10 bits
    return half ? 65504 : 0;
}

const HostFormat* find_format(unsigned internal_format) {
    for (const auto& format : kFormats)
        if (format.name == internal_format) return &format;
    return nullptr;
}

std::string text_of_format(unsigned internal_format) {
    if (const HostFormat* format = find_format(internal_format)) return format->text;
    return concat("0x", std::hex, internal_format);
}

bool HostPlanes::has_gain() const {
    return exposure.name != 0 || (given->pre_exposure != 0 && given->pre_exposure != 1);
}

bool HostFrame::shows_fill() const {
    return given->debug_view && std::string_view(given->debug_view) == "fill";
}

bool HostPlanes::motion_in_place() const {
    return is_plane(motion) && !sky && scale_of(given->motion_scale[0]) == 1 &&
           scale_of(given->motion_scale[1]) == 1 && given->motion_bias[0] == 0 &&
           given->motion_bias[1] == 0 && !flag(PC_MOTION_JITTERED);
}

bool HostFrame::output_is_an_input() const {
    if (output.name == 0) return false;
    const auto has = [&](const HostPlanes& planes) {
        return output.name == planes.color.name || output.name == planes.depth.name ||
               output.name == planes.motion.name || output.name == planes.exposure.name;
    };
    return has(*this) || output.name == mask.name || std::ranges::any_of(neighbors, has);
}

bool HostFrame::output_is_color() const {
    return output.name != 0 && output.name == color.name && given->output.x == given->color.x &&
           given->output.y == given->color.y && output.image == color.image;
}

bool HostFrame::output_holds_color() const {
    const float most = output.format->largest();
    return most == 0 || (color.format->half && color.format->largest() <= most);
}

uint32_t HostPlanes::arrays() const {
    return (color.array ? GUEST_ARRAY_COLOR : 0) | (depth.array ? GUEST_ARRAY_DEPTH : 0) |
           (motion.array ? GUEST_ARRAY_MOTION : 0);
}

uint32_t HostFrame::all_arrays() const {
    uint32_t all = arrays() | (mask.array ? GUEST_ARRAY_MASK : 0);
    for (size_t i = 0; i < neighbors.size(); ++i)
        all |= neighbors[i].arrays() << kArrayBits * (i + 1);
    return all;
}

glm::dmat3 clip_directions(const float (&columns)[16]) {
    glm::dmat3 matrix;
    for (int column = 0; column < 3; ++column) {
        const float* c = columns + 4 * column;
        matrix[column] = {c[0], c[1], c[3]};
    }
    return matrix;
}

FrameDescription describe(const HostFrame& frame, const Chain& chain) {
    const pc_frame& given = *frame.given;
    FrameDescription description;
    description.width = description.display_width = frame.plane_width();
    description.height = description.display_height = frame.plane_height();
    description.pixel_aspect = double(scale_of(given.pixel_aspect));
    description.frame_number = int(given.frame_number & 0x7fffffff);
    description.planes = {Role::color};
    if (frame.depth.name) description.planes.add(Role::inverse_depth);
    if (frame.motion.name) description.planes.add(Role::motion);
    for (const Neighbor neighbor : kNeighbors)
        if (frame.neighbors[size_t(neighbor)].given)
            for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
                description.planes.add(role_of(neighbor, role));
    if (frame.shows_fill() || frame.halved()) {
        description.planes.add(Role::layers);
        description.layers = 1;
        description.fill_layer = frame.shows_fill() ? 0 : -1;
        description.bounds.layers_are_half = true;
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
    bounds.color_is_half = frame.color_is_half();
    if (given.max_speed_px > 0)
        bounds.max_speed_px = double(given.max_speed_px) * (frame.halved() ? 0.5 : 1);
    if (given.nearest > 0) bounds.max_inverse_depth = 1 / double(given.nearest);
    if (given.farthest > 0) bounds.min_inverse_depth = 1 / double(given.farthest);
    return description;
}

PlanKey key_of(const HostFrame& frame, const MaxFrameSize& max_size, uint64_t chain,
               uint64_t revision) {
    const pc_frame& given = *frame.given;
    PlanKey key;
    key.chain = chain;
    key.revision = revision;
    key.max_size = max_size;
    key.flags = given.flags & (PC_TOP_LEFT | kPlanFlags);
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
                 frame.output.format && frame.output_holds_color(),
                 frame.motion_by_depth()};
    for (size_t i = 0; i < frame.neighbors.size(); ++i) {
        const HostPlanes& planes = frame.neighbors[i];
        if (!planes.given) continue;
        const bool cases[] = {planes.color_is_plane(),  planes.depth_in_place(),
                              planes.motion_in_place(), planes.sky,
                              planes.color_is_half(),   planes.motion_by_depth()};
        uint32_t bits = 1;
        for (const bool one : cases) bits = 2 * bits + one;
        key.neighbors[i] = bits;
    }
    key.arrays = frame.all_arrays();
    if (given.debug_view) std::strncpy(key.debug_view.data(), given.debug_view, kLongestView);
    return key;
}

FrameKind kind_of(const HostFrame& frame, uint64_t chain, uint64_t revision) {
    FrameKind kind{chain,
                   revision,
                   frame.given->flags & kPlanFlags,
                   frame.depth.name != 0,
                   frame.motion.name != 0,
                   frame.mask.name != 0,
                   frame.exposure.name != 0,
                   frame.neighbors[size_t(Neighbor::before)].given != nullptr,
                   frame.neighbors[size_t(Neighbor::after)].given != nullptr,
                   frame.all_arrays(),
                   {}};
    if (frame.given->debug_view)
        std::strncpy(kind.debug_view.data(), frame.given->debug_view, kLongestView);
    return kind;
}

std::string difference_text(const FrameKind& kind, const std::vector<FrameKind>& prepared,
                            const std::string& prepare) {
    const FrameKind* nearest = nullptr;
    for (const FrameKind& other : prepared)
        if (other.chain == kind.chain &&
            (!nearest || differences(kind, other) <= differences(kind, *nearest)))
            nearest = &other;
    if (!nearest) return prepare + " was not called for this chain";
    const auto given = [&](const char* member, bool now) {
        return concat(member, now ? ": given, and not" : ": not given, but", " to ", prepare);
    };
    const auto flag = [&](const char* name, uint32_t bit) {
        return concat("flags: ", name,
                      (kind.flags & bit) != 0 ? ", and not" : " is missing, but set", " in ",
                      prepare);
    };
    const std::string remedy = concat("; call ", prepare, " with a frame like this one");
    const uint32_t flags = kind.flags ^ nearest->flags;
    if (kind.debug_view != nearest->debug_view)
        return concat("debug_view: ", prepare, " was not called with \"", kind.debug_view.data(),
                      "\"", remedy);
    if ((flags & PC_HALF_PLANES) != 0) return flag("PC_HALF_PLANES", PC_HALF_PLANES) + remedy;
    if ((flags & PC_HALF_RESOLUTION) != 0)
        return flag("PC_HALF_RESOLUTION", PC_HALF_RESOLUTION) + remedy;
    if ((flags & PC_FAST_MATH) != 0) return flag("PC_FAST_MATH", PC_FAST_MATH) + remedy;
    if (flags != 0) return flag("PC_NO_ELISION", PC_NO_ELISION) + remedy;
    if (kind.exposure != nearest->exposure) return given("exposure", kind.exposure) + remedy;
    if (kind.depth && !nearest->depth) return given("depth", true) + remedy;
    if (kind.motion && !nearest->motion) return given("motion", true) + remedy;
    if (kind.mask && !nearest->mask) return given("mask", true) + remedy;
    if (kind.before && !nearest->before) return given("before", true) + remedy;
    if (kind.after && !nearest->after) return given("after", true) + remedy;
    constexpr uint32_t kBefore = 1 << kArrayBits, kAfter = kBefore << kArrayBits;
    const std::pair<const char*, uint32_t> slices[] = {
        {"color", GUEST_ARRAY_COLOR},
        {"depth", GUEST_ARRAY_DEPTH},
        {"motion", GUEST_ARRAY_MOTION},
        {"mask", GUEST_ARRAY_MASK},
        {"before.color", kBefore * GUEST_ARRAY_COLOR},
        {"before.depth", kBefore * GUEST_ARRAY_DEPTH},
        {"before.motion", kBefore * GUEST_ARRAY_MOTION},
        {"after.color", kAfter * GUEST_ARRAY_COLOR},
        {"after.depth", kAfter * GUEST_ARRAY_DEPTH},
        {"after.motion", kAfter * GUEST_ARRAY_MOTION}};
    for (const auto& [name, bit] : slices)
        if (((kind.arrays ^ nearest->arrays) & bit) != 0)
            return concat(name, "_slice.target: ", (kind.arrays & bit) != 0 ? "an" : "not an",
                          " array, unlike in ", prepare, remedy);
    return concat("the chain's values were changed since ", prepare, remedy);
}

shared::GuestUniforms uniforms_of(const HostPlanes& planes) {
    const pc_frame& given = *planes.given;
    shared::GuestUniforms uniforms{};
    uniforms.size = {planes.plane_width(), planes.plane_height()};
    uniforms.full_size = {planes.width, planes.height};
    uniforms.color_at = {given.color.x, given.color.y};
    uniforms.depth_at = {given.depth.x, given.depth.y};
    uniforms.motion_at = {given.motion.x, given.motion.y};
    uniforms.exposure_at = {given.exposure.x, given.exposure.y};
    uniforms.depth_size = {planes.depth.width, planes.depth.height};
    uniforms.motion_size = {planes.motion.width, planes.motion.height};
    const auto each = [&](int ImageOf::*member) {
        return glm::ivec4(planes.color.image.*member, planes.depth.image.*member,
                          planes.motion.image.*member, 0);
    };
    uniforms.slices = each(&ImageOf::slice);
    uniforms.levels = each(&ImageOf::level);
    if (planes.has_depth_range()) {
        uniforms.clips = 1;
        uniforms.depth_first = given.depth_range[0];
        uniforms.depth_factor = 1 / (given.depth_range[1] - given.depth_range[0]);
    }
    uniforms.bottom_up = planes.top_left() ? 0 : 1;
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
    const bool to_next = planes.flag(PC_MOTION_TO_NEXT);
    const float part = planes.halved() ? 0.5f : 1.0f;  // pixels of the planes in one of the frame
    uniforms.motion_scale = {part * scale_of(given.motion_scale[0]),
                             part * scale_of(given.motion_scale[1])};
    uniforms.motion_bias = {given.motion_bias[0], given.motion_bias[1]};
    if (planes.flag(PC_MOTION_JITTERED)) {
        const float sign = to_next ? -1.0f : 1.0f;
        uniforms.motion_jitter = {part * sign * (given.jitter_px[0] - given.other_jitter_px[0]),
                                  part * sign * (given.jitter_px[1] - given.other_jitter_px[1])};
    }
    uniforms.gain = given.pre_exposure == 0 ? 1 : 1 / given.pre_exposure;
    if (planes.sky) {
        const glm::dmat3 there = clip_directions(given.other_view_projection) *
                                 glm::inverse(clip_directions(given.view_projection));
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

shared::GuestUniforms uniforms_of(const HostFrame& frame) {
    shared::GuestUniforms uniforms = uniforms_of(static_cast<const HostPlanes&>(frame));
    const pc_frame& given = *frame.given;
    uniforms.output_at = {given.output.x, given.output.y};
    uniforms.mask_at = {given.mask.x, given.mask.y};
    uniforms.slices.w = frame.mask.image.slice;
    uniforms.levels.w = frame.mask.image.level;
    const float most = frame.output.format ? frame.output.format->largest() : 0;
    uniforms.output_max = most == 0 ? FLT_MAX : most;
    if (frame.focus) set_places(frame, uniforms);
    return uniforms;
}

}  // namespace postchain::guest

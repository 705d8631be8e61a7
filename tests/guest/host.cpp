#include "tests/guest/host.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>

#include "tests/support/gpu.h"
#include "tests/support/transcript.h"

namespace postchain::test {
namespace {

GLenum external(int channels) {
    return channels == 1 ? GL_RED : channels == 2 ? GL_RG : channels == 3 ? GL_RGB : GL_RGBA;
}

bool is_depth(unsigned format) {
    return format == GL_DEPTH_COMPONENT32F || format == GL_DEPTH_COMPONENT24;
}

}  // namespace

HostTexture::HostTexture(unsigned format, int width, int height) {
    make_host_context();
    glCreateTextures(GL_TEXTURE_2D, 1, &texture_.name);
    glTextureStorage2D(texture_.name, 1, format, width, height);
    texture_.internal_format = format;
    texture_.width = width;
    texture_.height = height;
}

HostTexture::HostTexture(unsigned format, const ImageF& pixels, bool bottom_up)
    : HostTexture(format, pixels.width, pixels.height) {
    const ImageF turned = bottom_up ? upside_down(pixels) : pixels;
    glTextureSubImage2D(texture_.name, 0, 0, 0, pixels.width, pixels.height,
                        is_depth(format) ? GL_DEPTH_COMPONENT : external(pixels.channels), GL_FLOAT,
                        turned.data.data());
}

HostTexture HostTexture::inside(unsigned format, const ImageF& pixels, int width, int height, int x,
                                int y) {
    ImageF around(width, height, pixels.channels, 77.0f);
    for (int row = 0; row < pixels.height; ++row)
        std::copy_n(pixels.pixel(0, row), size_t(pixels.width) * size_t(pixels.channels),
                    around.pixel(x, y + row));
    HostTexture texture(format, around);
    texture.texture_.x = x;
    texture.texture_.y = y;
    return texture;
}

HostTexture::~HostTexture() {
    if (texture_.name) glDeleteTextures(1, &texture_.name);
}

HostTexture::HostTexture(HostTexture&& other) noexcept
    : texture_(std::exchange(other.texture_, {})) {}

ImageF read(const pc_texture& texture, int width, int height, int channels) {
    ImageF pixels(width, height, channels);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glGetTextureSubImage(texture.name, 0, texture.x, texture.y, 0, width, height, 1,
                         external(channels), GL_FLOAT, GLsizei(pixels.data.size() * sizeof(float)),
                         pixels.data.data());
    return pixels;
}

ImageF upside_down(const ImageF& image) {
    ImageF turned = image;
    const size_t row = size_t(image.width) * size_t(image.channels);
    for (int y = 0; y < image.height; ++y)
        std::copy_n(image.pixel(0, y), row, turned.pixel(0, image.height - 1 - y));
    return turned;
}

ImageF with_y_up(ImageF motion) {
    for (size_t i = 1; i < motion.data.size(); i += 2) motion.data[i] = -motion.data[i];
    return motion;
}

HostFrameTextures canonical_frame(int width, int height, uint32_t seed) {
    TestFrame test = layered_frame(width, height, {9.5f, -4}, {-3, 1}, seed);
    // A host passes floats, so values are rounded to float.
    Camera& camera = test.description.camera;
    for (auto* value : {&camera.focal_length_mm, &camera.sensor_width_mm, &camera.f_stop,
                        &camera.focus_distance, &camera.meters_per_unit, &camera.shutter_frames})
        if (*value) *value = double(float(**value));
    camera.near_clip = camera.far_clip = std::nullopt;
    HostTexture color(GL_RGBA32F, test.planes.at(Role::color));
    HostTexture depth(GL_R32F, test.planes.at(Role::inverse_depth));
    HostTexture motion(GL_RG32F, test.planes.at(Role::motion));
    auto frame = pc::make<pc_frame>();
    frame.flags = PC_TOP_LEFT | PC_MOTION_TO_NEXT;
    frame.color = color;
    frame.depth = depth;
    frame.motion = motion;
    frame.depth_encoding = PC_DEPTH_INVERSE;
    frame.focal_length_mm = float(camera.focal_length_mm.value_or(0));
    frame.sensor_width_mm = float(camera.sensor_width_mm.value_or(0));
    frame.f_stop = float(camera.f_stop.value_or(0));
    frame.focus_distance = float(camera.focus_distance.value_or(0));
    frame.meters_per_unit = float(camera.meters_per_unit.value_or(0));
    frame.shutter_frames = float(camera.shutter_frames.value_or(0));
    return {std::move(test), std::move(color), std::move(depth), std::move(motion), frame};
}

HostNeighbor neighbor_of(const HostFrameTextures& host, Neighbor neighbor) {
    TestFrame test = host.test;
    add_neighbors(test);
    FramePlanes planes;
    for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
        planes[role] = test.planes.at(role_of(neighbor, role));
    HostTexture color(GL_RGBA32F, planes.at(Role::color));
    HostTexture depth(GL_R32F, planes.at(Role::inverse_depth));
    HostTexture motion(GL_RG32F, planes.at(Role::motion));
    pc_frame frame = host.frame;
    frame.color = color;
    frame.depth = depth;
    frame.motion = motion;
    return {std::move(planes), std::move(color), std::move(depth), std::move(motion), frame};
}

TestFrame with_neighbor(TestFrame frame, const HostNeighbor& made, Neighbor neighbor) {
    for (const auto& [role, plane] : made.planes) {
        frame.description.planes.add(role_of(neighbor, role));
        frame.planes[role_of(neighbor, role)] = plane;
    }
    return frame;
}

pc::Instance instance(uint32_t flags, pc_state state) {
    make_host_context();
    auto info = pc::create_info();
    info.flags = flags;
    info.state = state;
    pc::Instance made = pc::create(info);
    EXPECT_TRUE(made) << pc_create_error();
    return made;
}

pc::Chain chain(const char* passes) {
    pc::Chain made = pc::chain(passes);
    EXPECT_TRUE(made) << pc_create_error();
    return made;
}

pc::Chain paper_chain(const char* passes) {
    pc::Chain made = chain(passes);
    EXPECT_EQ(pc_chain_set_text(made.get(), 0, "mode", "guertin"), PC_OK);
    EXPECT_EQ(pc_chain_set_text(made.get(), 1, "method", "gilham"), PC_OK);
    return made;
}

void set(const pc::Chain& chain, uint32_t pass, const char* key, double value) {
    EXPECT_EQ(pc_chain_set_number(chain.get(), pass, key, value), PC_OK)
        << pc_chain_error(chain.get());
}

pc::Chain focused(double x, double y) {
    pc::Chain made = chain("depth_of_field");
    EXPECT_EQ(pc_chain_set_point(made.get(), 0, "focus_at", x, y), PC_OK) << pc_error();
    return made;
}

ImageF by_executor(const TestFrame& frame, const Chain& chain, Precision precision, Role plane) {
    FrameDescription description = frame.description;
    description.bounds.max_speed_px = FrameBounds::kUnknown;
    PlanOptions options;
    options.precision = precision;
    make_host_context();
    static Executor executor(gl::describe_current());
    const auto plan = make_plan(chain, description, options);
    EXPECT_TRUE(plan.ok()) << plan.status().message();
    auto result = executor.filter(*plan, frame.planes);
    EXPECT_TRUE(result.ok()) << result.status().message();
    return result->at(plane);
}

ImageF by_executor(const TestFrame& frame, const char* passes, Precision precision, Role plane) {
    Chain chain;
    std::istringstream names(passes);
    for (std::string name; std::getline(names, name, ',');) append(chain, name);
    return by_executor(frame, chain, precision, plane);
}

void prepare(const pc::Instance& instance, const pc::Chain& chain, const pc_frame& frame) {
    EXPECT_EQ(pc_prepare(instance.get(), chain.get(), &frame, 1), PC_OK) << pc_error();
}

pc_texture run(const pc::Instance& instance, const pc::Chain& chain, const pc_frame& frame) {
    pc_texture result = {};
    EXPECT_EQ(pc_run(instance.get(), chain.get(), &frame, &result), PC_OK) << pc_error();
    return result;
}

pc_texture prepare_and_run(const pc::Instance& instance, const pc::Chain& chain,
                           const pc_frame& frame) {
    prepare(instance, chain, frame);
    return run(instance, chain, frame);
}

void expect_error(pc_result found, pc_result code, const std::string& text) {
    Transcript::say(concat(pc_result_name(found), " ", pc_error()));
    EXPECT_EQ(found, code) << text;
    EXPECT_NE(std::string(pc_error()).find(text), std::string::npos)
        << pc_error() << " without " << text;
}

void expect_refused(pc_result found) {
    Transcript::say(concat(pc_result_name(found), " ", pc_error()));
    EXPECT_NE(found, PC_OK);
}

void say(const pc_counters& c) {
    Transcript::say(concat("frames ", c.frames, ", dispatches ", c.dispatches, ", barriers ",
                           c.barriers, ", programs ", c.programs, ", loaded ", c.programs_loaded,
                           ", plans ", c.plans_made, ", texture allocations ",
                           c.texture_allocations, ", alive ", c.textures_alive, ", bytes ",
                           c.texture_bytes, ", peak ", c.texture_bytes_peak));
}

void say(const pc_frame_needs& needs) {
    Transcript::say(concat("textures ", needs.textures, ", bytes ", needs.texture_bytes,
                           ", programs ", needs.programs, ", to compile ",
                           needs.programs_to_compile));
}

pc_counters count(const pc::Instance& instance) {
    auto counters = pc::make<pc_counters>();
    EXPECT_EQ(pc_count(instance.get(), &counters), PC_OK) << pc_error();
    return counters;
}

void expect_nothing_made(const pc_counters& before, const pc_counters& after) {
    EXPECT_EQ(after.plans_made, before.plans_made);
    EXPECT_EQ(after.texture_allocations, before.texture_allocations);
    EXPECT_EQ(after.textures_alive, before.textures_alive);
    EXPECT_EQ(after.texture_bytes, before.texture_bytes);
    EXPECT_EQ(after.programs, before.programs);
}

std::unique_ptr<SharedScene::Shared> SharedScene::shared_;

void SharedScene::SetUpTestSuite() {
    shared_ = std::make_unique<Shared>();
}

void expect_equal(const ImageF& found, const ImageF& expected) {
    EXPECT_TRUE(equal_bits(found, expected)) << compare(found, expected, 0).text;
}

void expect_near(const ImageF& found, const ImageF& expected, double tolerance, double fraction) {
    const Difference difference = compare(found, expected, tolerance);
    EXPECT_LE(difference.fraction, fraction) << difference.text;
}

}  // namespace postchain::test

#include "tools/scenes/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "chain/gl/debug.h"
#include "chain/gl/program.h"
#include "tools/scenes/cull.h"

namespace postchain::scenes {
namespace {

constexpr int kMaxSide = 16384;
constexpr int kMaxSamples = 65536;
// Samples per dispatch: few enough that culling by time stays tight and a stop is noticed soon.
constexpr int kSamplesPerDispatch = 8;

enum Storage { poses, objects, tiles, letters, points, color_sums, vector_sums, depths, kStorages };

glm::vec4 row_of(const Pose& pose, int row) {
    return {float(pose.rotation[0][row]), float(pose.rotation[1][row]),
            float(pose.rotation[2][row]), float(pose.position[row])};
}

void append_rows(std::vector<glm::vec4>& rows, const Pose& pose) {
    for (int row = 0; row < 3; ++row) rows.push_back(row_of(pose, row));
}

std::vector<glm::vec4> rows_of(const std::vector<Instant>& instants, const ImageGeometry& picture) {
    std::vector<glm::vec4> rows;
    for (const Instant& instant : instants) {
        append_rows(rows, instant.camera.pose);
        rows.push_back({float(picture.focal_px(instant.camera)), 0, 0, 0});
        for (const Pose& pose : instant.objects) append_rows(rows, pose);
    }
    return rows;
}

std::vector<shared::SceneObject> records_of(const SceneModel& model) {
    std::vector<shared::SceneObject> records;
    for (const Object& object : model.objects)
        records.push_back({glm::vec4(object.size), glm::vec4(object.hole),
                           glm::vec4(object.color, object.lamp),
                           glm::vec4(object.color_b, object.gloss),
                           glm::vec4(object.pattern, object.period, object.pattern_extra),
                           glm::vec4(int(object.shape), object.alpha, 0, 0)});
    return records;
}

bool has_disc(const SceneModel& model) {
    const Camera& lens = model.lens;
    return lens.aperture_blades.value_or(0) < 3 && !lens.aperture_image &&
           lens.aperture_ratio == 1 && lens.cats_eye == 0;
}

// Van der Corput's sequence in base 2 and Sobol's second dimension: the generator matrices are the
// identity and Pascal's triangle modulo 2.
double van_der_corput(uint32_t i) {
    uint32_t bits = 0;
    for (int bit = 0; bit < 32; ++bit) bits |= ((i >> bit) & 1) << (31 - bit);
    return bits * 0x1p-32;
}

double sobol(uint32_t i) {
    uint32_t bits = 0;
    for (uint32_t column = 1u << 31; i != 0; i >>= 1, column ^= column >> 1)
        if (i & 1) bits ^= column;
    return bits * 0x1p-32;
}

float fraction(double value) {
    const float rest = float(value - std::floor(value));
    return rest < 1 ? rest : 0;  // rounded up
}

int groups(int side) {
    return (side + SCENE_TILE - 1) / SCENE_TILE;
}

}  // namespace

std::vector<glm::vec4> sample_points(int count, bool lens) {
    constexpr double kPlastic = 1.32471795724474602596;
    std::vector<glm::vec4> points(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double half = 0.5 / count;
        const glm::vec2 even(fraction(van_der_corput(uint32_t(i)) + half),
                             fraction(sobol(uint32_t(i)) + half));
        const glm::vec2 other(fraction(0.5 + i / kPlastic),
                              fraction(0.5 + i / (kPlastic * kPlastic)));
        points[size_t(i)] = lens ? glm::vec4(even, other) : glm::vec4(other, even);
    }
    return points;
}

ProgramKey program_for(const SceneModel& model, bool vectors, bool lens, bool behind) {
    int shapes = 0, casters = 0, patterns = 0;
    for (const Object& object : model.objects) {
        shapes |= 1 << int(object.shape);
        if (object.casts) casters |= 1 << int(object.shape);
        patterns |= 1 << object.pattern;
    }
    return {"scenes/render.comp",
            {{"SHAPES", concat(shapes)},
             {"CASTERS", concat(casters)},
             {"PATTERNS", concat(patterns)},
             {"DISC", lens && !has_disc(model) ? "0" : "1"},
             {"APERTURE_IMAGE", lens && model.lens.aperture_image ? "1" : "0"},
             {"VECTORS", vectors ? "1" : "0"},
             {"BEHIND", behind ? "1" : "0"}}};
}

struct SceneRenderer::Impl {
    std::unique_ptr<egl::Context> context;
    gl::ProgramCache programs;
    std::array<GLuint, kStorages> storage{};
    GLuint block = 0;
    GLuint aperture = 0;  // image texture

    void set_aperture(const BokehKernel& image) {
        constexpr int kSide = BokehKernel::kSide;
        std::vector<float> values = image.values();
        float most = 0;  // largest value of a cell that the unit disc touches
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x)
                if (std::hypot(x + 0.5 - kSide / 2, y + 0.5 - kSide / 2) < kSide / 2 + 1)
                    most = std::max(most, values[size_t(y * kSide + x)]);
        for (float& value : values) value /= most;
        glTextureSubImage2D(aperture, 0, 0, 0, kSide, kSide, GL_RED, GL_FLOAT, values.data());
        glBindTextureUnit(0, aperture);
    }
    template <class T>
    void set(Storage which, const std::vector<T>& values) {
        // Empty buffers cannot be bound.
        static const std::array<std::byte, 16> none{};
        const bool empty = values.empty();
        glNamedBufferData(
            storage[which], GLsizeiptr(empty ? none.size() : values.size() * sizeof(T)),
            empty ? static_cast<const void*>(none.data()) : values.data(), GL_DYNAMIC_DRAW);
    }
    void reserve(Storage which, size_t bytes) {
        glNamedBufferData(storage[which], GLsizeiptr(bytes), nullptr, GL_DYNAMIC_READ);
    }
    ImageF mean(Storage which, int width, int height, int channels, int samples) {
        ImageF image(width, height, channels);
        glGetNamedBufferSubData(storage[which], 0, GLsizeiptr(image.data.size() * sizeof(float)),
                                image.data.data());
        for (float& value : image.data) value = float(double(value) / samples);
        return image;
    }
};

SceneRenderer::SceneRenderer() : impl_(std::make_unique<Impl>()) {}

SceneRenderer::~SceneRenderer() {
    if (!impl_->context || !impl_->context->make_current().ok()) return;
    glDeleteBuffers(kStorages, impl_->storage.data());
    glDeleteBuffers(1, &impl_->block);
    glDeleteTextures(1, &impl_->aperture);
}

const gl::Device& SceneRenderer::device() const {
    return impl_->context->device();
}

Result<std::unique_ptr<SceneRenderer>> SceneRenderer::create(const egl::ContextOptions& options) {
    ASSIGN_OR_RETURN(auto context, egl::Context::create(options));
    std::unique_ptr<SceneRenderer> renderer(new SceneRenderer);
    renderer->impl_->context = std::move(context);
    glCreateBuffers(kStorages, renderer->impl_->storage.data());
    glCreateBuffers(1, &renderer->impl_->block);
    glCreateTextures(GL_TEXTURE_2D, 1, &renderer->impl_->aperture);
    glTextureStorage2D(renderer->impl_->aperture, 1, GL_R32F, BokehKernel::kSide,
                       BokehKernel::kSide);
    return renderer;
}

Result<ScenePlanes> SceneRenderer::render(const SceneModel& model, const RenderSettings& settings,
                                          const Progress& progress) {
    const int width = settings.width, height = settings.height, samples = settings.samples;
    if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide)
        return Status(StatusCode::usage, concat("a scene's size must be 1x1 to ", kMaxSide, "x",
                                                kMaxSide, ", not ", width, "x", height));
    if (samples < 1 || samples > kMaxSamples)
        return Status(StatusCode::usage,
                      concat("a scene's samples must be 1 to ", kMaxSamples, ", not ", samples));
    Impl& gl = *impl_;
    RETURN_IF_ERROR(gl.context->make_current());
    ASSIGN_OR_RETURN(
        const auto program,
        gl.programs.get(program_for(model, settings.vectors, settings.lens, settings.behind)));

    const Instant now = instant_of(model, settings.time);
    ImageGeometry picture{width, height, *model.lens.sensor_width_mm, 0, now.camera.focus_distance};
    if (settings.lens)
        picture.lens_radius = lens_radius(now.camera.focal_length_mm, *model.lens.f_stop);

    const bool noisy = settings.lens || settings.shutter_frames > 0;
    shared::SceneUniforms block{};
    block.size = {width, height};
    block.tiles = {groups(width), groups(height)};
    block.object_count = int(model.objects.size());
    block.pose_step = settings.shutter_frames > 0 ? 1 : 0;
    block.seed = settings.seed;
    block.rotate_samples = noisy ? 1 : 0;
    block.lens_radius = float(picture.lens_radius);
    block.focus_distance = float(picture.focus_distance);
    block.aperture_blades = model.lens.aperture_blades.value_or(0);
    block.aperture_rotation = float(glm::radians(*model.lens.aperture_rotation_deg));
    block.aperture_curvature = float(model.lens.aperture_curvature.value_or(0));
    block.aperture_ratio = float(*model.lens.aperture_ratio);
    block.barrel_per_px = float(*model.lens.cats_eye / (0.5 * std::hypot(width, height)));
    block.light = glm::vec4(glm::normalize(model.light), model.light_strength);
    block.zenith = glm::vec4(model.zenith, model.background_opaque ? 1 : 0);
    block.horizon = glm::vec4(model.horizon, model.clouds);
    block.ambient = glm::vec4(model.ambient, model.ambient_below);

    const size_t pixels = size_t(width) * size_t(height);
    gl.set(objects, records_of(model));
    gl.set(letters, model.letters);
    gl.set(points, sample_points(samples, settings.lens));
    if (settings.lens && model.lens.aperture_image) gl.set_aperture(model.lens.aperture_image);
    gl.reserve(color_sums, pixels * sizeof(glm::vec4));
    gl.reserve(vector_sums, settings.vectors ? pixels * sizeof(glm::vec4) : sizeof(glm::vec4));
    gl.reserve(depths, settings.vectors ? pixels * sizeof(float) : sizeof(float));
    RETURN_IF_ERROR(gl::check_error("allocating a scene"));

    glUseProgram(program.name);
    for (GLuint i = 0; i < kStorages; ++i)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, gl.storage[i]);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, gl.block);

    for (int first = 0; first < samples; first += kSamplesPerDispatch) {
        block.first_sample = first;
        block.sample_count = std::min(kSamplesPerDispatch, samples - first);
        if (block.pose_step != 0 || first == 0) {
            std::vector<Instant> instants{now};
            if (block.pose_step != 0) {
                instants.clear();
                for (int i = first; i < first + block.sample_count; ++i)
                    instants.push_back(instant_of(
                        model, settings.time + settings.shutter_center +
                                   settings.shutter_frames * ((i + 0.5) / samples - 0.5)));
            }
            const CellLists lists = cull(model, instants, picture);
            gl.set(tiles, lists.entry);
            const glm::dvec2 first_cell = -lists.grid.first * lists.grid.cells_per_unit;
            block.light_right = glm::vec4(lists.grid.right, first_cell.x);
            block.light_up = glm::vec4(lists.grid.up, first_cell.y);
            block.light_cells = lists.grid.cells_per_unit;
            block.light_lists = int(lists.lights);
            if (settings.vectors) {
                instants.push_back(instant_of(model, settings.time - 1));
                instants.push_back(instant_of(model, settings.time + 1));
            }
            gl.set(poses, rows_of(instants, picture));
        }
        glNamedBufferData(gl.block, sizeof(block), &block, GL_DYNAMIC_DRAW);
        glDispatchCompute(GLuint(block.tiles.x), GLuint(block.tiles.y), 1);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
        if (!progress) continue;
        glFinish();
        if (!progress(double(first + block.sample_count) / samples))
            return Status(StatusCode::canceled, "stopped while rendering a scene");
    }

    ScenePlanes planes;
    planes.color = gl.mean(color_sums, width, height, 4, samples);
    if (settings.vectors) {
        planes.vectors = gl.mean(vector_sums, width, height, 4, samples);
        planes.depth = gl.mean(depths, width, height, 1, 1);
    }
    RETURN_IF_ERROR(gl::check_error("rendering a scene"));
    return planes;
}

double lens_radius(double focal_length_mm, double f_stop) {
    return focal_length_mm / 1000 / (2 * f_stop);
}

double circle_of_confusion_px(double focal_length_mm, double f_stop, double sensor_width_mm,
                              double focus_distance, double z, int width) {
    const double f = focal_length_mm / 1000;
    return f * f / f_stop * std::abs(z - focus_distance) / (z * focus_distance) * width /
           (sensor_width_mm / 1000);
}

}  // namespace postchain::scenes

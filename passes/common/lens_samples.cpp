#include "passes/common/lens_samples.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "chain/pass/work_list.h"
#include "shaders/shared/lens_samples_uniforms.h"

namespace postchain::lens {
namespace {

constexpr int kMaxSets = 64;  // more show no difference
constexpr double kUnit = 32767;

int16_t packed(double x) {
    return int16_t(std::lround(std::clamp(x, -1.0, 1.0) * kUnit));
}

// A point of an image: as by an outline, but equal steps are equal shares of light.
std::array<double, 2> image_point(const Aperture& aperture, double within, double turns) {
    const auto [x, y] = aperture.image.point(within, turns);
    const double angle = aperture.rotation_deg * std::numbers::pi / 180;
    const double c = std::cos(angle), s = std::sin(angle);
    const auto half_size = aperture.half_size();
    return {half_size[0] * (c * x + s * y), half_size[1] * (c * y - s * x)};
}

std::unique_ptr<shared::LensSamplesUniforms> packed_table(const Points& points) {
    auto uniforms = std::make_unique<shared::LensSamplesUniforms>();
    uniforms->points = points.count;
    uniforms->sets = points.sets;
    for (size_t i = 0; i < points.packed.size(); ++i) {
        const auto& [x, y] = points.packed[i];
        uniforms->packed_points[i / 4][int(i % 4)] = int(uint16_t(x) | uint32_t(uint16_t(y)) << 16);
    }
    return uniforms;
}

// Computing the points takes longer than the rest of a plan, and the next plan of a thread almost
// always has the same lens: the last table stays. Behind a pointer, because a host's threads would
// hold 16 KiB each.
const shared::LensSamplesUniforms& table_of(const Aperture& aperture, int count) {
    using Key = std::pair<uint64_t, int>;
    thread_local std::optional<Key> last;
    thread_local std::unique_ptr<const shared::LensSamplesUniforms> uniforms;
    const Key key = {hash_of(aperture), count};
    if (last != key) uniforms = packed_table(lens_samples(aperture, count));
    last = key;
    return *uniforms;
}

}  // namespace

std::array<double, 2> Points::at(int point, int set) const {
    const auto& p = packed[size_t(set * count + point)];
    return {p[0] / kUnit, p[1] / kUnit};
}

int sets_of(int count) {
    return std::min(kMaxSets, LENS_SAMPLES_MAX / count);
}

Points lens_samples(const Aperture& aperture, int count) {
    const Outline outline(aperture);
    Points points;
    points.count = count;
    points.sets = sets_of(points.count);
    for (int set = 0; set < points.sets; ++set) {
        for (int point = 0; point < count; ++point) {
            const double within = (point + 0.5) / count;
            const double turns = point / std::numbers::phi + double(set) / points.sets;
            if (aperture.image) {
                const auto [x, y] = image_point(aperture, within, turns);
                points.packed.push_back({packed(x), packed(y)});
            } else {
                const auto [x, y] = outline.at(turns);
                const double radius = std::sqrt(within);
                points.packed.push_back({packed(radius * x), packed(radius * y)});
            }
        }
    }
    return points;
}

TextureId add_table(PassPlanner& planner, const Aperture& aperture, int count) {
    const shared::LensSamplesUniforms& uniforms = table_of(aperture, count);
    const Area size = Area::fixed(uniforms.points, uniforms.sets);
    const TextureId table = planner.texture("lens_samples", Format::rgba32f, size);
    Step step;
    step.name = "lens_samples";
    step.program = {"common/lens_samples.comp", {}};
    step.set_uniforms(uniforms);
    step.bindings = {{0, table, Access::write}};
    step.spread = groups_for(size);
    planner.step(std::move(step));
    return table;
}

}  // namespace postchain::lens

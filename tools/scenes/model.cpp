#include "tools/scenes/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <string_view>
#include <utility>

namespace postchain::scenes {

Pose operator*(const Pose& outer, const Pose& inner) {
    return {outer.rotation * inner.rotation, outer.to_world(inner.position)};
}

glm::dmat3 turn(glm::dvec3 axis, double angle) {
    // Rodrigues: cos I + (1 - cos) a a^T + sin [a]x, columns.
    const double c = std::cos(angle), s = std::sin(angle), k = 1 - c;
    const glm::dvec3 a = axis;
    return {{c + k * a.x * a.x, k * a.x * a.y + s * a.z, k * a.x * a.z - s * a.y},
            {k * a.x * a.y - s * a.z, c + k * a.y * a.y, k * a.y * a.z + s * a.x},
            {k * a.x * a.z + s * a.y, k * a.y * a.z - s * a.x, c + k * a.z * a.z}};
}

Pose at(glm::dvec3 position, glm::dmat3 rotation) {
    return {rotation, position};
}

PoseAt still(const Pose& pose) {
    return [pose](double) { return pose; };
}

namespace {

// Font for signs, 5x7 dots.
constexpr std::string_view kSet = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ./-";
constexpr uint8_t kColumns[][5] = {
    {0x3e, 0x51, 0x49, 0x45, 0x3e}, {0x00, 0x42, 0x7f, 0x40, 0x00}, {0x42, 0x61, 0x51, 0x49, 0x46},
    {0x21, 0x41, 0x45, 0x4b, 0x31}, {0x18, 0x14, 0x12, 0x7f, 0x10}, {0x27, 0x45, 0x45, 0x45, 0x39},
    {0x3c, 0x4a, 0x49, 0x49, 0x30}, {0x01, 0x71, 0x09, 0x05, 0x03}, {0x36, 0x49, 0x49, 0x49, 0x36},
    {0x06, 0x49, 0x49, 0x29, 0x1e}, {0x7e, 0x11, 0x11, 0x11, 0x7e}, {0x7f, 0x49, 0x49, 0x49, 0x36},
    {0x3e, 0x41, 0x41, 0x41, 0x22}, {0x7f, 0x41, 0x41, 0x22, 0x1c}, {0x7f, 0x49, 0x49, 0x49, 0x41},
    {0x7f, 0x09, 0x09, 0x09, 0x01}, {0x3e, 0x41, 0x49, 0x49, 0x7a}, {0x7f, 0x08, 0x08, 0x08, 0x7f},
    {0x00, 0x41, 0x7f, 0x41, 0x00}, {0x20, 0x40, 0x41, 0x3f, 0x01}, {0x7f, 0x08, 0x14, 0x22, 0x41},
    {0x7f, 0x40, 0x40, 0x40, 0x40}, {0x7f, 0x02, 0x0c, 0x02, 0x7f}, {0x7f, 0x04, 0x08, 0x10, 0x7f},
    {0x3e, 0x41, 0x41, 0x41, 0x3e}, {0x7f, 0x09, 0x09, 0x09, 0x06}, {0x3e, 0x41, 0x51, 0x21, 0x5e},
    {0x7f, 0x09, 0x19, 0x29, 0x46}, {0x46, 0x49, 0x49, 0x49, 0x31}, {0x01, 0x01, 0x7f, 0x01, 0x01},
    {0x3f, 0x40, 0x40, 0x40, 0x3f}, {0x1f, 0x20, 0x40, 0x20, 0x1f}, {0x3f, 0x40, 0x38, 0x40, 0x3f},
    {0x63, 0x14, 0x08, 0x14, 0x63}, {0x07, 0x08, 0x70, 0x08, 0x07}, {0x61, 0x51, 0x49, 0x45, 0x43},
    {0x00, 0x60, 0x60, 0x00, 0x00}, {0x20, 0x10, 0x08, 0x04, 0x02}, {0x08, 0x08, 0x08, 0x08, 0x08},
};
static_assert(sizeof(kColumns) / sizeof(kColumns[0]) == kSet.size());
constexpr int kLetterColumns = 6;  // the last one is the gap

// Columns from left to right, lowest bit at the top. Unknown letters are blank.
std::array<uint8_t, kLetterColumns> columns_of(char letter) {
    std::array<uint8_t, kLetterColumns> columns{};
    const size_t index = kSet.find(letter);
    if (index == std::string_view::npos) return columns;
    for (size_t i = 0; i < 5; ++i) columns[i] = kColumns[index][i];
    return columns;
}

Object shaped(Shape shape, glm::dvec4 size, PoseAt pose, glm::dvec3 color, double gloss) {
    Object object;
    object.shape = shape;
    object.size = size;
    object.pose = std::move(pose);
    object.color = color;
    object.gloss = gloss;
    return object;
}

}  // namespace

Object rectangle(double half_width, double half_height, PoseAt pose, glm::dvec3 color) {
    Object object =
        shaped(Shape::rectangle, {half_width, half_height, 0, 0}, std::move(pose), color, 0);
    object.casts = false;
    return object;
}

Object sphere(double radius, PoseAt pose, glm::dvec3 color) {
    return shaped(Shape::sphere, {radius, 0, 0, 0}, std::move(pose), color, 1);
}

Object box(glm::dvec3 half_size, PoseAt pose, glm::dvec3 color) {
    return shaped(Shape::box, {half_size, 0}, std::move(pose), color, 0.3);
}

Object rod(double half_length, double radius, PoseAt pose, glm::dvec3 color) {
    return shaped(Shape::rod, {half_length, radius, 0, 0}, std::move(pose), color, 0.5);
}

Object torus(double ring, double tube, PoseAt pose, glm::dvec3 color) {
    return shaped(Shape::torus, {ring, tube, 0, 0}, std::move(pose), color, 0.7);
}

Object lamp(double radius, PoseAt pose, double radiance) {
    Object object = sphere(radius, std::move(pose), {1.0, 0.95, 0.85});
    object.gloss = 0;
    object.casts = false;
    object.lamp = radiance;
    return object;
}

Object wire(glm::dvec3 from, glm::dvec3 to, double radius, glm::dvec3 color) {
    const glm::dvec3 y = glm::normalize(to - from);
    const glm::dvec3 side = std::abs(y.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(y, side));
    const glm::dmat3 rotation(x, y, glm::cross(x, y));
    return rod(0.5 * glm::length(to - from), radius, still(at(0.5 * (from + to), rotation)), color);
}

Object patterned(Object object, int pattern, double period, glm::dvec3 color_b, glm::dvec2 extra) {
    object.pattern = pattern;
    object.period = period;
    object.color_b = color_b;
    object.pattern_extra = extra;
    return object;
}

Object glossy(Object object, double gloss) {
    object.gloss = gloss;
    return object;
}

void SceneModel::add_sign(double half_width, double half_height, PoseAt pose, glm::dvec3 color,
                          glm::dvec3 letter_color, const std::vector<std::string>& lines) {
    Object sign = rectangle(half_width, half_height, std::move(pose), color);
    size_t longest = 0;
    for (const std::string& line : lines) longest = std::max(longest, line.size());
    sign.color_b = letter_color;
    sign.pattern = SCENE_TEXT;
    sign.pattern_extra = {double(letters.size()), double(longest * kLetterColumns)};
    sign.hole.w = double(lines.size());
    for (const std::string& text : lines) {
        std::string line = std::string((longest - text.size()) / 2, ' ') + text;
        line.resize(longest, ' ');
        for (const char letter : line)
            for (const uint8_t column : columns_of(letter)) letters.push_back(column);
    }
    objects.push_back(std::move(sign));
}

double Random::between(double low, double high) {
    // SplitMix64 (Steele, Lea, Flood 2014).
    state_ += 0x9e3779b97f4a7c15u;
    uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * double(z >> 11) * 0x1p-53;
}

std::vector<glm::dvec4> bounds_of(const Object& object) {
    const glm::dvec4 size = object.size;
    std::vector<glm::dvec4> spheres;
    switch (object.shape) {
        case Shape::sphere:
            spheres.push_back({0, 0, 0, size.x});
            break;
        case Shape::box:
            spheres.push_back({0, 0, 0, glm::length(glm::dvec3(size))});
            break;
        case Shape::rod: {
            const int count = int(std::clamp(std::ceil(size.x / size.y), 1.0, 64.0));
            const double half = size.x / count;
            for (int i = 0; i < count; ++i)
                spheres.push_back({0, -size.x + (2 * i + 1) * half, 0, half + size.y});
            break;
        }
        case Shape::torus: {
            constexpr int kCount = 32;
            const double half = size.x * std::sin(glm::pi<double>() / kCount);
            for (int i = 0; i < kCount; ++i) {
                const double angle = 2 * glm::pi<double>() * i / kCount;
                spheres.push_back(
                    {size.x * std::cos(angle), size.x * std::sin(angle), 0, half + size.y});
            }
            break;
        }
        case Shape::rectangle:
        case Shape::wheel: {
            const glm::dvec2 half = object.shape == Shape::wheel ? glm::dvec2(size.x) : size;
            const double cell = std::max(half.x, half.y) / 8;
            const int columns = std::max(1, int(std::ceil(half.x / cell)));
            const int rows = std::max(1, int(std::ceil(half.y / cell)));
            const glm::dvec2 step = half / glm::dvec2(columns, rows);
            for (int y = 0; y < rows; ++y)
                for (int x = 0; x < columns; ++x) {
                    const glm::dvec2 center = step * glm::dvec2(2 * x + 1, 2 * y + 1) - half;
                    const bool outside = object.shape == Shape::wheel &&
                                         glm::length(center) - glm::length(step) > size.x;
                    if (!outside) spheres.push_back({center, 0, glm::length(step)});
                }
            break;
        }
    }
    return spheres;
}

}  // namespace postchain::scenes

#include "tests/support/exact_scene.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "chain/frame/behind.h"

namespace postchain::test::exact {
namespace {

// Mean gray of a surface between two places of it.
double gray_between(const Surface& surface, double begin, double end) {
    if (surface.wave == 0) return surface.gray;
    const double sum = (std::cos(kWave * begin) - std::cos(kWave * end)) / kWave;
    return surface.gray + surface.wave * sum / (end - begin);
}

// Adds what the row at y shows at this time and from this place of the lens, -1..1.
void add_row(const Scene& scene, double y, double time, double focus_time, double lens,
             double weight, Row& row, int depth = 0) {
    struct Placed {
        double begin, end;
        size_t surface;
    };
    std::vector<Placed> placed;
    std::vector<double> ends = {0, kWidth}, moved;
    for (size_t i = 0; i < scene.surfaces.size(); ++i) {
        const Surface& s = scene.surfaces[i];
        moved.push_back(s.path(time) + radius_of(scene, s, focus_time) * lens);
        for (const Span& span : s.spans(y)) {
            const double begin = std::max(span.begin + moved[i], 0.0);
            const double end = std::min(span.end + moved[i], double(kWidth));
            if (begin >= end) continue;
            placed.push_back({begin, end, i});
            ends.push_back(begin);
            ends.push_back(end);
        }
    }
    std::sort(ends.begin(), ends.end());
    for (size_t k = 0; k + 1 < ends.size(); ++k) {
        const double middle = (ends[k] + ends[k + 1]) / 2;
        int hidden = depth;
        size_t shown = 0;
        for (const Placed& p : placed)
            if (middle >= p.begin && middle < p.end) {
                shown = p.surface;
                if (hidden-- == 0) break;
            }
        const Surface& s = scene.surfaces[shown];
        for (double begin = ends[k]; begin < ends[k + 1];) {
            const int x = int(begin);
            const double end = std::min(ends[k + 1], x + 1.0), share = weight * (end - begin);
            row.light[size_t(x)] +=
                share * gray_between(s, begin - moved[shown], end - moved[shown]);
            row.shares[shown][size_t(x)] += share;
            begin = end;
        }
    }
}

// Rows of a pixel, in frame and ground truth alike: both show the same steps in place of an
// outline.
int rows_of(const Scene& scene) {
    return scene.round ? 8 : 1;
}

FramePlanes frame_at(const Scene& scene, double time, int depth = 0) {
    FramePlanes planes;
    ImageF& color = planes[Role::color] = ImageF(kWidth, scene.height, 4, 1);
    ImageF& inverse_depth = planes[Role::inverse_depth] = ImageF(kWidth, scene.height, 1);
    ImageF& motion = planes[Role::motion] = ImageF(kWidth, scene.height, 2);
    ImageF& motion_back = planes[Role::motion_back] = motion;
    const ImageF random = noise_image(kWidth, scene.height, 1, uint32_t(56 + time));
    for (int y = 0; y < scene.height; ++y) {
        const Row row = row_at(scene, y, time, depth);
        for (int x = 0; x < kWidth; ++x) {
            double left = random.at(x, y), forth = 0, back = 0;
            std::optional<float> place;
            for (size_t i = 0; i < scene.surfaces.size(); ++i) {
                const Surface& s = scene.surfaces[i];
                const double share = row.shares[i][size_t(x)];
                forth += share * (s.path(time + 1) - s.path(time));
                back += share * (s.path(time) - s.path(time - 1));
                left -= share;
                if (left < 0 && !place) place = float(s.inverse_depth);
            }
            for (int c = 0; c < 3; ++c) color.at(x, y, c) = float(row.light[size_t(x)]);
            inverse_depth.at(x, y) = place.value_or(float(scene.surfaces.back().inverse_depth));
            motion.at(x, y) = float(forth);
            motion_back.at(x, y) = float(back);
        }
    }
    return planes;
}

}  // namespace

Path steady(double px_per_frame) {
    return [=](double time) { return px_per_frame * time; };
}

std::vector<Span> everywhere(double) {
    return {{-kFar, kFar}};
}

Spans bar(double begin, double end, double top, double bottom) {
    return [=](double y) {
        return y >= top && y < bottom ? std::vector<Span>{{begin, end}} : std::vector<Span>{};
    };
}

Spans fence(double first, double width, double period) {
    return [=](double) {
        std::vector<Span> spans;
        for (int i = -10; i < 20; ++i)
            spans.push_back({first + i * period, first + i * period + width});
        return spans;
    };
}

Spans discs(const std::vector<std::array<double, 2>>& centers, double radius) {
    return [=](double y) {
        std::vector<Span> spans;
        for (const auto& [cx, cy] : centers) {
            const double squared = radius * radius - (y - cy) * (y - cy);
            if (squared > 0) spans.push_back({cx - std::sqrt(squared), cx + std::sqrt(squared)});
        }
        return spans;
    };
}

double radius_of(const Scene& scene, const Surface& surface, double time) {
    return scene.lens ? 32 * (scene.focus(time) - surface.inverse_depth) : 0;
}

Row row_at(const Scene& scene, int y, double time, int depth) {
    const int rows = rows_of(scene);
    Row row(scene.surfaces.size());
    for (int i = 0; i < rows; ++i)
        add_row(scene, y + (i + 0.5) / rows, time, time, 0, 1.0 / rows, row, depth);
    return row;
}

FramePlanes frames_of(const Scene& scene, double time) {
    FramePlanes planes = frame_at(scene, time);
    if (scene.alone) {
        planes.erase(Role::motion);
        planes.erase(Role::motion_back);
        return planes;
    }
    if (scene.behind) {
        planes[Role::behind] = stack_behind(frame_at(scene, time, 1));
        return planes;
    }
    for (const Neighbor neighbor : kNeighbors)
        for (auto& [role, plane] : frame_at(scene, time + (neighbor == Neighbor::before ? -1 : 1)))
            planes[role_of(neighbor, role)] = std::move(plane);
    return planes;
}

FrameDescription description_of(const Scene& scene, const FramePlanes& planes, double time) {
    FrameDescription frame = describe_round(planes);
    if (!scene.lens) frame.camera.f_stop = 1e9;
    frame.camera.focus_distance = 1 / scene.focus(time);
    return frame;
}

std::vector<double> truth_of(const Scene& scene, int y, double time) {
    const int times = 32, places = scene.lens ? 48 : 1, rows = rows_of(scene);
    Row row(scene.surfaces.size());
    double sum = 0;
    for (int k = 0; k < places; ++k) {
        const double place = 2 * (k + 0.5) / places - 1;
        const double part = std::sqrt(1 - place * place);  // of the lens's disc
        sum += part;
        for (int i = 0; i < times; ++i)
            for (int j = 0; j < rows; ++j)
                add_row(scene, y + (j + 0.5) / rows, time + ((i + 0.5) / times - 0.5) / 2, time,
                        place, part / times / rows, row);
    }
    for (double& light : row.light) light /= sum;
    return row.light;
}

ImageF truth_image(const Scene& scene, double time) {
    ImageF image(kWidth, scene.height, 3);
    std::vector<double> row;
    for (int y = 0; y < scene.height; ++y) {
        const bool same = y > 0 && !scene.round;
        if (!same) row = truth_of(scene, y, time);
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(row[size_t(x)]);
    }
    return image;
}

}  // namespace postchain::test::exact

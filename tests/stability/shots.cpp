#include "tests/stability/shots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "config/chain_find.h"
#include "tests/support/exact_scene.h"
#include "tests/support/gpu.h"
#include "tests/support/random.h"
#include "tests/support/status.h"
#include "tools/measure/experiment/pixel_classes.h"
#include "tools/metrics/display.h"
#include "tools/metrics/temporal.h"

namespace postchain::test::stability {
namespace {

using namespace exact;

// ------------------------------------------------------------------------- scenes along an axis
ShotFrame frame_of(const Scene& scene, int frame) {
    ShotFrame made{.planes = frames_of(scene, frame), .description = {}, .truth = {}};
    made.description = description_of(scene, made.planes, frame);
    made.truth = truth_image(scene, frame);
    return made;
}

Shot shot_of(const char* name, const char* what, int frames, const Scene& scene) {
    return {name, what, frames, [scene](int frame) { return frame_of(scene, frame); }};
}

// As `run` filters a frame that has no neighbor on this side.
void remove_neighbor(ShotFrame& frame, Neighbor neighbor) {
    for (const Role role : {Role::color, Role::inverse_depth, Role::motion, Role::motion_back}) {
        frame.planes.erase(role_of(neighbor, role));
        frame.description.planes.remove(role_of(neighbor, role));
    }
}

Path scaled(const Path& path, double factor) {
    return [=](double time) { return factor * path(time); };
}

// Without a period, so that the ground truth changes at any speed.
Spans planks(double width, double gap, uint64_t seed) {
    std::vector<Span> spans;
    Random random(seed);
    for (double x = -400; x < 600;) {
        const double end = x + width * random.real(0.6, 1.4);
        spans.push_back({x, end});
        x = end + gap * random.real(0.6, 1.4);
    }
    return [=](double) { return spans; };
}

Surface waves(double inverse_depth, const Path& path = steady(0)) {
    return {everywhere, 0.5, inverse_depth, path, 0.3};
}

// Slats, a rail and a wall at three depths, as a camera that moves sideways shows them.
Scene panned(const Path& path) {
    return {.surfaces = {{planks(9, 33, 1), 0.08, 0.4, scaled(path, 1)},
                         {planks(2.2, 12, 2), 0.9, 0.25, scaled(path, 0.625)},
                         waves(0.1, scaled(path, 0.25))}};
}

// A camera follows a disc, faster and faster.
Scene accelerated() {
    const Path path = [](double time) { return -40 * time * time / 24; };  // 0 to 40 px a frame
    return {.surfaces = {{discs({{78.3, 33.2}}, 14), 0.05, 0.4},
                         {planks(5, 18, 3), 0.9, 0.15, path},
                         waves(0.1, path)},
            .round = true};
}

Scene wires() {
    return {.surfaces = {{fence(4.2, 1, 17.3), 0.03, 0.5, steady(0.37)},
                         {fence(9.7, 2.6, 31.1), 0.1, 0.3, steady(0.22)},
                         {everywhere, 4, 0}}};
}

// Moves by 16 px a frame, stands from frame 3 to frame 7, and moves again.
Scene stopped() {
    const Path path = [](double time) {
        return 16 * (std::min(time, 3.0) + std::max(time - 7, 0.0));
    };
    return {.surfaces = {{planks(20, 60, 4), 0.07, 0.4, path},
                         {bar(20, 40), 0.8, 0.3, scaled(path, 0.5), 0.15},
                         waves(0.1)}};
}

// From the wall, with a circle of confusion of 2.8 px in radius at the end, to a post.
Scene racked() {
    return {.surfaces = {{bar(63.4, 92.7), 0.3, 0.1 + 2.8 / 32}, waves(0.1)},
            .lens = true,
            .focus = [](double time) { return 0.1 + 2.8 / 32 * time / 11; }};
}

Scene before_still_texture() {
    return {.surfaces = {{discs({{48.3, 33.2}}, 12), 0.05, 0.4, steady(12)}, waves(0.1)},
            .round = true};
}

Scene moving_disc() {
    return {.surfaces = {{discs({{60.3, 33.2}}, 16), 0.07, 0.4, steady(9)},
                         {planks(5, 18, 5), 0.9, 0.15, steady(-3)},
                         waves(0.1)},
            .round = true};
}

ShotFrame at_the_ends(int frame) {
    ShotFrame made = frame_of(moving_disc(), frame);
    if (frame == 0) remove_neighbor(made, Neighbor::before);
    if (frame == 5) remove_neighbor(made, Neighbor::after);
    return made;
}

// The shot ends with frame 3. Vectors across the cut are replaced by those of the other side.
ShotFrame at_the_cut(int frame) {
    ShotFrame made = frame_of(frame <= 3 ? moving_disc() : panned(steady(5)), frame);
    if (frame == 3) {
        remove_neighbor(made, Neighbor::after);
        made.planes[Role::motion] = made.planes[Role::motion_back];
    }
    if (frame == 4) {
        remove_neighbor(made, Neighbor::before);
        made.planes[Role::motion_back] = made.planes[Role::motion];
    }
    return made;
}

// -------------------------------------------------------------------- what an axis cannot describe
struct Seen {
    double gray, inverse_depth, forth_x = 0, forth_y = 0, back_x = 0, back_y = 0;
};
// The light that the ray at x, y shows; u, v: its place on the lens, within a unit disc.
using View = std::function<Seen(double x, double y, double time, double u, double v)>;

constexpr int kViewWidth = 121, kViewHeight = 97;

// Point i of the lattice by powers of the root of x^(d+1) = x + 1 (d = 5), which fill the cube
// evenly.
std::array<double, 5> lattice(int i) {
    constexpr double root = 1.1347241384015194;
    std::array<double, 5> point;
    double step = 1;
    for (double& value : point) {
        step /= root;
        value = std::fmod(0.5 + (i + 1) * step, 1.0);
    }
    return point;
}

FramePlanes planes_of(const View& view, double time) {
    FramePlanes planes;
    ImageF& color = planes[Role::color] = ImageF(kViewWidth, kViewHeight, 4, 1);
    ImageF& depth = planes[Role::inverse_depth] = ImageF(kViewWidth, kViewHeight, 1);
    ImageF& motion = planes[Role::motion] = ImageF(kViewWidth, kViewHeight, 2);
    ImageF& back = planes[Role::motion_back] = motion;
    const ImageF random = noise_image(kViewWidth, kViewHeight, 2, uint32_t(7 + time));
    constexpr int kSide = 8;
    for (int y = 0; y < kViewHeight; ++y)
        for (int x = 0; x < kViewWidth; ++x) {
            double gray = 0, vectors[4] = {};
            for (int i = 0; i < kSide * kSide; ++i) {
                const Seen seen =
                    view(x + (i % kSide + 0.5) / kSide, y + (i / kSide + 0.5) / kSide, time, 0, 0);
                gray += seen.gray;
                const double its[] = {seen.forth_x, seen.forth_y, seen.back_x, seen.back_y};
                for (int k = 0; k < 4; ++k) vectors[k] += its[k];
            }
            for (int c = 0; c < 3; ++c) color.at(x, y, c) = float(gray / (kSide * kSide));
            for (int c = 0; c < 2; ++c) {
                motion.at(x, y, c) = float(vectors[c] / (kSide * kSide));
                back.at(x, y, c) = float(vectors[2 + c] / (kSide * kSide));
            }
            depth.at(x, y) =
                float(view(x + random.at(x, y), y + random.at(x, y, 1), time, 0, 0).inverse_depth);
        }
    return planes;
}

// `samples` rays a pixel. They are the same in every frame and pixel, so that their error does not
// change where nothing does.
ImageF truth_of_view(const View& view, double time, bool lens, int samples) {
    ImageF image(kViewWidth, kViewHeight, 3);
    std::vector<std::array<double, 5>> rays;
    for (int i = 0; i < samples; ++i) {
        auto ray = lattice(i);
        const double radius = lens ? std::sqrt(ray[3]) : 0, angle = 2 * std::numbers::pi * ray[4];
        ray[2] = (ray[2] - 0.5) / 2;
        ray[3] = radius * std::cos(angle);
        ray[4] = radius * std::sin(angle);
        rays.push_back(ray);
    }
    for (int y = 0; y < kViewHeight; ++y)
        for (int x = 0; x < kViewWidth; ++x) {
            double sum = 0;
            for (const auto& [dx, dy, dt, u, v] : rays)
                sum += view(x + dx, y + dy, time + dt, u, v).gray;
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(sum / samples);
        }
    return image;
}

Shot view_shot(const char* name, const char* what, int frames, const View& view, bool lens,
               int samples) {
    return {name, what, frames, [=](int frame) {
                ShotFrame made{.planes = planes_of(view, frame), .description = {}, .truth = {}};
                for (const Neighbor neighbor : kNeighbors)
                    for (auto& [role, plane] :
                         planes_of(view, frame + (neighbor == Neighbor::before ? -1 : 1)))
                        made.planes[role_of(neighbor, role)] = std::move(plane);
                made.description = describe_round(made.planes);
                if (!lens) made.description.camera.f_stop = 1e9;
                made.truth = truth_of_view(view, frame, lens, samples);
                return made;
            }};
}

// Three blades before a wall, a twelfth of a turn per frame.
Seen fan(double x, double y, double time, double, double) {
    constexpr double kTurn = 2 * std::numbers::pi, kSpeed = kTurn / 12;
    const double dx = x - 60.3, dy = y - 48.2, radius = std::hypot(dx, dy);
    const double angle = std::atan2(dy, dx) - kSpeed * time;
    const double third = angle - kTurn / 3 * std::round(3 * angle / kTurn);
    if (radius > 6 && (radius > 44 || std::abs(third) > 0.45))
        return {0.5 + 0.3 * std::sin(kWave * x), 0.1};
    const double gray = radius > 6 ? 0.12 : 0.3 + 0.2 * std::cos(3 * angle);
    const auto turned = [&](double by) {
        return std::array{dx * std::cos(by) - dy * std::sin(by) - dx,
                          dx * std::sin(by) + dy * std::cos(by) - dy};
    };
    const auto forth = turned(kSpeed), back = turned(-kSpeed);
    return {gray, 0.3, forth[0], forth[1], -back[0], -back[1]};
}

// Displacement on the image of what is out of focus, px per radius of the lens.
double spread_of(double inverse_depth) {
    return 32 * (0.25 - inverse_depth);
}

// A lamp out of focus that drifts before a dark wall: a circle of 6 px in radius.
Seen lamp(double x, double y, double time, double u, double v) {
    constexpr double kDepth = 0.25 - 6.0 / 32, kX = 0.7, kY = 0.3;  // px per frame
    const double dx = x - spread_of(kDepth) * u - 50.4 - kX * time;
    const double dy = y - spread_of(kDepth) * v - 48.3 - kY * time;
    if (std::hypot(dx, dy) < 1.8) return {60, kDepth, kX, kY, kX, kY};
    return {0.1, 0.25 - 7.0 / 32};
}

// A checkered ball that spins about the vertical, over a ground with its contact shadow. height: of
// its center above where it touches the ground, px.
View ball_view(const Path& height, double spin) {
    return [=](double x, double y, double time, double u, double v) -> Seen {
        constexpr double kRadius = 15, kBall = 0.22, kGround = 0.215, kWall = 0.1;
        const double bx = x - spread_of(kBall) * u - 60.4;
        const double by = y - spread_of(kBall) * v - 66.3 + height(time);
        if (std::hypot(bx, by) < kRadius) {
            const double ring = std::sqrt(kRadius * kRadius - by * by);
            const double longitude = std::asin(std::clamp(bx / ring, -1.0, 1.0));
            const double row = std::floor(by / 5),
                         column = std::floor((longitude - spin * time) / 0.4);
            const auto turned = [&](double frames) {
                return ring * (std::sin(longitude + spin * frames) - std::sin(longitude));
            };
            const bool light = std::fmod(std::abs(row + column), 2) < 0.5;
            return {light ? 0.9 : 0.15, kBall,
                    turned(1),          height(time) - height(time + 1),
                    -turned(-1),        height(time - 1) - height(time)};
        }
        const double gx = x - spread_of(kGround) * u - 60.4, gy = y - spread_of(kGround) * v - 80;
        if (gy > -14) {
            const double shadow = std::hypot(gx / 16, gy / 4) < 1 ? 0.25 : 1;
            return {shadow * (0.5 + 0.15 * std::sin(kWave * gx / 2)), kGround};
        }
        return {0.5 + 0.3 * std::sin(kWave * (x - spread_of(kWall) * u)), kWall};
    };
}

}  // namespace

const std::vector<Shot>& shots() {
    // Straight between frames, and a parabola.
    const Path bounce = [](double time) { return 14 * std::abs(time - 2); };
    const Path turn = [](double time) { return 7 * (time - 2) * (time - 2); };
    static const std::vector<Shot> all = {
        shot_of("slow_pan", "a pan of .1 to 3 px a frame, three depths", 12,
                panned([](double time) { return 0.1 * (std::pow(1.362, time) - 1) / 0.3089; })),
        shot_of("acceleration", "a camera follows a disc, 0 to 40 px a frame", 12, accelerated()),
        shot_of("stop", "16 px a frame, stops at frame 3, starts at frame 7", 10, stopped()),
        shot_of("wires", "wires drift by .37 and .22 px a frame before a bright sky", 8, wires()),
        shot_of("still_texture", "a disc passes before a still fine texture", 6,
                before_still_texture()),
        shot_of("rack_focus", "focus from a wall to a post, circles of 0 to 2.8 px", 12, racked()),
        view_shot("lamp", "a lamp out of focus drifts by .8 px a frame", 8, lamp, true, 4096),
        view_shot("fan", "three blades, a twelfth of a turn a frame", 8, fan, false, 512),
        view_shot("bounce", "a ball bounces at frame 2", 5, ball_view(bounce, 0), false, 512),
        view_shot("bounce_spin_lens", "it spins, a little out of focus", 5, ball_view(bounce, 0.35),
                  true, 1024),
        view_shot("pendulum", "a ball turns at frame 2", 5, ball_view(turn, 0), false, 512),
        view_shot("pendulum_spin_lens", "it spins, a little out of focus", 5, ball_view(turn, 0.35),
                  true, 1024),
        {"ends", "no frame before frame 0 and after frame 5", 6, at_the_ends},
        {"cut", "a cut after frame 3", 8, at_the_cut},
    };
    return all;
}

std::vector<ShotFrame> render(const Shot& shot) {
    std::vector<ShotFrame> frames;
    for (int frame = 0; frame < shot.frames; ++frame) {
        frames.push_back(shot.at(frame));
        frames.back().description.frame_number = frame;
    }
    return frames;
}

namespace {

// `error`: rms of displayed values; then of each class of pixels.
metrics::Values errors_of(const metrics::Pair& pair, const Image<metrics::PixelClass>& classes) {
    std::array<double, metrics::kPixelClasses + 1> squares = {}, pixels = {};
    for (size_t i = 0; i < pair.pixels(); ++i) {
        double square = 0;
        for (int c = 0; c < 3; ++c)
            square += std::pow(double(metrics::display_value(pair.test_pixel(i)[c])) -
                                   double(metrics::display_value(pair.reference_pixel(i)[c])),
                               2) /
                      3;
        for (const size_t k : {size_t(0), 1 + size_t(classes.data[i])}) {
            squares[k] += square;
            ++pixels[k];
        }
    }
    metrics::Values values;
    for (size_t k = 0; k < squares.size(); ++k) {
        const std::string name =
            k ? concat("error_", metrics::kPixelClassNames[k - 1]) : std::string("error");
        values.emplace_back(
            name, pixels[k] > 0 ? std::optional(std::sqrt(squares[k] / pixels[k])) : std::nullopt);
    }
    return values;
}

}  // namespace

double Measured::mean(const std::string& name) const {
    for (const auto& [metric, value] : means)
        if (metric == name) return value.value_or(0);
    return 0;
}

Measured measure(const std::vector<ShotFrame>& frames, const Chain& chain) {
    Measured measured;
    metrics::TemporalError temporal;
    for (const ShotFrame& frame : frames) {
        const ImageF color = filter(chain, frame.description, frame.planes).at(Role::color);
        const metrics::Pair pair = must(metrics::pair_of(color, frame.truth));
        const auto classes = experiment::pixel_classes(frame.description, [&](Role role) {
            const auto plane = frame.planes.find(role);
            return plane == frame.planes.end() ? nullptr : &plane->second;
        });
        if (const Status status = temporal.add(pair, classes); !status.ok())
            throw std::runtime_error(error_of(status));
        metrics::Values values = errors_of(pair, classes);
        for (const auto& value : temporal.last()) values.push_back(value);
        measured.frames.push_back(std::move(values));
    }
    measured.means = metrics::summary_of(measured.frames);
    return measured;
}

Chain shipped_chain(const std::string& name) {
    return must(load_chain(name, builtin_passes())).chain;
}

}  // namespace postchain::test::stability

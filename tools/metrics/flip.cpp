// Rows are processed in blocks that the compiler vectorizes; buffers of a band of rows fit in the
// cache. Single precision: the golden means are within 1e-5, for two grays within 2e-5 (there a*
// and b* are differences of nearly equal numbers).
#include "tools/metrics/flip.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "tools/metrics/parallel.h"

namespace postchain::metrics {
namespace {

// The filters of FLIP as one-dimensional kernels. Every filter of the paper is a sum of separable
// ones, so filtering along rows and then columns is exact (2020 paper, table 1 and equations 5 for
// contrast sensitivity, section 3.4 for edges and points).

// Odd length, centered; applied by correlation.
struct Kernel {
    std::vector<float> taps;
    int radius() const { return int(taps.size() / 2); }
};

struct FlipKernels {
    Kernel achromatic;           // along rows and columns
    Kernel red_green;            // along rows and columns
    Kernel blue_yellow_rows[2];  // the channel's two Gaussians, to be summed
    Kernel blue_yellow_columns[2];
    Kernel gaussian;  // across the direction of a derivative
    Kernel first;     // edges: first derivative, negative and positive parts sum to 1
    Kernel second;    // points: second derivative, same normalization
    int radius = 0;   // the largest of all kernels
};

constexpr double kPi = std::numbers::pi;

// Contrast sensitivity in the spatial domain: sum of a sqrt(pi/b) exp(-pi^2 d^2 / b), with d in
// degrees of visual angle (table 1).
struct Term {
    double a, b;
};
constexpr Term kAchromaticTerm = {1, 0.0047};
constexpr Term kRedGreenTerm = {1, 0.0053};
constexpr Term kBlueYellowTerms[2] = {{34.1, 0.04}, {13.5, 0.025}};
constexpr double kWidestB = 0.04;
constexpr double kFeatureWidth = 0.082;  // degrees: support of the edge and point detectors
// Outer taps below this fraction of the largest are dropped: the achromatic kernels need 13 of 21
// taps.
constexpr double kNegligibleTap = 1e-9;

using Profile = std::vector<double>;

Profile sampled(int radius, const std::function<double(double)>& f) {
    Profile values;
    for (int x = -radius; x <= radius; ++x) values.push_back(f(x));
    return values;
}

double sum(const Profile& profile) {
    double total = 0;
    for (double v : profile) total += v;
    return total;
}

Profile scaled(Profile profile, double factor) {
    for (double& v : profile) v *= factor;
    return profile;
}

// Scales so that negative taps sum to -1 and positive ones to 1: the response to a step of 1 is 1.
Profile balanced(Profile profile) {
    double positive = 0, negative = 0;
    for (double v : profile) (v > 0 ? positive : negative) += std::abs(v);
    for (double& v : profile) v /= v > 0 ? positive : negative;
    return profile;
}

Kernel kernel_of(const Profile& profile) {
    double largest = 0;
    for (double v : profile) largest = std::max(largest, std::abs(v));
    size_t cut = 0;
    while (cut < profile.size() / 2 && std::abs(profile[cut]) < kNegligibleTap * largest) ++cut;
    Kernel kernel;
    for (size_t i = cut; i < profile.size() - cut; ++i) kernel.taps.push_back(float(profile[i]));
    return kernel;
}

// pixels_per_degree in kMinPixelsPerDegree..kMaxPixelsPerDegree.
FlipKernels flip_kernels(double pixels_per_degree) {
    FlipKernels kernels;
    // Three standard deviations of the widest kernel, for all three channels.
    const int radius =
        int(std::ceil(3 * std::sqrt(kWidestB / (2 * kPi * kPi)) * pixels_per_degree));
    const auto bell = [&](const Term& term) {
        return sampled(radius, [&](double x) {
            const double degrees = x / pixels_per_degree;
            return std::exp(-kPi * kPi * degrees * degrees / term.b);
        });
    };
    const auto normalized = [](const Profile& profile) {
        return scaled(profile, 1 / sum(profile));
    };
    kernels.achromatic = kernel_of(normalized(bell(kAchromaticTerm)));
    kernels.red_green = kernel_of(normalized(bell(kRedGreenTerm)));

    // The sum of both 2-D Gaussians is normalized, so each keeps its share.
    double share[2];
    for (int i = 0; i < 2; ++i) {
        const double area = sum(bell(kBlueYellowTerms[i]));
        share[i] = kBlueYellowTerms[i].a * std::sqrt(kPi / kBlueYellowTerms[i].b) * area * area;
    }
    for (int i = 0; i < 2; ++i) {
        const Profile one = normalized(bell(kBlueYellowTerms[i]));
        kernels.blue_yellow_rows[i] = kernel_of(one);
        kernels.blue_yellow_columns[i] = kernel_of(scaled(one, share[i] / (share[0] + share[1])));
    }

    const double deviation = 0.5 * kFeatureWidth * pixels_per_degree;
    const int feature_radius = int(std::ceil(3 * deviation));
    const auto gaussian = [&](double x) { return std::exp(-x * x / (2 * deviation * deviation)); };
    kernels.gaussian = kernel_of(normalized(sampled(feature_radius, gaussian)));
    kernels.first =
        kernel_of(balanced(sampled(feature_radius, [&](double x) { return -x * gaussian(x); })));
    kernels.second = kernel_of(balanced(sampled(feature_radius, [&](double x) {
        return (x * x / (deviation * deviation) - 1) * gaussian(x);
    })));
    kernels.radius = std::max(radius, feature_radius);
    return kernels;
}

// Linear Rec. 709 RGB and XYZ (IEC 61966-2-1's primaries and white), in double.
constexpr double kRgbToXyz[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
// XYZ of RGB (1, 1, 1): the row sums.
constexpr double kWhite[3] = {kRgbToXyz[0][0] + kRgbToXyz[0][1] + kRgbToXyz[0][2],
                              kRgbToXyz[1][0] + kRgbToXyz[1][1] + kRgbToXyz[1][2],
                              kRgbToXyz[2][0] + kRgbToXyz[2][1] + kRgbToXyz[2][2]};

// Constants of the 2020 paper, sections 3.3 and 3.4.
constexpr float kColorExponent = 0.7f;    // q_c
constexpr float kColorKnee = 0.4f;        // p_c, part of the largest difference
constexpr float kColorKneeValue = 0.95f;  // p_t, what the knee maps to
constexpr float kHuntScale = 0.01f;
// Largest exposed value: far above white for every tone curve, with a finite square.
constexpr float kMaxExposed = 1e15f;
constexpr int kBlock = 16;     // pixels
constexpr int kBandRows = 64;  // rows

// Conversion from scene values to the 0..1 that FLIP compares.
struct Shown {
    float gain = 1;
    std::optional<ToneMapper> mapper;  // none: clamp only
};

using Row = std::vector<float>;

// t^(1/3) of t > 0 to float precision: an estimate from the exponent (3 %), then two Halley steps,
// each of which cubes the error. Branch-free for vectorization.
inline float cube_root(float t) {
    const auto bits = std::bit_cast<int32_t>(t);
    const auto guess = int32_t(float(bits) * (1 / 3.0f)) + 0x2a510000;
    float y = std::bit_cast<float>(guess);
    for (int i = 0; i < 2; ++i) {
        const float cube = y * y * y;
        y *= (cube + 2 * t) / (2 * cube + t);
    }
    return y;
}

// f of CIELAB: the cube root with a linear start.
inline float lab_curve(float t) {
    constexpr float delta = 6.0f / 29;
    constexpr float knee = delta * delta * delta;
    const float root = cube_root(std::max(t, knee));
    const float line = t * (1 / (3 * delta * delta)) + 4.0f / 29;
    return t > knee ? root : line;
}

struct Lab {
    float l, a, b;
};

// CIELAB of XYZ relative to white, chroma scaled by lightness (Hunt effect).
inline Lab hunt_lab(float x, float y, float z) {
    const float fx = lab_curve(x), fy = lab_curve(y), fz = lab_curve(z);
    const float l = 116 * fy - 16;
    return {l, kHuntScale * l * 500 * (fx - fy), kHuntScale * l * 200 * (fy - fz)};
}

struct Matrix {
    float m[3][3];

    inline void apply(float a, float b, float c, float* out) const {
        for (int i = 0; i < 3; ++i) out[i] = m[i][0] * a + m[i][1] * b + m[i][2] * c;
    }
};

Matrix to_relative_xyz() {
    Matrix matrix;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) matrix.m[i][j] = float(kRgbToXyz[i][j] / kWhite[i]);
    return matrix;
}

Matrix from_relative_xyz() {
    // Adjugate over determinant; cyclic indices give the signs.
    const auto& m = kRgbToXyz;
    const auto cofactor = [&](int i, int j) {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        return m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
    };
    const double determinant =
        m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    Matrix matrix;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            matrix.m[i][j] = float(cofactor(j, i) / determinant * kWhite[j]);
    return matrix;
}

float hyab(const Lab& p, const Lab& q) {
    const float da = p.a - q.a, db = p.b - q.b;
    return std::abs(p.l - q.l) + std::sqrt(da * da + db * db);
}

// out[x] = sum of taps[k] row_of(k)[x], for `width` rounded up to blocks.
template <class RowOf>
void weighted_sum(const std::vector<float>& taps, int width, float* out, RowOf&& row_of) {
    for (int x = 0; x < width; x += kBlock) {
        float sum[kBlock] = {};
        for (size_t k = 0; k < taps.size(); ++k) {
            const float* row = row_of(k) + x;
            for (int i = 0; i < kBlock; ++i) sum[i] += taps[k] * row[i];
        }
        for (int i = 0; i < kBlock; ++i) out[x + i] = sum[i];
    }
}

// Planes filtered along rows that still need filtering along columns.
enum Plane {
    kAchromatic,
    kRedGreen,
    kBlueYellow0,
    kBlueYellow1,
    kSmooth,
    kFirst,
    kSecond,
    kPlanes
};

class Band {
  public:
    Band(const FlipKernels& kernels, int width, int height)
        : kernels_(kernels),
          width_(width),
          height_(height),
          stride_((width + kBlock - 1) / kBlock * kBlock) {
        for (auto& row : opponent_) row.resize(size_t(stride_ + 2 * kernels.radius));
        for (auto& row : out_) row.resize(size_t(stride_));
    }

    // Filters along rows all data that output rows [begin, end) need.
    void load(const RgbImage& image, const Shown& shown, int begin, int end) {
        first_row_ = std::max(0, begin - kernels_.radius);
        const int last = std::min(height_, end + kernels_.radius);
        for (auto& plane : planes_) plane.resize(size_t(last - first_row_) * size_t(stride_));
        for (int y = first_row_; y < last; ++y) {
            split(image.rgb.pixel(0, y), shown);
            const auto filter = [&](Plane plane, int channel, const Kernel& kernel) {
                const float* from = opponent_[channel].data() + (kernels_.radius - kernel.radius());
                weighted_sum(kernel.taps, width_, row(plane, y),
                             [&](size_t k) { return from + k; });
            };
            filter(kAchromatic, 0, kernels_.achromatic);
            filter(kRedGreen, 1, kernels_.red_green);
            filter(kBlueYellow0, 2, kernels_.blue_yellow_rows[0]);
            filter(kBlueYellow1, 2, kernels_.blue_yellow_rows[1]);
            filter(kSmooth, 0, kernels_.gaussian);
            filter(kFirst, 0, kernels_.first);
            filter(kSecond, 0, kernels_.second);
        }
    }

    // Computes row y: color in lab(), features in edge() and point().
    void see(int y) {
        column(y, kAchromatic, kernels_.achromatic, out_[0]);
        column(y, kRedGreen, kernels_.red_green, out_[1]);
        column(y, kBlueYellow0, kernels_.blue_yellow_columns[0], out_[2]);
        column(y, kBlueYellow1, kernels_.blue_yellow_columns[1], out_[3]);
        static const Matrix inverse = from_relative_xyz(), forward = to_relative_xyz();
        for (int x = 0; x < stride_; ++x) {
            const float yy = out_[0][size_t(x)];
            const float by = out_[2][size_t(x)] + out_[3][size_t(x)];
            float rgb[3], xyz[3];
            inverse.apply(out_[1][size_t(x)] + yy, yy, yy - by, rgb);
            for (float& v : rgb) v = std::min(std::max(v, 0.0f), 1.0f);
            forward.apply(rgb[0], rgb[1], rgb[2], xyz);
            const Lab lab = hunt_lab(xyz[0], xyz[1], xyz[2]);
            out_[0][size_t(x)] = lab.l;
            out_[1][size_t(x)] = lab.a;
            out_[2][size_t(x)] = lab.b;
        }
        magnitude(y, kFirst, kernels_.first, out_[3]);
        magnitude(y, kSecond, kernels_.second, out_[4]);
    }
    Lab lab(int x) const { return {out_[0][size_t(x)], out_[1][size_t(x)], out_[2][size_t(x)]}; }
    float edge(int x) const { return out_[3][size_t(x)]; }
    float point(int x) const { return out_[4][size_t(x)]; }

  private:
    float* row(Plane plane, int y) {
        return planes_[plane].data() + size_t(y - first_row_) * size_t(stride_);
    }

    // Converts one row to opponent channels, replicating the edge. The paper's YCxCz is an affine
    // function of these; the filters have unit sum, so its factors and offset cancel: Y/Yn, X/Xn -
    // Y/Yn, Y/Yn - Z/Zn.
    void split(const float* rgb, const Shown& shown) {
        static const Matrix forward = to_relative_xyz();
        const ToneCurve k = curve_of(shown.mapper.value_or(ToneMapper::aces));
        const auto curve = [&](float v) {
            return (k.k0 * v * v + k.k1 * v) / (k.k3 * v * v + k.k4 * v + k.k5);
        };
        for (int x = 0; x < width_; ++x) {
            float v[3];
            for (int c = 0; c < 3; ++c)
                v[c] = std::min(std::max(rgb[3 * x + c], 0.0f) * shown.gain, kMaxExposed);
            if (shown.mapper == ToneMapper::reinhard) {
                const float scale = 1 / (1 + float(luminance(v)));
                for (float& value : v) value *= scale;
            } else if (shown.mapper) {
                for (float& value : v) value = curve(value);
            }
            float xyz[3];
            forward.apply(std::min(v[0], 1.0f), std::min(v[1], 1.0f), std::min(v[2], 1.0f), xyz);
            const size_t at = size_t(x + kernels_.radius);
            opponent_[0][at] = xyz[1];
            opponent_[1][at] = xyz[0] - xyz[1];
            opponent_[2][at] = xyz[1] - xyz[2];
        }
        for (auto& row : opponent_) {
            const auto begin = row.begin() + kernels_.radius, end = begin + width_;
            std::fill(row.begin(), begin, *begin);
            std::fill(end, row.end(), *(end - 1));
        }
    }

    void column(int y, Plane plane, const Kernel& kernel, Row& out) {
        weighted_sum(kernel.taps, width_, out.data(), [&](size_t k) {
            return row(plane, std::clamp(y + int(k) - kernel.radius(), 0, height_ - 1));
        });
    }

    // Length of (derivative along x, derivative along y).
    void magnitude(int y, Plane along_rows, const Kernel& derivative, Row& out) {
        column(y, along_rows, kernels_.gaussian, out);
        column(y, kSmooth, derivative, scratch_);
        for (size_t x = 0; x < out.size(); ++x)
            out[x] = std::sqrt(out[x] * out[x] + scratch_[x] * scratch_[x]);
    }

    const FlipKernels& kernels_;
    int width_, height_, stride_;
    int first_row_ = 0;
    Row opponent_[3];      // one row, padded by the radius
    Row planes_[kPlanes];  // rows from first_row_
    Row out_[5];
    Row scratch_ = Row(size_t(stride_));
};

// The largest possible color difference, between green and blue.
float largest_color_difference() {
    static const Matrix forward = to_relative_xyz();
    float green[3], blue[3];
    forward.apply(0, 1, 0, green);
    forward.apply(0, 0, 1, blue);
    return std::pow(
        hyab(hunt_lab(green[0], green[1], green[2]), hunt_lab(blue[0], blue[1], blue[2])),
        kColorExponent);
}

float difference(const Band& test, const Band& reference, int x, float largest) {
    const float color = std::pow(hyab(test.lab(x), reference.lab(x)), kColorExponent);
    const float knee = kColorKnee * largest;
    const float mapped =
        color < knee ? color * (kColorKneeValue / knee)
                     : kColorKneeValue + (color - knee) / (largest - knee) * (1 - kColorKneeValue);
    const float feature = std::max(std::abs(test.edge(x) - reference.edge(x)),
                                   std::abs(test.point(x) - reference.point(x)));
    const float exponent = 1 - std::min(std::sqrt(feature * float(M_SQRT1_2)), 1.0f);
    return std::pow(std::min(mapped, 1.0f), exponent);
}

FlipResult largest_over(const Pair& pair, const std::vector<Shown>& all,
                        const FlipSettings& settings) {
    assert(settings.pixels_per_degree >= kMinPixelsPerDegree &&
           settings.pixels_per_degree <= kMaxPixelsPerDegree);
    const FlipKernels kernels = flip_kernels(settings.pixels_per_degree);
    const float largest = largest_color_difference();
    FlipResult result;
    result.map = ImageF(pair.width(), pair.height(), 1);
    for_bands(pair.height(), kBandRows, settings.threads, [&](int begin, int end) {
        Band test(kernels, pair.width(), pair.height());
        Band reference(kernels, pair.width(), pair.height());
        for (const Shown& shown : all) {
            test.load(pair.test, shown, begin, end);
            reference.load(pair.reference, shown, begin, end);
            for (int y = begin; y < end; ++y) {
                test.see(y);
                reference.see(y);
                float* map = result.map.pixel(0, y);
                for (int x = 0; x < pair.width(); ++x)
                    map[x] = std::max(map[x], difference(test, reference, x, largest));
            }
        }
    });
    double sum = 0;
    for (float v : result.map.data) {
        sum += double(v);
        result.max = std::max(result.max, double(v));
    }
    result.mean = sum / double(pair.pixels());
    return result;
}

}  // namespace

FlipResult flip(const Pair& pair, const FlipSettings& settings) {
    return largest_over(pair, {Shown{}}, settings);
}

FlipResult hdr_flip(const Pair& pair, const ExposureRange& range, const FlipSettings& settings) {
    std::vector<Shown> all;
    for (double exposure : range.exposures())
        all.push_back({float(std::exp2(exposure)), settings.tone_mapper});
    return largest_over(pair, all, settings);
}

}  // namespace postchain::metrics

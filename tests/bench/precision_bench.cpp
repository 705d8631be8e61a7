// For each texture of each pass: accuracy lost and time saved by storing that texture in 16 bits
// (velocities: also 8).
//
//   plan in fp32 --copy, one texture's format--> variant
//   fp32, variant --each scene--> images --> errors against each other and the double reference
//   fp32, variant --alternately--> ratios of time --> median and quartiles
//
// A plan is data: the executor allocates each texture and binds each image in the format that the
// plan states, and the shaders' images are writeonly without a format. So changing the format is
// enough, unless a pass rounds or saturates before it stores; then the step that writes the texture
// is taken from the fp16 plan. Half-velocities have their own parameter. Timing rules and results:
// docs/benchmarks.md.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>

#include "chain/egl/context.h"
#include "chain/planner.h"
#include "passes/registry.h"
#include "tests/bench/bench_frame.h"
#include "tools/measure/metrics/display.h"
#include "tools/measure/metrics/error.h"

namespace {

using namespace postchain;
using namespace postchain::bench;

using Values = std::vector<std::pair<std::string, ParameterValue>>;

struct Case {
    std::vector<std::string> passes;
    Values values;     // of the first pass
    bool each = true;  // every texture, otherwise only the whole plan at fp16
};

// Textures of an earlier case with the same passes are not measured again.
std::vector<Case> cases() {
    return {{{"motion_blur"}, {}},
            {{"motion_blur"}, {{"sample_split", std::string("variance")}}},
            {{"depth_of_field"}, {}},
            {{"depth_of_field"}, {{"leak", std::string("depth")}}},
            {{"depth_of_field"}, {{"leak", std::string("coc")}}},
            {{"fxaa"}, {}},
            {{"motion_blur", "depth_of_field", "fxaa"}, {}, false}};
}

struct Variant {
    std::string plane;
    std::string storage;
    Plan plan;
};

// The 16-bit version of a 32-bit format; empty for smaller formats.
std::optional<Format> half_of(Format format) {
    if (format == Format::rgba32f) return Format::rgba16f;
    if (format == Format::rg32f) return Format::rg16f;
    if (format == Format::r32f) return Format::r16f;
    return std::nullopt;
}

Plan plan_of(const Case& one, const BenchFrame& frame, Precision precision,
             const Values& more = {}) {
    Chain chain;
    for (const std::string& name : one.passes) {
        Pass* pass = chain.append(builtin_passes(), name);
        if (!pass) fail("no pass " + name);
    }
    for (const Values& values : {one.values, more})
        for (const auto& [key, value] : values)
            require(chain.links[0].type->parameters->set(chain.links[0].pass->parameters(), key,
                                                         value));
    PlanOptions options;
    options.elide = false;
    options.precision = precision;
    return require(make_plan(chain, frame.description, options));
}

ImageF reference_of(const Case& one, const BenchFrame& frame) {
    Chain chain;
    for (const std::string& name : one.passes) chain.append(builtin_passes(), name);
    for (const auto& [key, value] : one.values)
        require(
            chain.links[0].type->parameters->set(chain.links[0].pass->parameters(), key, value));
    const auto reference = require(run_reference(chain, frame.description, frame.planes));
    return image_cast<float>(reference.planes.at(Role::color));
}

// `plan` with one texture in half. `half` is the same chain at fp16: if it stores the texture in
// half too, it shows how to compile the steps that write the texture.
Plan with_half(const Plan& plan, const Plan& half, size_t texture) {
    Plan variant = plan;
    variant.textures[texture].format = *half_of(plan.textures[texture].format);
    const bool rounds_itself = half.textures[texture].format == variant.textures[texture].format;
    for (size_t i = 0; rounds_itself && i < plan.steps.size(); ++i) {
        for (const Binding& binding : plan.steps[i].bindings) {
            if (size_t(binding.texture) != texture || binding.access != Access::write) continue;
            variant.steps[i].program = half.steps[i].program;
            variant.steps[i].uniforms = half.steps[i].uniforms;
        }
    }
    return variant;
}

bool ends_with(const std::string& text, const std::string& end) {
    return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

std::vector<Variant> variants_of(const Case& one, const BenchFrame& frame,
                                 std::set<std::string>& seen) {
    const Plan plan = plan_of(one, frame, Precision::fp32);
    const Plan half = plan_of(one, frame, Precision::fp16);
    if (half.textures.size() != plan.textures.size() || half.steps.size() != plan.steps.size())
        fail("the plans at fp16 and fp32 differ in more than formats");
    std::vector<Variant> variants;
    for (size_t i = 0; one.each && i < plan.textures.size(); ++i) {
        const PlanTexture& texture = plan.textures[i];
        if (texture.first_step < 0 || !half_of(texture.format)) continue;
        const std::string name = texture.name.substr(texture.name.find('.') + 1);
        const std::string plane = texture.imported ? one.passes[0] + ", input " + name : name;
        // The scenes' colors are exact in half.
        if (texture.imported && texture.role == Role::color) continue;
        if (!seen.insert(plane).second) continue;
        if (ends_with(name, "tile_max")) {
            for (const char* storage : {"fp16", "unorm8"})
                variants.push_back({"half_velocity", storage,
                                    plan_of(one, frame, Precision::fp32,
                                            {{"velocity_storage", std::string(storage)}})});
        }
        variants.push_back({plane, "fp16", with_half(plan, half, i)});
    }
    std::string all;
    for (const std::string& pass : one.passes) all += (all.empty() ? "" : ", ") + pass;
    if (seen.insert(all).second) variants.push_back({all + ", --precision", "fp16", half});
    return variants;
}

struct Error {
    double rms = 0, max = 0, relmse = 0;
    std::optional<double> psnr;  // none = equal as displayed
    uint64_t nonfinite = 0;
};

Error error_of(const ImageF& test, const ImageF& reference) {
    const metrics::Pair pair = require(metrics::pair_of(test, reference));
    Error error;
    error.rms = std::sqrt(metrics::mse(pair));
    error.max = metrics::difference_percentiles(pair).max;
    error.relmse = metrics::relmse(pair);
    error.psnr = metrics::psnr(pair);
    error.nonfinite = pair.test.nonfinite;
    return error;
}

std::string psnr_text(const Error& error) {
    char text[32] = "equal";
    if (error.psnr) std::snprintf(text, sizeof(text), "%.1f", *error.psnr);
    if (error.nonfinite > 0) std::strcat(text, "!");
    return text;
}

struct Ratio {
    double low = 0, median = 0, high = 0;
    explicit Ratio(const std::vector<double>& quotients)
        : low(quantile(quotients, 0.25)),
          median(quantile(quotients, 0.5)),
          high(quantile(quotients, 0.75)) {}
};

class Bench {
  public:
    Bench(const Settings& settings, const gl::Device& device)
        : settings_(settings),
          software_(device.software),
          executor_(device),
          frames_(make_frames(settings)),
          planes_(frames_[0].planes) {
        executor_.set_timing(true);
    }
    const char* timing_source() const { return executor_.timing_source(); }
    Executor& executor() { return executor_; }

    void run(const Case& one, std::set<std::string>& seen) {
        std::vector<Variant> variants = variants_of(one, frames_[0], seen);
        std::erase_if(variants, [&](const Variant& v) {
            return (v.plane + " " + v.storage).find(settings_.only) == std::string::npos;
        });
        if (variants.empty()) return;
        std::vector<std::vector<Error>> errors(variants.size());
        Error truth;
        std::vector<Error> truths(variants.size());
        for (size_t s = 0; s < frames_.size(); ++s) {
            const ImageF exact = picture(plan_of(one, frames_[s], Precision::fp32), frames_[s]);
            const ImageF reference = s == 0 ? reference_of(one, frames_[s]) : ImageF();
            if (s == 0) truth = error_of(exact, reference);
            // Plans depend on the scene's facts, so each scene makes its own.
            std::set<std::string> again = before_;
            const std::vector<Variant> same = variants_of(one, frames_[s], again);
            for (size_t v = 0; v < variants.size(); ++v) {
                for (const Variant& other : same) {
                    if (other.plane != variants[v].plane || other.storage != variants[v].storage)
                        continue;
                    const ImageF test = picture(other.plan, frames_[s]);
                    errors[v].push_back(error_of(test, exact));
                    if (s == 0) truths[v] = error_of(test, reference);
                }
            }
        }
        const Plan plan = plan_of(one, frames_[0], Precision::fp32);
        for (size_t v = 0; v < variants.size(); ++v) {
            const Error& error = errors[v][0];
            std::printf("%-47s %-6s %6.2f", variants[v].plane.c_str(), variants[v].storage.c_str(),
                        (bytes_of(plan) - bytes_of(variants[v].plan)) / (1024.0 * 1024.0));
            print_times(plan, variants[v].plan);
            std::printf(" %8.1e %8.1e %8.1e", error.rms, error.max, error.relmse);
            for (const Error& scene : errors[v]) std::printf(" %6s", psnr_text(scene).c_str());
            std::printf("  %7.1e %7.1e\n", truth.relmse, truths[v].relmse);
            std::fflush(stdout);
        }
        before_ = seen;
    }

  private:
    static std::vector<BenchFrame> make_frames(const Settings& settings) {
        std::vector<BenchFrame> frames;
        for (const std::string& scene : scenes())
            frames.push_back(make_frame(scene, settings.width, settings.height));
        return frames;
    }
    static double bytes_of(const Plan& plan) {
        double bytes = 0;
        for (const PlanTexture& texture : plan.textures)
            if (texture.first_step >= 0) bytes += double(texture.bytes());
        return bytes;
    }
    ImageF picture(const Plan& plan, const BenchFrame& frame) {
        return require(executor_.filter(plan, frame.planes)).at(Role::color);
    }
    double milliseconds(const Plan& plan, const std::map<Role, unsigned>& inputs) {
        double sum = 0;
        // On a GPU one run is too short to separate from the driver's time.
        for (int i = 0; i < (software_ ? 1 : 16); ++i) {
            require(executor_.run(plan, inputs));
            for (const PassTime& time : finished_times(executor_)) sum += time.milliseconds;
        }
        return sum;
    }
    // The two alternate, and so does which is first.
    void print_times(const Plan& plan, const Plan& variant) {
        const auto inputs = planes_.inputs_of(plan), others = planes_.inputs_of(variant);
        std::vector<double> times, quotients, cpu_quotients;
        for (int i = -2; i < settings_.iterations; ++i) {
            double wall[2], cpu[2];
            for (const int turn : {0, 1}) {
                const int which = (i + 2 + turn) % 2;
                const double before = cpu_milliseconds();
                wall[which] = milliseconds(which ? variant : plan, which ? others : inputs);
                cpu[which] = cpu_milliseconds() - before;
            }
            if (i < 0) continue;  // warm-up
            times.push_back(wall[0]);
            quotients.push_back(wall[1] / wall[0]);
            cpu_quotients.push_back(cpu[1] / cpu[0]);
        }
        const Ratio wall(quotients), cpu(cpu_quotients);
        std::printf(" %7.1f %5.2f %4.2f-%4.2f", quantile(times, 0.5), wall.median, wall.low,
                    wall.high);
        if (software_) std::printf(" %5.2f %4.2f-%4.2f", cpu.median, cpu.low, cpu.high);
    }

    Settings settings_;
    bool software_;
    Executor executor_;
    std::vector<BenchFrame> frames_;
    DevicePlanes planes_;           // of the first scene, which is timed
    std::set<std::string> before_;  // planes of earlier cases
};

// How the device rounds float to half, tested by copying a few numbers.
std::string conversion_text(Executor& executor) {
    FramePlanes planes;
    ImageF& color = planes[Role::color] = ImageF(1, 1, 4);
    color.data = {1 + 0x1.8p-11f, 65519, 1e5f, 0x1.8p-25f};
    Plan plan;
    plan.width = plan.height = 1;
    plan.passes = {{"copy", "", false}};
    plan.textures.resize(2);
    for (PlanTexture& texture : plan.textures) {
        texture.width = texture.height = 1;
        texture.first_step = texture.last_step = 0;
    }
    plan.textures[0].imported = true;
    plan.textures[1].format = Format::rgba16f;
    plan.textures[1].last_step = 1;  // an output
    plan.steps.resize(1);
    plan.steps[0].program.file = "bench/copy.comp";
    plan.steps[0].bindings = {{0, 0, Access::sample_nearest}, {0, 1, Access::write}};
    plan.reads = {Role::color};
    plan.outputs[Role::color] = 1;
    const FramePlanes stored = require(executor.filter(plan, planes));
    const float* value = stored.at(Role::color).data.data();
    return concat("a half of 1 + 0.75 steps is ", value[0] > 1 ? "rounded up" : "cut off",
                  ", of 65519 is ", value[1], ", of 1e5 is ", value[2],
                  ", of 0.75 of the least is ", value[3]);
}

}  // namespace

int main(int argc, char** argv) {
    const Settings settings = parse_settings(argc, argv, 15);
    const auto context = require(egl::Context::create());
    Bench bench(settings, context->device());
    std::printf("%s\nclock: %s; %dx%d; median of %d pairs\n%s\n",
                device_text(context->device()).c_str(), bench.timing_source(), settings.width,
                settings.height, settings.iterations, conversion_text(bench.executor()).c_str());
    std::printf(
        "MiB: saved of all textures. ms: the pass in fp32. time: variant / fp32, CPU: the same of "
        "all threads' CPU time.\nErrors against fp32: of linear color in scene mixed, then PSNR in "
        "dB as displayed, ! = non-finite pixels.\nref: relMSE against the double reference, fp32 "
        "and variant.\n\n");
    std::printf("%-47s %-6s %6s %7s %5s %9s", "plane", "as", "MiB", "ms", "time", "quartiles");
    if (context->device().software) std::printf(" %5s %9s", "CPU", "quartiles");
    std::printf(" %8s %8s %8s", "RMS", "max", "relMSE");
    for (const std::string& scene : scenes()) std::printf(" %6.6s", scene.c_str());
    std::printf("  %7s %7s\n", "ref", "ref");
    std::set<std::string> seen;
    for (const Case& one : cases()) bench.run(one, seen);
    return 0;
}

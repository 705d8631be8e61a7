#include "tools/measure/experiment/converge.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "chain/pass/depth_at.h"

namespace postchain::experiment {
namespace {

// `value` moved by `offset` steps, wrapping in the row's range.
int64_t moved_on(const Parameter& row, int64_t value, int offset) {
    const double span = row.max - row.min + 1;
    return int64_t(row.min + std::fmod(double(value) - row.min + offset, span));
}

// Metrics that are listed in the split.
const std::vector<std::string>& side_by_side() {
    static const std::vector<std::string> names = {"hdr_flip", "relmse", "smape"};
    return names;
}

Result<std::map<std::string, double>> measure_part(const ImageF& test, const ImageF& reference,
                                                   const metrics::ExposureRange& exposures,
                                                   const metrics::FlipSettings& flip) {
    ASSIGN_OR_RETURN(auto pair, metrics::pair_of(test, reference));
    metrics::CompareSettings settings;
    settings.metrics = {side_by_side().begin(), side_by_side().end()};
    settings.exposures = exposures;
    settings.flip = flip;
    ASSIGN_OR_RETURN(auto compared, metrics::compare(pair, settings));
    std::map<std::string, double> values;
    for (const auto& [name, value] : compared.values)
        if (value) values[name] = *value;
    return values;
}

bool samples(const ChainLink& link) {
    const auto& rows = link.type->parameters->rows();
    return std::ranges::any_of(rows, [&](const Parameter& row) {
        return row.convergence != Convergence::none && reads(link, row);
    });
}

}  // namespace

Chain converged_chain(const Chain& chain, std::vector<std::string>* changes) {
    Chain copy = chain.clone();
    for (size_t i = 0; i < copy.links.size(); ++i) {
        auto& link = copy.links[i];
        if (changes && !samples(link))
            changes->push_back(concat("passes[", i, "].", link.type->name, " does not sample"));
        for (const Parameter& row : link.type->parameters->rows()) {
            if (!reads(link, row)) continue;
            const ParameterValue before = row.get(link.pass->parameters());
            if (row.convergence == Convergence::set) {
                const ParameterValue value = row.type == ParameterType::integer
                                                 ? ParameterValue(int64_t(row.converged))
                                                 : ParameterValue(row.converged);
                row.set(link.pass->parameters(), value);
                if (changes && value != before)
                    changes->push_back(concat("passes[", i, "].", link.type->name, ".", row.key,
                                              " ", text_of(before), " -> ", text_of(value)));
            } else if (row.convergence == Convergence::averaged && changes) {
                changes->push_back(
                    concat("passes[", i, "].", link.type->name, ".", row.key, " averaged"));
            }
        }
    }
    return copy;
}

Chain with_seed_offset(const Chain& chain, int offset) {
    Chain copy = chain.clone();
    for (auto& link : copy.links) {
        for (const Parameter& row : link.type->parameters->rows()) {
            if (row.convergence != Convergence::averaged || !reads(link, row)) continue;
            const auto value = std::get<int64_t>(row.get(link.pass->parameters()));
            row.set(link.pass->parameters(), moved_on(row, value, offset));
        }
    }
    return copy;
}

bool has_seeds(const Chain& chain) {
    return !seeds_of(chain).empty();
}

bool samples(const Chain& chain) {
    return std::ranges::any_of(chain.links, [](const ChainLink& link) { return samples(link); });
}

Result<Converged> converge(const Chain& chain, const FrameDescription& frame, PlaneView planes,
                           const PlanOptions& options, Executor& executor, int seeds) {
    Converged converged;
    const Chain many = converged_chain(chain, &converged.changes);
    converged.sampled = samples(chain);
    PlanOptions exact = options;
    exact.precision = Precision::fp32;
    FrameDescription known = frame;
    find_depths(many, planes, known);
    const int count = has_seeds(many) ? std::max(1, seeds) : 1;
    ImageD mean, squares;  // Welford's running mean and sum of squares
    ImageF first;
    for (int i = 0; i < count; ++i) {
        ASSIGN_OR_RETURN(auto plan, make_plan(with_seed_offset(many, i), known, exact));
        ASSIGN_OR_RETURN(auto result, executor.filter(plan, planes));
        const ImageF& color = result.at(Role::color);
        if (i == 0) {
            mean = squares = ImageD(color.width, color.height, 3);
            first = color;
        } else if (i == 1 && color == first) {
            break;  // nothing is random
        }
        ++converged.seeds;
        for (size_t p = 0; p < color.pixels(); ++p) {
            for (size_t c = 0; c < 3; ++c) {
                const double v = double(color.data[size_t(color.channels) * p + c]);
                double& m = mean.data[3 * p + c];
                const double d = v - m;
                m += d / converged.seeds;
                squares.data[3 * p + c] += d * (v - m);
            }
        }
    }
    converged.rgb = image_cast<float>(mean);
    if (converged.seeds > 1) {
        double sum = 0;
        for (double v : squares.data) sum += v;
        converged.noise = sum / double(squares.data.size()) /
                          (double(converged.seeds - 1) * double(converged.seeds));
    }
    return converged;
}

Result<report::ErrorSplit> split_error(int frame, const ImageF& gpu, const ImageD& reference,
                                       const Converged& converged, const metrics::RgbImage* truth,
                                       const metrics::ExposureRange& exposures,
                                       const metrics::FlipSettings& flip) {
    const ImageF rounded = image_cast<float>(reference);
    const ImageF& c = converged.sampled ? converged.rgb : rounded;
    if (gpu.width != c.width || gpu.height != c.height || reference.width != c.width ||
        reference.height != c.height)
        return Status(StatusCode::input, "the images of an error split differ in size");
    report::ErrorSplit split;
    split.frames = {frame};
    split.seeds = converged.seeds;
    split.converged_noise = converged.noise;
    split.convergence = converged.changes;
    split.mse.precision = mean_squared(gpu, reference);
    split.mse.sampling = converged.sampled ? mean_squared(reference, c) : 0;
    if (!converged.sampled)
        split.notes.push_back("no pass of this chain samples: sampling error 0 by definition");
    const auto side = [&](const ImageF& test, const ImageF& against,
                          std::optional<double> report::ErrorParts::*part) {
        ASSIGN_OR_RETURN(auto values, measure_part(test, against, exposures, flip));
        for (const auto& [name, value] : values) split.others[name].*part = value;
        return Status();
    };
    RETURN_IF_ERROR(side(gpu, rounded, &report::ErrorParts::precision));
    RETURN_IF_ERROR(side(rounded, c, &report::ErrorParts::sampling));
    if (truth) {
        if (truth->rgb.width != c.width || truth->rgb.height != c.height)
            return Status(StatusCode::input, "the ground truth of an error split has another size");
        split.mse.model = mean_squared(c, truth->rgb);
        split.mse.total = mean_squared(gpu, truth->rgb);
        split.cross =
            *split.mse.total - *split.mse.precision - *split.mse.sampling - *split.mse.model;
        RETURN_IF_ERROR(side(c, truth->rgb, &report::ErrorParts::model));
        RETURN_IF_ERROR(side(gpu, truth->rgb, &report::ErrorParts::total));
    }
    return split;
}

report::ErrorSplit mean_split(const std::vector<report::ErrorSplit>& splits) {
    report::ErrorSplit mean;
    if (splits.empty()) return mean;
    mean = splits.front();
    const auto add = [](std::optional<double>& sum, const std::optional<double>& value) {
        if (sum && value)
            *sum += *value;
        else
            sum.reset();
    };
    const auto each = [](report::ErrorParts& sum, const report::ErrorParts& value,
                         const auto& work) {
        work(sum.precision, value.precision);
        work(sum.sampling, value.sampling);
        work(sum.model, value.model);
        work(sum.total, value.total);
    };
    for (size_t i = 1; i < splits.size(); ++i) {
        mean.frames.insert(mean.frames.end(), splits[i].frames.begin(), splits[i].frames.end());
        mean.converged_noise += splits[i].converged_noise;
        add(mean.cross, splits[i].cross);
        each(mean.mse, splits[i].mse, add);
        for (auto& [name, parts] : mean.others) {
            const auto other = splits[i].others.find(name);
            each(parts, other == splits[i].others.end() ? report::ErrorParts{} : other->second,
                 add);
        }
    }
    const double n = double(splits.size());
    const auto divide = [n](std::optional<double>& sum, const std::optional<double>&) {
        if (sum) *sum /= n;
    };
    mean.converged_noise /= n;
    divide(mean.cross, {});
    each(mean.mse, {}, divide);
    for (auto& [name, parts] : mean.others) each(parts, {}, divide);
    return mean;
}

}  // namespace postchain::experiment

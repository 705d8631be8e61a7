// postchain diff: error metrics of B against the reference A, for one image or a sequence.
//
//   file --profile--> color role --> Pair --tools/metrics--> values, error map
//
// HDR-FLIP's exposures come from the references only. For a sequence all references are read first,
// so that every frame is measured at the same exposures.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <optional>
#include <set>

#include "chain/base/printable.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/metrics/compare.h"
#include "tools/metrics/temporal.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/image/png.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/memory.h"

namespace postchain {
namespace {

using io::Json;
using metrics::Values;

constexpr const char* kDefaultMap = "hdr_flip";

struct DiffOptions {
    std::string a, b;  // A is the reference
    std::vector<std::string> metrics;
    std::vector<std::string> maps;
    std::string map_metric;  // empty: not given, kDefaultMap
    io::OnExisting on_existing = io::OnExisting::fail;
    std::vector<std::string> fail_above;
    std::optional<double> pixels_per_degree;  // those of FlipSettings if not given
    std::string tone_mapper;
    std::optional<double> over;
};

struct DiffFrame {
    int number = 0;
    std::string a, b;  // paths
    std::string both() const { return a + " against " + b; }
};

struct DiffWork {
    sequence::SourceSettings source;
    std::vector<DiffFrame> frames;
    bool sequence = false;
    metrics::CompareSettings compare;
    std::optional<double> over;      // gray that both are composited over first
    std::set<std::string> temporal;  // of metrics::temporal_rows()
    std::vector<metrics::MetricLimit> limits;
    std::vector<io::PathPattern> maps;
    io::OutputFiles files;  // the maps and the compared inputs

    // As a number or a map.
    bool wants(const char* metric) const {
        return compare.metrics.count(metric) > 0 || compare.map == metric;
    }
};

std::string known_metrics() {
    std::string text;
    for (const auto* rows : {&metrics::metric_rows(), &metrics::temporal_rows()})
        for (const auto& row : *rows) text += (text.empty() ? "" : ", ") + row.name;
    return text;
}

Status check_metric(const char* option, const std::string& name, bool sequence) {
    if (!metrics::is_temporal(name) && !metrics::find_metric(name))
        return Status(StatusCode::usage,
                      concat(option, ": unknown metric '", name, "'; known are ", known_metrics()));
    if (metrics::is_temporal(name) && !sequence)
        return Status(StatusCode::usage,
                      concat(option, ": ", name, " needs two frames or more; name a sequence"));
    return Status();
}

Result<metrics::MetricLimit> limit_of(const std::string& text) {
    ASSIGN_OR_RETURN(auto limit, metrics::parse_limit("fail_above", text));
    const auto* row = metrics::find_metric(limit.metric);
    if (row && !row->is_error)
        return Status(StatusCode::usage, "--fail-above: higher " + limit.metric +
                                             " is better; use an error metric, e.g. mse=0.001");
    return limit;
}

Result<std::vector<DiffFrame>> frames_of(const Options& options, const DiffOptions& diff,
                                         DiffWork& work) {
    bool& sequence = work.sequence;
    ASSIGN_OR_RETURN(const auto a, io::PathPattern::parse(diff.a).at("A"));
    ASSIGN_OR_RETURN(const auto b, io::PathPattern::parse(diff.b).at("B"));
    if (a.has_token() != b.has_token())
        return Status(StatusCode::usage,
                      concat("diff: ", a.text(), " and ", b.text(),
                             ": one is a sequence, the other a single image; give two of a kind"));
    work.files.read(a, "the reference");
    work.files.read(b, "the compared image");
    if (!options.job.profile.empty()) work.files.read({options.job.profile, "the profile"});
    sequence = a.has_token();
    const auto in_a = a.discover(), in_b = b.discover();
    for (const auto& [pattern, found] : {std::pair(&a, &in_a), std::pair(&b, &in_b)})
        if (found->empty() && (!sequence || options.job.frames.empty()))
            return Status(StatusCode::input, pattern->text() + ": " + io::why_none(*pattern))
                .at(a.text() + " against " + b.text());
    if (!sequence) {
        if (!options.job.frames.empty())
            return Status(StatusCode::usage,
                          "--frames: A and B are single images; give patterns (A.####.exr)");
        return std::vector<DiffFrame>{{a.literal_frame(), a.text(), b.text()}};
    }
    std::vector<int> numbers;
    if (!options.job.frames.empty()) {
        ASSIGN_OR_RETURN(auto range, io::FrameRange::parse(options.job.frames).at("--frames"));
        numbers = std::move(range.frames);
    } else {
        for (const auto& [number, path] : in_a) numbers.push_back(number);
        std::vector<int> more;
        for (const auto& [number, path] : in_b)
            if (!in_a.count(number)) more.push_back(number);
        if (!more.empty())
            log::warning(concat(b.text(), " has frames that ", a.text(),
                                " lacks: ", sequence::frames_text(more)));
    }
    std::vector<DiffFrame> frames;
    std::vector<int> not_in_a, not_in_b;
    for (int number : numbers) {
        const auto path_a = in_a.find(number), path_b = in_b.find(number);
        if (path_a == in_a.end()) not_in_a.push_back(number);
        if (path_b == in_b.end()) not_in_b.push_back(number);
        if (path_a != in_a.end() && path_b != in_b.end())
            frames.push_back({number, path_a->second, path_b->second});
    }
    if (not_in_a.empty() && not_in_b.empty()) return frames;
    std::string text = a.text() + " against " + b.text() + ": frames missing on disk:";
    if (!not_in_a.empty()) text += " of A " + sequence::frames_text(not_in_a);
    if (!not_in_b.empty()) text += " of B " + sequence::frames_text(not_in_b);
    return Status(StatusCode::input, text);
}

Status add_maps(const DiffOptions& diff, DiffWork& work) {
    for (const auto& text : diff.maps) {
        ASSIGN_OR_RETURN(auto pattern, io::PathPattern::parse(text).at("--map"));
        if (!text.ends_with(".png") && !text.ends_with(".exr"))
            return Status(StatusCode::usage,
                          "--map: " + text + " is neither .png nor .exr; name such a file");
        if (work.sequence && !pattern.has_token() && work.frames.size() > 1)
            return Status(StatusCode::usage,
                          "--map: " + text + " is the same file for every frame; give a pattern");
        for (const auto& frame : work.frames)
            work.files.write(io::OutputFile{pattern.format(frame.number),
                                            concat("the error map of frame ", frame.number),
                                            "name another map with --map"});
        work.maps.push_back(std::move(pattern));
    }
    if (!diff.map_metric.empty() && !metrics::find_map(diff.map_metric)) {
        std::string known;
        for (const auto& row : metrics::map_rows()) known += (known.empty() ? "" : ", ") + row.name;
        return Status(StatusCode::usage, concat("--map-metric: unknown error map '",
                                                diff.map_metric, "'; known are ", known));
    }
    if (!work.maps.empty())
        work.compare.map = diff.map_metric.empty() ? kDefaultMap : diff.map_metric;
    RETURN_IF_ERROR(work.files.check());
    RETURN_IF_ERROR(work.files.check_folders());
    work.files.remove_left_temporaries();
    return Status();
}

// No option is without effect.
Status check_read(const DiffOptions& diff, const DiffWork& work) {
    const auto unread = [](const char* option, const char* what) {
        return Status(StatusCode::usage, concat(option, ": has an effect on ", what,
                                                " only, which is not asked for; ask for it, or "
                                                "leave the option out"));
    };
    if (!diff.map_metric.empty() && work.maps.empty()) return unread("--map-metric", "--map");
    if (!diff.tone_mapper.empty() && !work.wants("hdr_flip"))
        return unread("--tone-mapper", "hdr_flip");
    if (diff.pixels_per_degree && !work.wants("hdr_flip") && !work.wants("flip"))
        return unread("--ppd", "flip or hdr_flip");
    return Status();
}

Result<sequence::ColorFile> read_logged(const DiffWork& work, const std::string& path, int frame) {
    auto color = sequence::read_color(work.source, path, frame);
    if (color.ok()) log::detail(concat(path, ": profile ", color->profile));
    return color;
}

// Errors: usage; input (frames missing on disk); output (existing maps).
Result<DiffWork> work_of(const Options& options, const DiffOptions& diff) {
    DiffWork work;
    work.files = io::OutputFiles(diff.on_existing);
    ASSIGN_OR_RETURN(work.frames, frames_of(options, diff, work));
    if (!options.job.profile.empty()) {
        ASSIGN_OR_RETURN(work.source.profile, find_profile(options.job.profile).at("--profile"));
    }
    work.source.view_layer = options.job.view_layer;
    work.source.view = options.job.view;
    ASSIGN_OR_RETURN(work.source.max_memory, sequence::memory_limit_of(options.job.max_memory));
    const bool many = work.frames.size() > 1;
    for (const auto& row : metrics::metric_rows())
        if (diff.metrics.empty()) work.compare.metrics.insert(row.name);
    for (const auto& row : metrics::temporal_rows())
        if (diff.metrics.empty() && many) work.temporal.insert(row.name);
    const auto want = [&](const char* option, const std::string& name) {
        RETURN_IF_ERROR(check_metric(option, name, many));
        (metrics::is_temporal(name) ? work.temporal : work.compare.metrics).insert(name);
        return Status();
    };
    for (const auto& name : diff.metrics) RETURN_IF_ERROR(want("--metric", name));
    for (const auto& text : diff.fail_above) {
        ASSIGN_OR_RETURN(auto limit, limit_of(text));
        RETURN_IF_ERROR(want("--fail-above", limit.metric));
        work.limits.push_back(std::move(limit));
    }
    // If only temporal metrics are requested, the set must not be empty: that would select all
    // metrics.
    if (work.compare.metrics.empty()) work.compare.metrics.insert("nonfinite");
    work.over = diff.over;
    if (diff.pixels_per_degree) work.compare.flip.pixels_per_degree = *diff.pixels_per_degree;
    // The parser has checked the name.
    if (!diff.tone_mapper.empty())
        work.compare.flip.tone_mapper = *metrics::find_tone_mapper(diff.tone_mapper);
    work.compare.flip.threads = sequence::threads_of(options.threads);
    RETURN_IF_ERROR(add_maps(diff, work));
    RETURN_IF_ERROR(check_read(diff, work));
    return work;
}

// The color of both files, composited over the gray if given. Errors (input) name both files: no
// color, unreadable, different windows.
Result<metrics::Pair> read_pair(const DiffWork& work, const DiffFrame& frame) {
    const std::string both = frame.both();
    ASSIGN_OR_RETURN(auto a, read_logged(work, frame.a, frame.number).at(both));
    ASSIGN_OR_RETURN(auto b, read_logged(work, frame.b, frame.number).at(both));
    const auto same = [&](const char* what, const io::Window& wa, const io::Window& wb) {
        if (wa == wb) return Status();
        return Status(StatusCode::input,
                      concat(both, ": ", what, " differ: ", wa.width(), "x", wa.height(), " ",
                             wa.text(), " and ", wb.width(), "x", wb.height(), " ", wb.text()));
    };
    const io::Window& display = a.display_window;
    RETURN_IF_ERROR(same("display windows", display, b.display_window));
    if (a.window != b.window) {
        log::info(concat(both, ": data windows differ, ", a.window.text(), " and ", b.window.text(),
                         ": compared in the display window ", display.text(),
                         "; missing pixels count as clear"));
        for (sequence::ColorFile* color : {&a, &b})
            color->rgba = io::placed(color->rgba, color->window, display);
    }
    if (work.over)
        for (sequence::ColorFile* color : {&a, &b})
            metrics::composite_over(color->rgba, *work.over);
    if (a.luma_weights != b.luma_weights)
        log::warning(both + ": chromaticities differ; values are compared without conversion");
    return metrics::pair_of(b.rgba, a.rgba).at(both);
}

Result<metrics::RgbImage> read_reference(const DiffWork& work, const DiffFrame& frame) {
    ASSIGN_OR_RETURN(auto color, read_logged(work, frame.a, frame.number).at(frame.both()));
    if (work.over) metrics::composite_over(color.rgba, *work.over);
    return metrics::rgb_image_of(color.rgba).at(frame.a);
}

// Exposures of a sequence, from all references.
Status find_exposures(DiffWork& work, const StopOnSignal& stop) {
    metrics::ExposureRange range;
    for (size_t i = 0; i < work.frames.size() && !stop.asked(); ++i) {
        const DiffFrame& frame = work.frames[i];
        log::progress(concat("exposures of ", frame.a));
        ASSIGN_OR_RETURN(auto picture, read_reference(work, frame));
        range =
            metrics::joined(range, metrics::exposure_range(picture, work.compare.flip.tone_mapper));
    }
    work.compare.exposures = range;
    return Status();
}

Json to_json(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

// `constants`: with those of the metrics, which no option changes.
Json settings_json(const DiffWork& work, const metrics::ExposureRange& range, bool constants) {
    const auto& flip = work.compare.flip;
    Json json = {{"pixels_per_degree", flip.pixels_per_degree}};
    if (work.over) json["over"] = *work.over;
    if (work.wants("hdr_flip")) {
        json["tone_mapper"] = metrics::name_of(flip.tone_mapper);
        json["exposure_start"] = range.start;
        json["exposure_stop"] = range.stop;
        json["exposures"] = range.count();
    }
    if (constants)
        for (const auto& [name, value] : metrics::metric_constants()) json[name] = value;
    return json;
}

std::string number_text(double value) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.6g", value);
    return text;
}

// PSNR has no value only if the pictures are equal.
std::string value_text(const std::string& name, const std::optional<double>& value) {
    if (value) return number_text(*value);
    return name == "psnr" ? "inf" : "none";
}

void print_table(const Values& values, const metrics::ExposureRange& range) {
    for (const auto& [name, value] : values) {
        std::string what;
        if (name == "flip") what = "  of values clamped to 0..1";
        if (name == "hdr_flip")
            what = concat("  over ", range.count(), " exposures, EV ", number_text(range.start),
                          " .. ", number_text(range.stop));
        const std::string text = value_text(name, value);
        std::printf("  %-16s %-*s%s\n", name.c_str(), what.empty() ? 0 : 12, text.c_str(),
                    what.c_str());
    }
}

void print_settings(const Json& settings) {
    std::string text = "with";
    for (const auto& [name, value] : settings.items())
        text += " " + name + " " +
                (value.is_string() ? value.get<std::string>() : number_text(value.get<double>()));
    std::printf("%s\n", text.c_str());
}

// Reports each exceeded limit; true if there is one.
bool exceeds(const DiffWork& work, const Values& values, const std::string& where) {
    bool exceeded = false;
    for (const auto& limit : work.limits)
        for (const auto& [name, value] : values) {
            if (name != limit.metric || !value || !(*value > limit.value)) continue;
            exceeded = true;
            log::error(concat(where, ": ", name, " ", number_text(*value), " is above ",
                              number_text(limit.value)));
        }
    return exceeded;
}

// Reports non-finite pixels that limits would not notice; true if there are any.
bool hides_nonfinite(const DiffWork& work, uint64_t pixels, const std::string& where) {
    const std::string fault = metrics::nonfinite_fault(work.limits, double(pixels));
    if (!fault.empty()) log::error(concat(where, ": ", fault));
    return !fault.empty();
}

// PNG: magma over 0..shown_max. EXR: the values.
Status write_map(const DiffWork& work, const std::string& path, const ImageF& map) {
    const auto& row = *metrics::find_map(work.compare.map);
    ASSIGN_OR_RETURN(const auto permit, work.files.permit(path));
    if (path.ends_with(".exr")) return io::write_planes_exr(path, map, {"Y"}, permit).status();
    ImageF shown = map;
    for (float& v : shown.data) v /= float(row.shown_max);
    ASSIGN_OR_RETURN(const auto colors, io::magma_of(shown).at(path));
    ASSIGN_OR_RETURN(const auto png, io::encode_png(colors).at(path));
    return io::atomic_write_text(path, png, permit).status();
}

Status write_maps(const DiffWork& work, const DiffFrame& frame, const ImageF& map) {
    for (const auto& pattern : work.maps)
        RETURN_IF_ERROR(write_map(work, pattern.format(frame.number), map));
    return Status();
}

Result<int> diff_subcommand(const Options& options, const DiffOptions& diff) {
    ASSIGN_OR_RETURN(DiffWork work, work_of(options, diff));
    io::set_exr_threads(sequence::threads_of(options.threads));
    const StopOnSignal stop;
    if (work.wants("hdr_flip") && work.frames.size() > 1)
        RETURN_IF_ERROR(find_exposures(work, stop));

    std::vector<Values> all;
    metrics::TemporalError temporal;
    metrics::ExposureRange exposures;
    bool exceeded = false;
    // No summary of a part of the frames.
    const auto end_with = [&](const Status& failure) {
        fail(failure);
        return exit_code(failure, all.size());
    };
    for (const DiffFrame& frame : work.frames) {
        if (stop.asked()) break;
        log::progress(
            concat("frame ", frame.number, ", ", all.size(), " of ", work.frames.size(), " done"));
        auto pair = read_pair(work, frame);
        if (!pair.ok()) return end_with(pair.status());
        auto compared = metrics::compare(*pair, work.compare);
        if (!compared.ok()) return end_with(compared.status());
        exposures = compared->exposures;
        Values values = compared->values;
        if (!work.temporal.empty()) {
            if (Status status = temporal.add(*pair); !status.ok())
                return end_with(status.at(frame.a + " against the frame before"));
            for (const auto& value : temporal.last())
                if (work.temporal.contains(value.first)) values.push_back(value);
        }
        if (const auto bad = pair->reference.nonfinite)
            log::warning(
                concat(frame.a, ": ", bad, " reference pixels are non-finite, ", "treated as 0"));
        if (Status status = write_maps(work, frame, compared->map); !status.ok())
            return end_with(status);

        log::progress("");
        if (options.json) {
            Json json = {{"frame", frame.number}, {"a", frame.a}, {"b", frame.b}};
            for (const auto& [name, value] : values) json[name] = to_json(value);
            json["nonfinite_reference"] = pair->reference.nonfinite;
            if (!work.sequence) json["settings"] = settings_json(work, exposures, true);
            print_line(json);
        } else if (work.sequence) {
            std::string text = concat("frame ", frame.number, ":");
            for (const auto& [name, value] : values)
                text += " " + name + " " + value_text(name, value);
            std::printf("%s\n", text.c_str());
            std::fflush(stdout);
        } else {
            std::printf("%s against %s\n", printable(frame.b).c_str(), printable(frame.a).c_str());
            print_table(values, exposures);
        }
        exceeded |= exceeds(work, values, frame.b);
        exceeded |= hides_nonfinite(work, pair->test.nonfinite, frame.b);
        exceeded |= hides_nonfinite(work, pair->reference.nonfinite, frame.a);
        all.push_back(std::move(values));
    }
    if (stop.asked()) return stop.interrupted("no summary; run the same command again");

    const Json settings = settings_json(work, exposures, options.json || options.verbose);
    if (work.sequence) {
        Values summary = metrics::summary_of(all);
        if (options.json) {
            Json json = {{"summary", true}, {"frames", all.size()}, {"a", diff.a}, {"b", diff.b}};
            for (const auto& [name, value] : summary) json[name] = to_json(value);
            json["settings"] = settings;
            print_line(json);
        } else {
            std::printf("%s against %s, %zu frame%s\n", printable(diff.b).c_str(),
                        printable(diff.a).c_str(), all.size(), all.size() == 1 ? "" : "s");
            print_table(summary, exposures);
        }
        exceeded |= exceeds(work, summary, diff.b);
    }
    if (options.verbose && !options.json) print_settings(settings);
    if (!work.maps.empty()) {
        const auto& row = *metrics::find_map(work.compare.map);
        log::info(concat("error maps of ", row.name, ": magma over 0..", row.shown_max,
                         " in PNG, the values in EXR"));
    }
    return exceeded ? kExitThreshold : kExitOk;
}

}  // namespace

RunSubcommand add_diff(CLI::App& subcommand, Options& o) {
    const auto diff = std::make_shared<DiffOptions>();
    const metrics::FlipSettings flip;
    std::string names, maps;
    for (const auto* rows : {&metrics::metric_rows(), &metrics::temporal_rows()})
        for (const auto& row : *rows)
            names += concat(names.empty() ? "" : ", ", row.name, " (", row.help, ")");
    for (const auto& row : metrics::map_rows())
        maps += concat(maps.empty() ? "" : ", ", row.name, " (", row.help, "; brightest at ",
                       row.shown_max, ")");
    subcommand.add_option("A", diff->a, "reference: an image, or a sequence A.####.exr")
        ->required();
    subcommand.add_option("B", diff->b, "image or sequence to compare with A")->required();
    subcommand
        .add_option("--frames", o.job.frames,
                    "frames of sequences: 1-10,20-40x2 (default: all "
                    "of A on disk)")
        ->type_name("RANGE");
    add_list(subcommand, "--metric", "NAME", diff->metrics,
             "metric, may be repeated (default: all): " + names);
    add_list(subcommand, "--fail-above", "METRIC=NUMBER", diff->fail_above,
             "exit with 8 if a frame or the summary exceeds it, may be repeated: "
             "flip=0.05");
    add_list(subcommand, "--map", "FILE", diff->maps,
             "error map, may be repeated: .png in magma colors or .exr with values; a "
             "pattern for sequences");
    subcommand.add_option("--map-metric", diff->map_metric, "metric of the map: " + maps)
        ->type_name("NAME")
        ->default_str(kDefaultMap);
    add_on_existing(subcommand, "if a map exists", diff->on_existing);
    subcommand
        .add_option("--over", diff->over,
                    "composite both over this linear gray before comparing "
                    "(default: compare premultiplied color)")
        ->type_name("GRAY")
        ->check(number_within(CLI::Range(0.0, 65504.0)));
    subcommand
        .add_option("--ppd", diff->pixels_per_degree, "pixels per degree of visual angle, for FLIP")
        ->check(
            number_within(CLI::Range(metrics::kMinPixelsPerDegree, metrics::kMaxPixelsPerDegree)))
        ->default_str(number_text(flip.pixels_per_degree));
    subcommand.add_option("--tone-mapper", diff->tone_mapper, "tone mapper of HDR-FLIP")
        ->check(CLI::IsMember(metrics::tone_mapper_names()))
        ->default_str(metrics::name_of(flip.tone_mapper));
    subcommand.add_option("--profile", o.job.profile, "profile of both inputs (default: detected)")
        ->type_name("NAME");
    for (const char* key : {"view_layer", "view", "max_memory"})
        add_setting(subcommand, *job_parameters().find(key), &o.job);
    add_threads(subcommand, o);
    subcommand.add_flag("--json", o.json,
                        "one JSON object per frame; for sequences also a summary with "
                        "\"summary\": true");
    return [&o, diff] { return diff_subcommand(o, *diff); };
}

}  // namespace postchain

#include "tools/apps/postchain/diff.h"

#include <CLI/CLI.hpp>

#include <cstdio>

#include "chain/printable.h"
#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/print_line.h"
#include "tools/apps/postchain/stop_on_signal.h"
#include "tools/measure/metrics/temporal.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/png.h"

namespace postchain {
namespace {

using io::Json;
using metrics::Values;

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

Json settings_json(const DiffWork& work, const metrics::ExposureRange& range) {
    const auto& flip = work.compare.flip;
    Json json = {{"pixels_per_degree", flip.pixels_per_degree}};
    if (work.over) json["over"] = *work.over;
    if (work.wants("hdr_flip")) {
        json["tone_mapper"] = metrics::name_of(flip.tone_mapper);
        json["exposure_start"] = range.start;
        json["exposure_stop"] = range.stop;
        json["exposures"] = range.count();
    }
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
    const auto colors = io::magma_of(shown);
    if (!colors.ok()) return colors.status().at(path);
    const auto png = io::encode_png(*colors);
    if (!png.ok()) return png.status().at(path);
    return io::atomic_write_text(path, *png, permit).status();
}

Status write_maps(const DiffWork& work, const DiffFrame& frame, const ImageF& map) {
    for (const auto& pattern : work.maps)
        RETURN_IF_ERROR(write_map(work, pattern.format(frame.number), map));
    return Status();
}

}  // namespace

void add_diff(CLI::App& subcommand, Options& o, DiffOptions& diff) {
    const metrics::FlipSettings flip;
    std::string names, maps;
    for (const auto& row : metrics::metric_rows()) names += row.name + " (" + row.help + "), ";
    for (const auto& row : metrics::map_rows())
        maps += concat(maps.empty() ? "" : ", ", row.name, " (", row.help, "; brightest at ",
                       row.shown_max, ")");
    subcommand.add_option("A", diff.a, "reference: an image, or a sequence A.####.exr")->required();
    subcommand.add_option("B", diff.b, "image or sequence to compare with A")->required();
    subcommand
        .add_option("--frames", o.job.frames,
                    "frames of sequences: 1-10,20-40x2 (default: all "
                    "of A on disk)")
        ->type_name("RANGE");
    add_list(subcommand, "--metric", "NAME", diff.metrics,
             "metric, may be repeated (default: all): " + names +
                 "tde (mean |change of the error| from frame to frame)");
    add_list(subcommand, "--fail-above", "METRIC=NUMBER", diff.fail_above,
             "exit with 8 if a frame or the summary exceeds it, may be repeated: "
             "flip=0.05");
    add_list(subcommand, "--map", "FILE", diff.maps,
             "error map, may be repeated: .png in magma colors or .exr with values; a "
             "pattern for sequences");
    subcommand.add_option("--map-metric", diff.map_metric, "metric of the map: " + maps)
        ->type_name("NAME")
        ->default_str(kDefaultMap);
    add_on_existing(subcommand, "if a map exists", diff.on_existing);
    subcommand
        .add_option("--over", diff.over,
                    "composite both over this linear gray before comparing "
                    "(default: compare premultiplied color)")
        ->type_name("GRAY")
        ->check(number_within(0, 65504));
    subcommand
        .add_option("--ppd", diff.pixels_per_degree, "pixels per degree of visual angle, for FLIP")
        ->check(number_within(metrics::kMinPixelsPerDegree, metrics::kMaxPixelsPerDegree))
        ->default_str(number_text(flip.pixels_per_degree));
    subcommand.add_option("--tone-mapper", diff.tone_mapper, "tone mapper of HDR-FLIP")
        ->check(CLI::IsMember(metrics::tone_mapper_names()))
        ->default_str(metrics::name_of(flip.tone_mapper));
    subcommand.add_option("--profile", o.job.profile, "profile of both inputs (default: detected)")
        ->type_name("NAME");
    for (const char* key : {"layer", "view", "max_memory"})
        add_setting(subcommand, *job_parameters().find(key), &o.job);
    add_threads(subcommand, o);
    subcommand.add_flag("--json", o.json,
                        "one JSON object per frame; for sequences also a summary with "
                        "\"summary\": true");
}

int diff_subcommand(const Options& options, const DiffOptions& diff) {
    auto made = work_of(options, diff);
    if (!made.ok()) return fail(made.status());
    DiffWork& work = *made;
    io::set_exr_threads(threads_of(options));
    const StopOnSignal stop;
    if (work.wants("hdr_flip") && work.frames.size() > 1)
        if (Status status = find_exposures(work, stop); !status.ok()) return fail(status);

    std::vector<Values> all;
    metrics::TemporalError temporal;
    metrics::ExposureRange exposures;
    bool exceeded = false;
    // No summary of a part of the frames.
    const auto end_with = [&](const Status& failure) {
        fail(failure);
        return sequence::exit_code(failure, all.size());
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
        if (work.tde) {
            if (Status status = temporal.add(*pair); !status.ok())
                return end_with(status.at(frame.a + " against the frame before"));
            values.emplace_back(kTde, temporal.last());
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
            if (!work.sequence) json["settings"] = settings_json(work, exposures);
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

    const Json settings = settings_json(work, exposures);
    if (work.sequence) {
        Values summary = metrics::summary_of(all);
        if (options.json) {
            Json json = {{"summary", true}, {"frames", all.size()}, {"a", diff.a}, {"b", diff.b}};
            for (const auto& [name, value] : summary) json[name] = to_json(value);
            json["settings"] = settings;
            print_line(json);
        } else {
            std::printf("%s against %s, %zu frames\n", printable(diff.b).c_str(),
                        printable(diff.a).c_str(), all.size());
            print_table(summary, exposures);
        }
        exceeded |= exceeds(work, summary, diff.b);
    }
    if (!options.json) print_settings(settings);
    if (!work.maps.empty()) {
        const auto& row = *metrics::find_map(work.compare.map);
        log::info(concat("error maps of ", row.name, ": magma over 0..", row.shown_max,
                         " in PNG, the values in EXR"));
    }
    return exceeded ? kExitThreshold : kExitOk;
}

}  // namespace postchain

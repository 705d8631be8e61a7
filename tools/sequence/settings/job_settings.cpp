#include "tools/sequence/settings/job_settings.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "chain/base/text.h"
#include "config/profile.h"
#include "config/reporter.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/settings/color_settings.h"
#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;

// A name of the same files, however it is spelled; links are not followed.
fs::path whole(const io::PathPattern& pattern) {
    std::error_code error;
    return fs::absolute(pattern.text(), error).lexically_normal();
}

// The rules that are on by default, or the others.
std::vector<std::string> rule_names(const PassRegistry& registry, bool on_by_default) {
    std::vector<std::string> names;
    for (const auto& rule : elision_rules(registry))
        if (rule.on_by_default == on_by_default) names.push_back(rule.name);
    return names;
}

Result<std::set<std::string>> rules_of(const PassRegistry& registry, const std::string& key,
                                       const std::string& text, bool on_by_default) {
    const std::vector<std::string> known = rule_names(registry, on_by_default);
    std::set<std::string> rules;
    std::istringstream words(text);
    for (std::string word; std::getline(words, word, ',');) {
        if (std::ranges::find(known, word) == known.end())
            return Status(StatusCode::usage,
                          concat(setting(key), ": ", unknown_word("rule", word, known)));
        rules.insert(word);
    }
    return rules;
}

Result<PlanOptions> plan_options_of(const JobSettings& job, const PassRegistry& registry) {
    PlanOptions plan;
    plan.precision = job.precision;
    if (job.no_elide == "all") {
        if (!job.elide.empty())
            return Status(StatusCode::usage,
                          "{elide} contradicts {no_elide}; give one of them"_keyed);
        plan.elide = false;
        return plan;
    }
    ASSIGN_OR_RETURN(auto off, rules_of(registry, "no_elide", job.no_elide, true));
    ASSIGN_OR_RETURN(auto on, rules_of(registry, "elide", job.elide, false));
    plan.rules_off = std::move(off);
    plan.rules_on = std::move(on);
    return plan;
}

int bits_of(BitsChoice choice) {
    constexpr int kBits[] = {0, 8, 10, 12, 16, 32};
    return kBits[size_t(choice)];
}

// "keep", "filter", "filter=hero, tree_*".
Status set_cryptomatte(const std::string& policy, LayerSettings& layers) {
    if (policy == "keep") return Status();
    layers.cryptomatte = CryptomatteChoice::filter;
    if (policy == "filter") return Status();
    const std::string begin = "filter=";
    if (policy.starts_with(begin)) layers.ids = words_of_list(policy.substr(begin.size()));
    if (!layers.ids.empty()) return Status();
    return Status(StatusCode::usage, concat("{cryptomatte}: unknown policy "_keyed, quoted(policy),
                                            "; use keep, filter or filter=NAMES"));
}

Status set_source(const JobSettings& job, Diagnostics& notes, SourceSettings& source) {
    static_cast<SourceChoices&>(source) = job;
    ASSIGN_OR_RETURN(source.input_transfer, input_transfer_of(job));
    source.layers.aovs = job.aovs;
    RETURN_IF_ERROR(set_cryptomatte(job.cryptomatte, source.layers));
    RETURN_IF_ERROR(check_fill_mask(job.fill_mask).at("{fill_mask}"_keyed));
    source.layers.fill_mask = job.fill_mask;
    ASSIGN_OR_RETURN(source.max_memory, memory_limit_of(job.max_memory));
    if (!job.cuts.empty()) {
        ASSIGN_OR_RETURN(const auto cuts, io::FrameRange::parse(job.cuts).at("{cuts}"_keyed));
        source.cuts.insert(cuts.frames.begin(), cuts.frames.end());
    }
    if (!job.profile.empty()) {
        ASSIGN_OR_RETURN(source.profile, find_profile(job.profile).at("{profile}"_keyed));
    }
    if (!job.camera.empty()) {
        ASSIGN_OR_RETURN(auto camera, load_camera(job.camera));
        notes = camera.diagnostics;
        RETURN_IF_ERROR(camera.status());
        RETURN_IF_ERROR(read_aperture_images(camera));
        source.camera = std::move(camera);
    }
    return Status();
}

Status set_exr(const JobSettings& job, io::ExrSettings& exr) {
    exr.half = job.half;
    std::istringstream names(job.channels);
    for (std::string name; std::getline(names, name, ',');) {
        if (name.empty())
            return Status(StatusCode::usage,
                          "{channels}: an empty name; remove the comma beside it"_keyed);
        exr.channels.push_back(name);
    }
    if (!job.compression.empty()) {
        ASSIGN_OR_RETURN(exr.compression,
                         io::ExrCompression::parse(job.compression).at("{compression}"_keyed));
    }
    return Status();
}

Result<std::optional<Watch>> watch_of(const JobSettings& job, const RunSettings& settings) {
    if (!job.watch) {
        if (job.idle) return Status(StatusCode::usage, "{idle} needs {watch}; add it"_keyed);
        return std::optional<Watch>();
    }
    if (job.missing != MissingPolicy::error)
        return Status(StatusCode::usage,
                      "{watch} waits for missing frames; leave out {missing}"_keyed);
    if (!settings.frames && !job.chunk.empty())
        return Status(StatusCode::usage, "{watch}: {chunk} also needs {frames}"_keyed);
    if (!settings.frames && !job.idle && settings.input.color().has_token())
        return Status(StatusCode::usage,
                      "{watch}: give the frames to wait for ({frames=1-48}), or a time without "
                      "changes in seconds "
                      "after which it ends ({idle=600})"_keyed);
    return std::optional(Watch{job.idle});
}

// The files that are read beside the frames.
void add_other_inputs(const JobSettings& job, RunSettings& run) {
    if (!job.camera.empty()) run.other_inputs.push_back({job.camera, "the camera file"});
    if (!job.profile.empty()) run.other_inputs.push_back({job.profile, "the profile"});
    const auto add_images = [&](const Camera& camera) {
        for (auto& image : io::inputs_of(camera)) run.other_inputs.push_back(std::move(image));
    };
    if (const auto& file = run.source.camera) {
        add_images(file->camera);
        for (const auto& [number, frame] : file->frames) add_images(frame.camera);
    }
    std::set<std::string> configs;
    if (run.source.input_transfer) configs.insert(io::config_of(*run.source.input_transfer));
    if (run.picture.transfer) configs.insert(io::config_of(*run.picture.transfer));
    if (run.view) configs.insert(run.view->config);
    configs.erase("");
    for (const std::string& config : configs)
        run.other_inputs.push_back({config, "the OpenColorIO configuration"});
}

}  // namespace

Status read_aperture_images(CameraFile& file) {
    io::ApertureFiles pictures;
    RETURN_IF_ERROR(pictures.read(file.camera).at(file.file_name + ": aperture_image"));
    for (auto& [number, frame] : file.frames)
        RETURN_IF_ERROR(pictures.read(frame.camera)
                            .at(concat(file.file_name, ": frames.", number, ".aperture_image")));
    return Status();
}

Result<uint64_t> memory_limit_of(const std::string& text) {
    return text.empty() ? default_memory_limit() : parse_bytes(text).at("{max_memory}"_keyed);
}

ParameterTable job_parameters(const PassRegistry& registry) {
    return ParameterTableBuilder<JobSettings>()
        .text("input", &JobSettings::input,
              {.unit = "IN",
               .help = "frames: A.####.exr (also @@@@, %04d, $F4), or "
                       "color=A.####.exr,depth=B.####.exr,motion=C.####.exr",
               .group = kInputGroup,
               .required = true})
        .text(
            "behind", &JobSettings::behind,
            {.unit = "IN",
             .help = "second render of what is behind the frames' surfaces: behind.####.exr, with "
                     "the same channel names",
             .unset_means = "none",
             .group = kInputGroup})
        .text("frames", &JobSettings::frames,
              {.unit = "RANGE",
               .help = "frames to process: 1-10,20-40x2 (default: all frames on disk)",
               .unset_means = "all frames on disk",
               .group = kInputGroup})
        .text("cuts", &JobSettings::cuts,
              {.unit = "RANGE",
               .help = "frames that a camera cut follows: motion vectors and neighboring "
                       "frames across it are not used",
               .unset_means = "none",
               .group = kInputGroup})
        .text("camera", &JobSettings::camera,
              {.unit = "FILE",
               .help = "camera file (JSON)",
               .unset_means = "the frames' metadata",
               .group = kInputGroup})
        .text("profile", &JobSettings::profile,
              {.unit = "NAME",
               .help = "channel names and units of the renderer: cycles, nuke, arnold, redshift, "
                       "renderman, unreal, vray, generic, or "
                       "a profile file (default: detected)",
               .unset_means = "detected",
               .group = kInputGroup})
        .text("view_layer", &JobSettings::view_layer,
              {.unit = "NAME",
               .help = "view layer to use if there are several",
               .unset_means = "the only view layer",
               .group = kInputGroup})
        .text("view", &JobSettings::view,
              {.unit = "NAME",
               .help = "view to use from a multi-view file; run: all filters every view",
               .unset_means = "the only view",
               .group = kInputGroup})
        .choice<NonfiniteColor>(
            "nonfinite", &JobSettings::nonfinite_color, {"zero", "clamp"},
            {.help = "replacement for Inf, and for values beyond 1e34, in color: 0 or the largest "
                     "half",
             .group = kInputGroup})
        .choice<DataWindow>(
            "data_window", &JobSettings::data_window, {"grow", "keep"},
            {.help = "for cropped frames: grow the data window by the chain's reach, or keep "
                     "it and lose the light that leaves it",
             .group = kInputGroup})
        .choice<CameraMotion>(
            "camera_motion", &JobSettings::camera_motion, {"none", "missing", "sky", "zoom", "all"},
            {.help = "make motion vectors from depth and camera matrices; missing: if the frames "
                     "have none, and the zoom, which Cycles leaves out; sky: also for sky pixels "
                     "whose vectors are zero; zoom: like sky, and add the zoom to the vectors of "
                     "any renderer; all: instead of the frames' own",
             .group = kInputGroup})
        .text("max_memory", &JobSettings::max_memory,
              {.unit = "SIZE",
               .help = "memory limit for frames, e.g. 8G or 500M",
               .unset_means = "three quarters of the machine's memory",
               .group = kInputGroup})
        .text("input_transfer", &JobSettings::input_transfer,
              {.unit = "NAME",
               .help = "color encoding of non-EXR inputs: linear, srgb, rec709, "
                       "gamma22, cineon, ocio:SPACE; auto: as the file states, otherwise srgb for "
                       "integers, linear for float",
               .unset_means = "auto",
               .group = kInputGroup})
        .text("ocio", &JobSettings::ocio,
              {.unit = "FILE",
               .help = "OpenColorIO configuration for ocio:SPACE, view and {png}"_keyed,
               .unset_means = "the environment variable OCIO, if set",
               .group = kInputGroup})
        .text("ocio_colorspace", &JobSettings::ocio_colorspace,
              {.unit = "NAME",
               .help = "color space of the frames in the OpenColorIO configuration",
               .unset_means = "the configuration's role scene_linear",
               .group = kInputGroup})
        .text("aovs", &JobSettings::aovs,
              {.unit = "NAMES",
               .help = "AOVs (extra color layers) to filter: none, all, or comma-separated names "
                       "and patterns",
               .unset_means = "none",
               .group = kLayerGroup})
        .text("cryptomatte", &JobSettings::cryptomatte,
              {.unit = "POLICY",
               .help = "cryptomattes: keep as rendered, or filter each ID's coverage and re-rank; "
                       "filter=NAMES: only these IDs, the others are removed",
               .unset_means = "keep",
               .group = kLayerGroup})
        .text("fill_mask", &JobSettings::fill_mask,
              {.unit = "NAME",
               .help = "also write which share of each pixel came from its frame, a neighboring "
                       "frame, or an estimate: channels NAME.frame, NAME.neighbor and "
                       "NAME.background of EXR outputs",
               .unset_means = "not written",
               .group = kLayerGroup})
        .choice("precision", &JobSettings::precision, {"fp16", "fp32"},
                {.help = "storage of intermediate planes", .group = kPlanGroup})
        .text("no_elide", &JobSettings::no_elide,
              {.unit = "RULES",
               .help = "also run work that a frame does not need: all rules, or {no_elide}=RULES "
                       "with some of "_keyed +
                       joined(rule_names(registry, true)),
               .unset_means = "none",
               .implied = "all",
               .group = kPlanGroup})
        .text("elide", &JobSettings::elide,
              {.unit = "RULES",
               .help = "also use these rules, which are off by default: " +
                       joined(rule_names(registry, false)),
               .unset_means = "none",
               .group = kPlanGroup})
        .text("chunk", &JobSettings::chunk,
              {.unit = "I/N",
               .help = "only part I of N of the frames, e.g. 3/8",
               .unset_means = "all frames",
               .group = kOutputGroup})
        .text("output", &JobSettings::output,
              {.unit = "OUT",
               .help = "output frames: out.####.exr",
               .group = kOutputGroup,
               .required = true})
        .boolean("mkdir", &JobSettings::make_folder,
                 {.help = "create the output folder if it does not exist", .group = kOutputGroup})
        .choice<io::OnExisting>(
            "on_existing", &JobSettings::on_existing, {"fail", "overwrite", "skip", "resume"},
            {.help = "if an output exists: fail, overwrite it, skip it if it is complete and made "
                     "by the same chain from the same input (otherwise make it again), or resume: "
                     "skip such ones and fail for others",
             .group = kOutputGroup})
        .choice<MissingPolicy>(
            "missing", &JobSettings::missing, {"error", "skip", "hold"},
            {.help = "if a requested frame is not on disk: fail, skip it, or hold another frame",
             .group = kOutputGroup})
        .choice<ErrorPolicy>("on_error", &JobSettings::on_error, {"stop", "continue"},
                             {.help = "if a frame fails", .group = kOutputGroup})
        .choice<io::HalfOverflow>(
            "overflow", &JobSettings::overflow, {"refuse", "clamp"},
            {.help =
                 "if a result is too large for its channel: fail, or store the channel's largest "
                 "value",
             .unset_means = "clamp for JPEG and for {output_transfer=view}, otherwise refuse"_keyed,
             .group = kOutputGroup})
        .text("compression", &JobSettings::compression,
              {.unit = "NAME",
               .help = "for EXR outputs: none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab, "
                       "optionally with a level, e.g. zip:4 or dwaa:45",
               .unset_means = "the input's",
               .group = kOutputGroup})
        .boolean("half", &JobSettings::half,
                 {.help = "write color of EXR outputs as half", .group = kOutputGroup})
        .text("channels", &JobSettings::channels,
              {.unit = "NAMES",
               .help = "channels of EXR outputs, comma-separated; * matches any characters",
               .unset_means = "all",
               .group = kOutputGroup})
        .text(
            "output_transfer", &JobSettings::output_transfer,
            {.unit = "NAME",
             .help = "color encoding of non-EXR outputs: as {input_transfer}, or view: "
                     "as {ocio_view} shows them; auto: as the input, otherwise srgb for integers, "
                     "linear for float"_keyed,
             .unset_means = "auto",
             .group = kOutputGroup})
        .choice("bits", &JobSettings::bits, {"auto", "8", "10", "12", "16", "32"},
                {.help = "bits per value of non-EXR outputs, 32 is float; auto: as the "
                         "input, otherwise 16 for PNG, 32 for TIFF, 10 for DPX",
                 .group = kOutputGroup})
        .boolean(
            "strict", &JobSettings::strict,
            {.help = "non-finite values in input or output are an error", .group = kOutputGroup})
        .boolean("sidecar", &JobSettings::sidecar,
                 {.help = "write OUT.json beside each output", .group = kOutputGroup})
        .boolean("png", &JobSettings::preview,
                 {.help = "also write a preview OUT.png beside each output", .group = kOutputGroup})
        .text("ocio_display", &JobSettings::ocio_display,
              {.unit = "NAME",
               .help = "display of the OpenColorIO configuration",
               .unset_means = "the configuration's default",
               .group = kOutputGroup})
        .text("ocio_view", &JobSettings::ocio_view,
              {.unit = "NAME",
               .help = "view of that display",
               .unset_means = "the display's default",
               .group = kOutputGroup})
        .text("dump_stages", &JobSettings::dump_folder,
              {.unit = "DIR",
               .help = "write each intermediate plane as EXR",
               .unset_means = "not written",
               .group = kOutputGroup})
        .boolean(
            "watch", &JobSettings::watch,
            {.help = "process frames while a renderer writes them, complete ones only; wait for "
                     "frames of {frames} that do not exist yet"_keyed,
             .group = kWatchGroup})
        .number("idle", &JobSettings::idle,
                {.min = 1,
                 .max = 1e7,
                 .unit = "s",
                 .help = "with {watch}: give up on missing frames after this many seconds without "
                         "changes"_keyed,
                 .unset_means = "wait forever",
                 .group = kWatchGroup})
        .table();
}

std::map<std::string, ParameterValue> given_values(const JobSettings& job,
                                                   const PassRegistry& registry) {
    std::map<std::string, ParameterValue> given;
    const ParameterTable table = job_parameters(registry);
    for (const auto& row : table.rows()) {
        const ParameterValue value = row.get(&job);
        if (value != row.default_value && value != ParameterValue(std::string()))
            given[row.key] = value;
    }
    return given;
}

Result<RunSettings> parse_job(const JobSettings& job, const PassRegistry& registry,
                              Diagnostics& notes) {
    RunSettings run;
    static_cast<RunChoices&>(run) = job;
    ASSIGN_OR_RETURN(run.input, io::InputSpec::parse(job.input).at("{input}"_keyed));
    if (!job.behind.empty()) {
        ASSIGN_OR_RETURN(auto behind, io::PathPattern::parse(job.behind).at("{behind}"_keyed));
        if (!run.input.patterns.emplace(Role::behind, std::move(behind)).second)
            return Status(StatusCode::usage,
                          "{behind}: the input already names behind=; give one"_keyed);
    }
    if (const auto behind = run.input.patterns.find(Role::behind);
        behind != run.input.patterns.end() && whole(behind->second) == whole(run.input.color()))
        return Status(StatusCode::usage,
                      concat("{behind}: "_keyed, behind->second.text(),
                             " is the input itself; name a render without the surfaces in front"));
    if (!job.frames.empty()) {
        ASSIGN_OR_RETURN(run.frames, io::FrameRange::parse(job.frames).at("{frames}"_keyed));
    }
    if (!job.chunk.empty()) {
        ASSIGN_OR_RETURN(run.chunk, io::Chunk::parse(job.chunk).at("{chunk}"_keyed));
    }
    ASSIGN_OR_RETURN(run.watch, watch_of(job, run));
    RETURN_IF_ERROR(set_source(job, notes, run.source));
    run.source.color_frames = run.input.color();
    ASSIGN_OR_RETURN(run.plan, plan_options_of(job, registry));
    if (!job.output.empty()) {
        ASSIGN_OR_RETURN(run.output, io::PathPattern::parse(job.output).at("{output}"_keyed));
    }
    RETURN_IF_ERROR(set_exr(job, run.exr));
    ASSIGN_OR_RETURN(run.picture.transfer, output_transfer_of(job));
    run.picture.bits = bits_of(job.bits);
    ASSIGN_OR_RETURN(run.view, preview_view_of(job));
    add_other_inputs(job, run);
    if (!job.dump_folder.empty() && job.on_existing == io::OnExisting::skip)
        return Status(StatusCode::usage,
                      "{dump_stages}: a frame that {on_existing=skip} keeps has no stages; use "
                      "{on_existing=overwrite}, or leave one of them out"_keyed);
    if (!job.dump_folder.empty() && job.view == kAllViews)
        return Status(StatusCode::usage,
                      "{dump_stages}: stages are those of one view; name it with {view}"_keyed);
    // Excludes which frames are written, where, and what is written besides: they do not change the
    // result.
    static const std::set<std::string> kNotRepeated = {
        "frames",  "chunk", "output",      "mkdir",      "on_existing", "on_error", "missing",
        "sidecar", "png",   "dump_stages", "max_memory", "watch",       "idle"};
    for (const auto& [key, value] : given_values(job, registry))
        if (!kNotRepeated.contains(key)) run.given[key] = value;
    return run;
}

void set_input(RunSettings& run, io::InputSpec input, std::optional<io::PathPattern> behind) {
    run.input = std::move(input);
    if (behind) run.input.patterns.emplace(Role::behind, std::move(*behind));
    run.source.color_frames = run.input.color();
}

}  // namespace postchain::sequence

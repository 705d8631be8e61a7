#include "tools/apps/postchain/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "passes/registry.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/verbs.h"

namespace postchain {
namespace {

// Says all of them, each in its own form; errors become a status that fail() does not say again.
Status say(const Diagnostics& diagnostics, log::Level notes) {
    for (const auto& one : diagnostics)
        log::write_as_is(one.severity == Severity::note      ? notes
                         : one.severity == Severity::warning ? log::Level::warning
                                                             : log::Level::error,
                         one.text());
    return already_said(status_of(diagnostics));
}

// Index of a word that CLI11 has already checked to be one of `names`.
template <class E>
E choice(const std::string& word, std::initializer_list<const char*> names) {
    int index = 0;
    for (const char* name : names) {
        if (word == name) return static_cast<E>(index);
        ++index;
    }
    return static_cast<E>(0);
}

// "off_by_configuration, identity_by_facts, ...": the rules that are on by default, or the others.
std::string rule_names(bool on_by_default) {
    std::string names;
    for (const auto& rule : elision_rules(builtin_passes()))
        if (rule.on_by_default == on_by_default) names += (names.empty() ? "" : ", ") + rule.name;
    return names;
}

Result<std::set<std::string>> rules_of(const std::string& option, const std::string& text,
                                       bool on_by_default) {
    std::set<std::string> rules;
    std::istringstream words(text);
    for (std::string word; std::getline(words, word, ',');) {
        for (const auto& rule : elision_rules(builtin_passes()))
            if (rule.on_by_default == on_by_default && word == rule.name) rules.insert(word);
        if (rules.count(word) == 0)
            return Status(StatusCode::usage, option + ": no rule '" + word + "'; known are " +
                                                 rule_names(on_by_default));
    }
    return rules;
}

// An empty word is a shell variable that was not set; it must not mean "all".
const CLI::Validator kNotEmpty(
    [](const std::string& text) { return std::string(text.empty() ? "is empty" : ""); }, "");

}  // namespace

void add_logging(CLI::App& verb, Options& o) {
    verb.add_flag("-v,--verbose", o.verbose, "more messages");
    verb.add_flag("-q,--quiet", o.quiet, "errors only");
    verb.add_option("--log-format", o.log_format, "form of the messages on stderr")
        ->check(CLI::IsMember({"text", "json"}))
        ->capture_default_str();
}

void add_chain(CLI::App& verb, Options& o) {
    verb.add_option("CHAIN", o.chain, "chain file, or the name of a shipped chain")
        ->check(kNotEmpty)
        ->required();
    verb.add_option("--set", o.sets,
                    "change a value: passes[0].samples=51, motion_blur.samples=51, camera.f_stop=2")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all();
}

void add_input(CLI::App& verb, Options& o) {
    verb.add_option("-i,--input", o.input,
                    "frames: A.####.exr (also @@@@, %04d, $F4), or "
                    "color=A.####.exr,depth=B.####.exr,motion=C.####.exr")
        ->check(kNotEmpty)
        ->type_name("IN")
        ->required();
    verb.add_option("--frames", o.frames, "which frames: 1-10,20-40x2 (default: all on disk)")
        ->check(kNotEmpty)
        ->type_name("RANGE");
    verb.add_option("--cuts", o.cuts,
                    "frames whose motion leads across a camera cut: no motion blur there")
        ->check(kNotEmpty)
        ->type_name("RANGE");
    verb.add_option("--camera", o.camera, "camera file (JSON)")
        ->check(kNotEmpty)
        ->type_name("FILE");
    verb.add_option("--profile", o.profile,
                    "names and units of the writer: cycles, nuke, arnold, vray, generic, or a "
                    "profile file (default: detected)")
        ->type_name("NAME");
    verb.add_option("--layer", o.layer, "layer to take where there are several")->type_name("NAME");
    verb.add_option("--view", o.view, "view to take of a multi-view file")->type_name("NAME");
    verb.add_option("--nonfinite", o.nonfinite, "what Inf in color becomes: 0 or the largest half")
        ->check(CLI::IsMember({"zero", "clamp"}))
        ->capture_default_str();
}

void add_plan(CLI::App& verb, Options& o) {
    verb.add_option("--precision", o.precision, "storage of intermediate planes")
        ->check(CLI::IsMember({"fp16", "fp32"}))
        ->capture_default_str();
    // A flag: the word after it may be CHAIN, so rules come with '=' alone.
    verb.add_flag("--no-elide{all}", o.no_elide,
                  "run what a frame does not need too: all rules, or --no-elide=RULES with some "
                  "of " +
                      rule_names(true));
    verb.add_option("--elide", o.elide,
                    "leave out by rules too that are off unless asked for: " + rule_names(false))
        ->check(kNotEmpty)
        ->type_name("RULES");
}

void add_device(CLI::App& verb, Options& o) {
    verb.add_option("--device", o.device,
                    "GL device: auto, software, or a number of `postchain info`")
        ->type_name("N|software")
        ->capture_default_str();
    verb.add_option("--threads", o.threads, "CPU threads (default: all cores)")
        ->check(CLI::Range(1, 1024));
}

void add_writing(CLI::App& verb, Options& o) {
    verb.add_option("-o,--output", o.output, "output frames: out.####.exr")
        ->check(kNotEmpty)
        ->type_name("OUT")
        ->required();
    verb.add_option("--on-existing", o.on_existing,
                    "when the output exists; skip: only one made by the same chain from the same "
                    "input")
        ->check(CLI::IsMember({"fail", "skip", "overwrite"}))
        ->capture_default_str();
    verb.add_option("--missing", o.missing, "when a requested frame is not on disk")
        ->check(CLI::IsMember({"error", "skip", "hold"}))
        ->capture_default_str();
    verb.add_option("--on-error", o.on_error, "when a frame fails")
        ->check(CLI::IsMember({"stop", "continue"}))
        ->capture_default_str();
    verb.add_option("--overflow", o.overflow, "when color exceeds a half channel")
        ->check(CLI::IsMember({"refuse", "clamp"}))
        ->capture_default_str();
    verb.add_flag("--strict", o.strict, "non-finite values in input or output are an error");
    verb.add_flag("--no-sidecar", o.no_sidecar, "write no OUT.json beside each output");
    verb.add_flag("--png", o.png, "write OUT.png beside each output, for a look");
    verb.add_option("--dump-stages", o.dump_stages, "write each intermediate plane as EXR")
        ->check(kNotEmpty)
        ->type_name("DIR");
    verb.add_flag("--json", o.json, "one JSON object per frame on stdout");
}

Result<ChainFile> load_chain_of(const Options& options) {
    auto file = load_chain(options.chain, builtin_passes(), options.sets);
    if (!file.ok()) return file.status();
    if (Status status = say(file->diagnostics, log::Level::info); !status.ok()) return status;
    return file;
}

Result<PlanOptions> plan_options_of(const Options& options) {
    PlanOptions plan;
    plan.precision = choice<Precision>(options.precision, {"fp16", "fp32"});
    if (options.no_elide == "all") {
        if (!options.elide.empty())
            return Status(StatusCode::usage, "--elide contradicts --no-elide; give one of them");
        plan.elide = false;
        return plan;
    }
    auto off = rules_of("--no-elide", options.no_elide, true);
    if (!off.ok()) return off.status();
    auto on = rules_of("--elide", options.elide, false);
    if (!on.ok()) return on.status();
    plan.rules_off = std::move(*off);
    plan.rules_on = std::move(*on);
    return plan;
}

Result<sequence::RunSettings> input_settings_of(const Options& options) {
    sequence::RunSettings settings;
    auto input = io::InputSpec::parse(options.input);
    if (!input.ok()) return input.status().at("--input");
    settings.input = std::move(*input);
    if (!options.frames.empty()) {
        auto range = io::FrameRange::parse(options.frames);
        if (!range.ok()) return range.status().at("--frames");
        settings.frames = std::move(*range);
    }
    if (!options.cuts.empty()) {
        auto cuts = io::FrameRange::parse(options.cuts);
        if (!cuts.ok()) return cuts.status().at("--cuts");
        settings.source.cuts.insert(cuts->frames.begin(), cuts->frames.end());
    }
    if (!options.profile.empty()) {
        auto profile = find_profile(options.profile);
        if (!profile.ok()) return profile.status().at("--profile");
        settings.source.profile = std::move(*profile);
    }
    settings.source.layer = options.layer;
    settings.source.view = options.view;
    settings.source.nonfinite_color = choice<NonfiniteColor>(options.nonfinite, {"zero", "clamp"});
    if (!options.camera.empty()) {
        auto camera = load_camera(options.camera);
        if (!camera.ok()) return camera.status();
        if (Status status = say(camera->diagnostics, log::Level::detail); !status.ok())
            return status;
        settings.source.camera = std::move(*camera);
    }
    auto plan = plan_options_of(options);
    if (!plan.ok()) return plan.status();
    settings.plan = *plan;
    settings.version = kVersion;
    return settings;
}

Result<sequence::RunSettings> run_settings_of(const Options& options) {
    auto settings = input_settings_of(options);
    if (!settings.ok()) return settings;
    auto output = io::PathPattern::parse(options.output);
    if (!output.ok()) return output.status().at("--output");
    settings->output = std::move(*output);
    settings->on_existing =
        choice<io::OnExisting>(options.on_existing, {"fail", "skip", "overwrite"});
    settings->missing = choice<sequence::MissingPolicy>(options.missing, {"error", "skip", "hold"});
    settings->on_error = choice<sequence::ErrorPolicy>(options.on_error, {"stop", "continue"});
    settings->overflow = choice<io::HalfOverflow>(options.overflow, {"refuse", "clamp"});
    settings->strict = options.strict;
    settings->sidecar = !options.no_sidecar;
    settings->preview = options.png;
    settings->dump_folder = options.dump_stages;
    return settings;
}

int threads_of(const Options& options) {
    if (options.threads > 0) return options.threads;
    return std::max(1, int(std::thread::hardware_concurrency()));
}

Result<gl::ContextOptions> context_options_of(const Options& options) {
    gl::ContextOptions context;
    if (options.device == "software") {
        context.device = gl::ContextOptions::kSoftware;
    } else if (options.device != "auto") {
        const char* end = options.device.data() + options.device.size();
        const auto parsed = std::from_chars(options.device.data(), end, context.device);
        if (parsed.ec != std::errc() || parsed.ptr != end || context.device < 0)
            return Status(StatusCode::usage, "--device: '" + options.device +
                                                 "' is neither auto, software nor a number of "
                                                 "`postchain info`");
    }
    // llvmpipe reads its number of threads from here, once, when the context is made.
    if (options.threads > 0) setenv("LP_NUM_THREADS", std::to_string(options.threads).c_str(), 1);
    io::set_exr_threads(threads_of(options));
    context.debug = options.verbose;
    context.log = [](const std::string& text) { log::detail(text); };
    return context;
}

Result<std::unique_ptr<gl::Context>> context_of(const Options& options) {
    auto context = context_options_of(options);
    if (!context.ok()) return context.status();
    return gl::Context::create(*context);
}

std::string renderer_text(const gl::Context& context) {
    return context.renderer() + ", " + context.version();
}

}  // namespace postchain

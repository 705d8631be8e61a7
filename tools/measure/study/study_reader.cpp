#include "tools/measure/study/study_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>

#include "config/camera_file.h"
#include "config/chain_find.h"
#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxName = 64;
// A name becomes a part of file names.
bool is_name(const std::string& text) {
    return !text.empty() && text.size() <= kMaxName &&
           text.find_first_not_of(
               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
               "0123456789_-") == std::string::npos;
}

// The state that the readers of chains, questions and scenes share.
struct Reading {
    StudyFile& file;
    const PassRegistry& registry;
    const StudyPaths& paths;
    Reporter reporter;

    Study& study() { return file.study; }

    void error(const TextNode& at, const std::string& path, const std::string& message) {
        reporter.error(at, path, message);
    }

    void error(const TextNode& at, const std::string& path, const Status& status) {
        const auto [key, text] = split_key(status.message());
        const bool is_named = key == path.substr(path.rfind('.') + 1);
        file.diagnostics.push_back({file.study.file, at.line, at.column, Severity::error, path,
                                    is_named ? text : status.message(), status.code()});
    }

    // A string that is not empty; `above` is the path of the map.
    std::optional<std::string> text(const TextNode& map, const std::string& key,
                                    const std::string& above = {}) {
        const TextNode* node = map.find(key);
        if (!node) return std::nullopt;
        if (node->is_scalar() && !node->text.empty() && node->text.find('\0') == std::string::npos)
            return node->text;
        error(*node, above + key, node->describe() + " is no text");
        return std::nullopt;
    }

    // Resolves the path of the camera's aperture image. False: an error is reported.
    bool resolve_image(const TextNode& at, const std::string& path, Camera& camera) {
        const std::string image = camera.aperture_image.file();
        if (image.empty()) return true;
        auto resolved = paths.file(image);
        if (!resolved.ok()) {
            error(at, path, "its aperture_image: " + resolved.status().message());
            return false;
        }
        camera.aperture_image = BokehKernel(*resolved);
        return true;
    }
};

// -------------------------------------------------------------------------------- questions

std::optional<size_t> chain_of(const TextNode& at, const std::string& path, const Study& study,
                               Reporter& reporter) {
    const auto names = study.names();
    const auto found = std::ranges::find(names, at.text);
    if (found != names.end()) return size_t(found - names.begin());
    reporter.error(at, path,
                   at.is_scalar() ? unknown_word("chain", at.text, names) : "is a chain's name");
    return std::nullopt;
}

// Keys of a question that is a map.
std::optional<Equal> equal_of(const TextNode& item, const std::string& path, Reporter& reporter) {
    if (!item.is_map()) return Equal::unsaid;
    for (const auto& [key, value] : item.entries)
        if (key.text != "pair" && key.text != "equal")
            reporter.error(key, path + "." + key.text,
                           unknown_word("key", key.text, {"pair", "equal"}));
    const TextNode* equal = item.find("equal");
    if (!equal) return Equal::unsaid;
    for (const Equal one : {Equal::samples, Equal::time})
        if (equal->is_scalar() && equal->text == name_of(one)) return one;
    reporter.error(*equal, path + ".equal", "is samples or time");
    return std::nullopt;
}

// Key `questions`: pairs of study.chains. Without it every pair is a question.
void read_questions(const TextNode& root, Study& study, Reporter& reporter) {
    const TextNode* questions = root.find("questions");
    if (!questions) {
        for (size_t b = 1; b < study.chains.size(); ++b)
            for (size_t a = 0; a < b; ++a) study.ask(a, b);
        return;
    }
    if (!questions->is_list() || questions->items.empty())
        return reporter.error(*questions, "questions", "is a list of pairs: [[lens, joint]]");
    for (size_t i = 0; i < questions->items.size(); ++i) {
        const TextNode& item = questions->items[i];
        const std::string path = concat("questions[", i, "]");
        const TextNode* pair = item.is_map() ? item.find("pair") : &item;
        if (!pair || !pair->is_list() || pair->items.size() != 2) {
            reporter.error(
                item, path,
                "is a pair of chains: [lens, joint], or {pair: [lens, joint], equal: time}");
            continue;
        }
        const auto a = chain_of(pair->items[0], path, study, reporter),
                   b = chain_of(pair->items[1], path, study, reporter);
        const auto same = equal_of(item, path, reporter);
        if (!a || !b || !same) continue;
        const std::pair<size_t, size_t> asked(*a, *b), turned(*b, *a);
        const int of_a = samples_of(study.chains[*a].chain);
        const int of_b = samples_of(study.chains[*b].chain);
        if (*a == *b) {
            reporter.error(item, path, "compares a chain with itself");
        } else if (std::ranges::count(study.pairs, asked) +
                   std::ranges::count(study.pairs, turned)) {
            reporter.error(item, path, "is asked twice");
        } else if (*same == Equal::samples && of_a != of_b) {
            reporter.error(item, path,
                           concat("says equal samples, but the passes of ", study.chains[*a].name,
                                  " take ", of_a, " and those of ", study.chains[*b].name, " ",
                                  of_b, "; change samples of a pass"));
        } else {
            study.ask(*a, *b, *same);
        }
    }
}

// Key `margins`: gains within which an answer is "no difference".
void read_margins(const TextNode& root, Study& study, Reporter& reporter) {
    const TextNode* margins = root.find("margins");
    if (!margins) return;
    if (!margins->is_map())
        return reporter.error(*margins, "margins",
                              "is a map of metrics: {hdr_flip: 0.005, psnr: 0.4}");
    std::vector<std::string> metrics;
    for (const auto& metric : experiment::metric_columns(study.kind, true))
        metrics.push_back(metric.name);
    for (const auto& [key, value] : margins->entries) {
        const std::string path = "margins." + key.text;
        if (std::ranges::find(metrics, key.text) == metrics.end()) {
            reporter.error(key, path, unknown_word("metric", key.text, metrics));
            continue;
        }
        const auto read = value_of(value);
        const auto* whole = read.ok() ? std::get_if<int64_t>(&*read) : nullptr;
        const auto* number = read.ok() ? std::get_if<double>(&*read) : nullptr;
        const double margin = whole ? double(*whole) : number ? *number : 0;
        if (margin > 0 && std::isfinite(margin))
            study.margins[key.text] = margin;
        else
            reporter.error(value, path,
                           "is a number above 0: a gain below it counts as no difference");
    }
}

// ----------------------------------------------------------------------------------- chains

// A list of passes as a chain file.
TextNode chain_of_passes(const TextNode& list) {
    TextNode scalar = list;
    scalar.kind = TextNode::Kind::scalar;
    scalar.items.clear();
    const auto word = [&](const std::string& text) {
        scalar.text = text;
        return scalar;
    };
    TextNode chain = word("");
    chain.kind = TextNode::Kind::map;
    chain.entries = {{word("postchain"), word(std::to_string(kChainFileVersion))},
                     {word("passes"), list}};
    return chain;
}

std::optional<ChainText> chain_text(const TextNode& at, const std::string& path, Reading& reading) {
    if (at.is_list()) return ChainText{reading.file.study.file, {}, false, chain_of_passes(at)};
    if (at.text.empty()) {
        reading.error(at, path, at.describe() + " is not a chain's name, file or list of passes");
        return std::nullopt;
    }
    auto found = find_named_chain(at.text, reading.paths.file);
    if (!found.ok()) {
        reading.error(at, path, found.status().message());
        return std::nullopt;
    }
    return std::move(*found);
}

std::optional<Chain> parsed(const TextNode& at, const std::string& path, const ChainText& text,
                            Reading& reading) {
    ChainFile file = parse_chain(text, reading.registry);
    const Status status = file.status();
    for (auto& one : file.diagnostics) reading.file.diagnostics.push_back(std::move(one));
    if (!status.ok() || !reading.resolve_image(at, path, file.chain.camera)) return std::nullopt;
    io::ApertureFiles pictures;
    if (Status read = pictures.read(file.chain.camera); !read.ok()) {
        reading.error(at, path, read);
        return std::nullopt;
    }
    return std::move(file.chain);
}

// Keys `chains` and `questions`.
void read_chains(const TextNode& root, Reading& reading) {
    Study& study = reading.file.study;
    const TextNode* chains = root.find("chains");
    if (!chains || !chains->is_map() || chains->entries.size() < 2)
        return reading.error(chains ? *chains : root, "chains",
                             "is a map of at least two chains: lens: dof_first, joint: balanced");
    for (const auto& [key, value] : chains->entries) {
        const std::string path = "chains." + key.text;
        if (!is_name(key.text)) {
            reading.error(key, path,
                          concat("a chain's name has letters, digits, _ and - only, at most ",
                                 kMaxName, " of them"));
            continue;
        }
        auto text = chain_text(value, path, reading);
        if (!text) continue;
        auto chain = parsed(value, path, *text, reading);
        if (!chain) continue;
        study.chains.push_back({key.text, std::move(*chain)});
        study.chain_files.push_back(text->file_name);
    }
    if (study.chains.size() == chains->entries.size())
        read_questions(root, study, reading.reporter);
}

// Keys `chain`, `sweep` and `max_variants`: variants of one chain.
void read_sweep(const TextNode& root, Reading& reading) {
    Study& study = reading.file.study;
    const TextNode* named = root.find("chain");
    if (!named) return reading.error(root, "chain", "is missing: a chain's name or file");
    auto text = chain_text(*named, "chain", reading);
    if (!text) return;
    if (!parsed(*named, "chain", *text, reading)) return;
    study.chain_name = fs::path(text->file_name).stem().string();
    study.chain_files.push_back(text->file_name);
    int most = experiment::kMaxVariants;
    if (const TextNode* limit = root.find("max_variants")) {
        const auto value = value_of(*limit);
        const auto* number = value.ok() ? std::get_if<int64_t>(&*value) : nullptr;
        if (!number || *number < 1 || *number > 100000)
            return reading.error(*limit, "max_variants", "is an integer in 1..100000");
        most = int(*number);
    }
    const TextNode* list = root.find("sweep");
    if (!list || !list->is_list() || list->items.empty())
        return reading.error(list ? *list : root, "sweep",
                             "is a list of texts: [\"motion_blur.samples=5,9,13\"]");
    std::vector<experiment::Sweep> sweeps;
    for (const TextNode& item : list->items) {
        auto sweep = experiment::parse_sweep(item.text);
        if (!sweep.ok()) return reading.error(item, "sweep", sweep.status());
        if (sweep->key == "camera.aperture_image")
            return reading.error(item, "sweep", "pictures of apertures cannot be swept in a study");
        sweeps.push_back(std::move(*sweep));
    }
    auto variants = experiment::sweep_variants(*text, reading.registry, {}, sweeps, most);
    if (!variants.ok()) return reading.error(*list, "sweep", variants.status());
    study.chains = std::move(*variants);
    if (study.chains.size() < 2)
        return reading.error(*list, "sweep", "makes one variant; there is nothing to compare");
    for (size_t b = 1; b < study.chains.size(); ++b) study.ask(0, b);
}

// ----------------------------------------------------------------------------------- scenes

bool is_path_word(const std::string& text) {
    return text.find_first_of("/.") == std::string::npos;
}

// Rows of bench that a study sets itself.
bool is_own(const std::string& key) {
    return key == "output" || key == "assets" || key == "on_existing" || key == "max_variants" ||
           key == "truth";
}

// Keys `settings` and `scenes`.
class SceneReader {
  public:
    SceneReader(Reading& reading, const std::string& version)
        : reading_(reading),
          version_(version),
          job_table_(sequence::job_parameters(reading.registry)) {}

    void read(const TextNode& root) {
        Typed common;
        common.measured.page_frames = 1;
        if (const TextNode* map = root.find("settings")) {
            if (map->is_map())
                read_settings(*map, "settings.", common, {});
            else
                reading_.error(*map, "settings", "is a map of settings of all scenes");
        }
        const TextNode* scenes = root.find("scenes");
        if (!scenes || !scenes->is_list() || scenes->items.empty())
            return reading_.error(scenes ? *scenes : root, "scenes", "is a list of scenes");
        std::set<std::string> names;
        for (size_t i = 0; i < scenes->items.size(); ++i) {
            const TextNode& node = scenes->items[i];
            const std::string above = concat("scenes[", i, "].");
            if (!node.is_map()) {
                reading_.error(node, concat("scenes[", i, "]"),
                               "a scene is a map: {name: a, input: ...}");
                continue;
            }
            read_scene(node, above, common, names);
        }
    }

  private:
    struct Typed {
        sequence::JobSettings job;
        experiment::BenchSettings measured;
    };

    void set_row(const ParameterTable& table, ParameterRef settings, const TextEntry& entry,
                 const std::string& path) {
        if (!entry.value.is_scalar() && !entry.value.is_null())
            return reading_.error(
                entry.value, path,
                entry.value.describe() + " is not " + table.find(entry.key.text)->domain());
        auto value = value_of(entry.value);
        if (!value.ok()) return reading_.error(entry.value, path, value.status().message());
        // frames: 10 is a range like 10-12.
        if (table.find(entry.key.text)->type == ParameterType::text && entry.value.is_scalar())
            value = ParameterValue(entry.value.text);
        if (const auto* word = std::get_if<std::string>(&*value);
            word && (word->empty() || word->find('\0') != std::string::npos))
            return reading_.error(entry.value, path, "is empty, or has a zero byte");
        if (Status status = table.set(settings, entry.key.text, *value); !status.ok())
            reading_.error(entry.value, path, status.message());
    }

    bool takes(const Parameter& row) const {
        return row.group == sequence::kInputGroup || row.group == sequence::kPlanGroup;
    }

    // Every key of a map that is in a table; `more`: keys that the caller reads.
    void read_settings(const TextNode& map, const std::string& above, Typed& typed,
                       std::vector<std::string> more) {
        const ParameterTable& own = experiment::bench_parameters();
        std::vector<std::string> known = std::move(more);
        const size_t others = known.size();
        for (const Parameter& row : job_table_.rows())
            if (takes(row) && row.key != "input") known.push_back(row.key);
        for (const Parameter& row : own.rows())
            if (!is_own(row.key) && (reading_.file.study.kind == report::Kind::bench ||
                                     experiment::ab_parameters().find(row.key)))
                known.push_back(row.key);
        for (const TextEntry& entry : map.entries) {
            const std::string& key = entry.key.text;
            const auto found = std::ranges::find(known, key);
            if (found == known.end())
                reading_.error(entry.key, above + key, unknown_word("key", key, known));
            else if (size_t(found - known.begin()) < others)
                continue;
            else if (const Parameter* row = job_table_.find(key); row && takes(*row))
                set_row(job_table_, &typed.job, entry, above + key);
            else
                set_row(own, &typed.measured, entry, above + key);
        }
    }

    void read_scene(const TextNode& node, const std::string& above, Typed typed,
                    std::set<std::string>& names) {
        const size_t before = reading_.file.diagnostics.size();
        Scene scene;
        scene.name = reading_.text(node, "name", above).value_or("");
        if (!is_name(scene.name)) {
            const TextNode* name = node.find("name");
            reading_.error(
                name ? *name : node, above + "name",
                concat("a scene has a name of letters, digits, _ and -, at most ", kMaxName));
        } else if (!names.insert(scene.name).second) {
            reading_.error(*node.find("name"), above + "name",
                           "two scenes are named " + scene.name);
        }
        scene.family = reading_.text(node, "family", above).value_or(scene.name);
        scene.input = reading_.text(node, "input", above).value_or("");
        scene.truth = reading_.text(node, "truth", above).value_or("");
        if (!node.find("input"))
            reading_.error(node, above + "input", "is missing: the scene's frames");
        if (!node.find("truth") && reading_.file.study.kind == report::Kind::ab)
            reading_.error(node, above + "truth", "is missing: what the scene is measured against");
        read_settings(node, above, typed, {"name", "family", "input", "truth"});
        if (reading_.file.diagnostics.size() > before) return;
        typed.job.input = scene.input;
        scene.settings = job_table_.text(&typed.job) + " " +
                         experiment::bench_parameters().text(&typed.measured);
        scene.measured = typed.measured;
        complete(node, above, typed.job, scene);
        reading_.file.study.scenes.push_back(std::move(scene));
    }

    std::optional<io::InputSpec> resolved(const TextNode& at, const std::string& path,
                                          const std::string& text) {
        auto spec = io::InputSpec::parse(text);
        if (!spec.ok()) {
            reading_.error(at, path, spec.status().message());
            return std::nullopt;
        }
        for (auto& [role, pattern] : spec->patterns) {
            auto found = reading_.paths.pattern(pattern);
            if (!found.ok()) {
                reading_.error(at, path, found.status());
                return std::nullopt;
            }
            pattern = std::move(*found);
        }
        return std::move(*spec);
    }

    // A file that a setting names, by its real name.
    bool resolve_file(const TextNode& node, const std::string& above, const std::string& key,
                      std::string& text) {
        if (text.empty()) return true;
        auto found = reading_.paths.file(text);
        if (!found.ok()) {
            const TextNode* at = node.find(key);
            reading_.error(at ? *at : node, above + key, found.status());
            return false;
        }
        text = *found;
        return true;
    }

    // At the setting that the message begins with.
    void refuse(const TextNode& node, const std::string& above, const Status& status) {
        for (const TextEntry& entry : node.entries)
            if (entry.key.text == split_key(status.message()).first)
                return reading_.error(entry.value, above + entry.key.text, status);
        reading_.error(node, above.substr(0, above.size() - 1), status);
    }

    void complete(const TextNode& node, const std::string& above, sequence::JobSettings job,
                  Scene& scene) {
        auto input = resolved(*node.find("input"), above + "input", scene.input);
        if (!scene.truth.empty()) {
            const TextNode& at = *node.find("truth");
            auto truth = resolved(at, above + "truth", scene.truth);
            if (truth && truth->separate_files())
                reading_.error(at, above + "truth", "give one pattern, for color only");
            else if (truth)
                scene.measured.truth = truth->color().text();
            scene.measured.truth_is = scene.truth;
        }
        std::optional<io::PathPattern> behind;
        if (!job.behind.empty()) {
            const TextNode* at = node.find("behind");
            auto found = io::PathPattern::parse(job.behind);
            if (found.ok()) found = reading_.paths.pattern(*found);
            if (!found.ok())
                return reading_.error(at ? *at : node, above + "behind", found.status());
            behind = std::move(*found);
        }
        if (!resolve_file(node, above, "camera", job.camera)) return;
        if (!resolve_file(node, above, "ocio", job.ocio)) return;
        if (!is_path_word(job.profile) && !resolve_file(node, above, "profile", job.profile))
            return;
        if (!job.camera.empty()) {
            const TextNode* set = node.find("camera");
            const TextNode& at = set ? *set : node;
            auto camera = load_camera(job.camera);
            const Status status = camera.ok() ? camera->status() : camera.status();
            if (!status.ok()) return reading_.error(at, above + "camera", status);
            bool good = reading_.resolve_image(at, above + "camera", camera->camera);
            for (auto& [number, frame] : camera->frames)
                good = reading_.resolve_image(at, above + "camera", frame.camera) && good;
            if (!good) return;
        }
        if (!input) return;
        Diagnostics notes;
        auto run = sequence::parse_job(job, reading_.registry, notes);
        for (auto& note : notes)
            if (note.severity != Severity::error)
                reading_.file.diagnostics.push_back(std::move(note));
        if (!run.ok()) return refuse(node, above, run.status());
        sequence::set_input(*run, std::move(*input), std::move(behind));
        run->version = version_;
        scene.measured.run = std::move(*run);
    }

    Reading& reading_;
    const std::string& version_;
    const ParameterTable job_table_;
};

void read(const TextNode& root, Reading& reading, const std::string& version) {
    Study& study = reading.file.study;
    if (!root.is_map())
        return reading.error(root, "", "a study is a map of keys, not " + root.describe());
    const TextNode* format = root.find("postchain_study");
    if (!format || format->text != std::to_string(kStudyFileVersion))
        reading.error(format ? *format : root, "postchain_study",
                      concat("is ", kStudyFileVersion, " in a study of this version"));
    study.title = reading.text(root, "title").value_or(fs::path(study.file).stem().string());
    study.chain_name = study.title;
    const std::string kind = reading.text(root, "kind").value_or("ab");
    if (kind != "ab" && kind != "bench")
        reading.error(*root.find("kind"), "kind", "is ab or bench");
    study.kind = kind == "bench" ? report::Kind::bench : report::Kind::ab;
    std::vector<std::string> known = {"postchain_study", "title",    "kind",
                                      "margins",         "settings", "scenes"};
    const bool swept = study.kind == report::Kind::bench && !root.find("chains");
    const auto own = swept ? std::vector<std::string>{"chain", "sweep", "max_variants"}
                           : std::vector<std::string>{"chains", "questions"};
    known.insert(known.end(), own.begin(), own.end());
    for (const auto& [key, value] : root.entries)
        if (std::ranges::find(known, key.text) == known.end())
            reading.error(key, key.text, unknown_word("key", key.text, known));
    if (swept)
        read_sweep(root, reading);
    else
        read_chains(root, reading);
    read_margins(root, study, reading.reporter);
    SceneReader(reading, version).read(root);
    if (study.scenes.size() * std::max<size_t>(study.pairs.size(), 1) > kMaxTasks)
        reading.error(root, "", concat("has more than ", kMaxTasks, " tasks"));
}

}  // namespace

StudyPaths paths_beside(const std::string& study_file) {
    const fs::path folder = fs::path(study_file).parent_path();
    return {[folder](const std::string& path) -> Result<std::string> {
                return (folder / path).string();
            },
            [folder](const io::PathPattern& pattern) {
                return io::PathPattern::parse((folder / pattern.text()).string());
            }};
}

StudyFile read_study(std::string_view text, const std::string& file_name,
                     const PassRegistry& registry, const StudyPaths& paths,
                     const std::string& version) {
    TextTree tree = read_text_tree(text, file_name, StatusCode::usage);
    if (!has_errors(tree.diagnostics))
        return read_study(tree.root, file_name, registry, paths, version);
    StudyFile file;
    file.diagnostics = std::move(tree.diagnostics);
    return file;
}

StudyFile read_study(const TextNode& root, const std::string& file_name,
                     const PassRegistry& registry, const StudyPaths& paths,
                     const std::string& version) {
    StudyFile file;
    file.study.file = file_name;
    Reading reading{file, registry, paths,
                    Reporter(file_name, StatusCode::usage, file.diagnostics)};
    read(root, reading, version);
    sort_by_place(file.diagnostics);
    return file;
}

}  // namespace postchain::study

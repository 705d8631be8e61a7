#include "tools/measure/study/study_reader.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "config/camera_file.h"
#include "config/chain_named.h"
#include "config/reporter.h"
#include "config/scalar.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/study/questions.h"
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

bool is_path_word(const std::string& text) {
    return text.find_first_of("/.") == std::string::npos;
}

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

// Rows of bench that a study sets itself.
bool is_own(const std::string& key) {
    return key == "output" || key == "assets" || key == "on_existing" || key == "max_variants" ||
           key == "truth";
}

class StudyReader {
  public:
    StudyReader(StudyFile& file, const PassRegistry& registry, const StudyPaths& paths,
                const std::string& version)
        : file_(file),
          study_(file.study),
          registry_(registry),
          paths_(paths),
          version_(version),
          job_table_(sequence::job_parameters(registry)),
          reporter_(study_.file, StatusCode::usage, file.diagnostics) {}

    void read(const TextNode& root) {
        if (!root.is_map())
            return error(root, "", "a study is a map of keys, not " + root.describe());
        const TextNode* version = root.find("postchain_study");
        if (!version || version->text != std::to_string(kStudyFileVersion))
            error(version ? *version : root, "postchain_study",
                  concat("is ", kStudyFileVersion, " in a study of this version"));
        study_.title = text(root, "title").value_or(fs::path(study_.file).stem().string());
        const std::string kind = text(root, "kind").value_or("ab");
        if (kind != "ab" && kind != "bench") error(*root.find("kind"), "kind", "is ab or bench");
        study_.kind = kind == "bench" ? report::Kind::bench : report::Kind::ab;
        std::vector<std::string> known = {"postchain_study", "title",    "kind",
                                          "margins",         "settings", "scenes"};
        const bool swept = study_.kind == report::Kind::bench && !root.find("chains");
        const auto own = swept ? std::vector<std::string>{"chain", "sweep", "max_variants"}
                               : std::vector<std::string>{"chains", "questions"};
        known.insert(known.end(), own.begin(), own.end());
        for (const auto& [key, value] : root.entries)
            if (std::find(known.begin(), known.end(), key.text) == known.end())
                error(key, key.text, unknown_word("key", key.text, known));
        if (swept)
            read_sweep(root);
        else
            read_chains(root);
        read_margins(root, study_, reporter_);
        read_scenes(root);
        if (study_.scenes.size() * std::max<size_t>(study_.pairs.size(), 1) > kMaxTasks)
            error(root, "", concat("has more than ", kMaxTasks, " tasks"));
    }

  private:
    void error(const TextNode& at, const std::string& path, const std::string& message) {
        reporter_.error(at, path, message);
    }
    void error(const TextNode& at, const std::string& path, const Status& status) {
        file_.diagnostics.push_back({study_.file, at.line, at.column, Severity::error, path,
                                     status.message(), status.code()});
    }

    std::optional<std::string> text(const TextNode& map, const std::string& key,
                                    const std::string& above = {}) {
        const TextNode* node = map.find(key);
        if (!node) return std::nullopt;
        if (node->is_scalar() && !node->text.empty() && node->text.find('\0') == std::string::npos)
            return node->text;
        error(*node, above + key, node->describe() + " is no text");
        return std::nullopt;
    }

    // ---------------------------------------------------------------------------- chains
    std::optional<ChainText> chain_text(const TextNode& at, const std::string& path) {
        if (at.is_list()) return ChainText{study_.file, {}, false, chain_of_passes(at)};
        if (!at.is_scalar() || at.text.empty()) {
            error(at, path, at.describe() + " is not a chain's name, file or list of passes");
            return std::nullopt;
        }
        auto found = find_named_chain(at.text, paths_.file);
        if (!found.ok()) {
            error(at, path, found.status().message());
            return std::nullopt;
        }
        return std::move(*found);
    }

    bool hold_image(const TextNode& at, const std::string& path, Camera& camera) {
        const std::string file = camera.aperture_image.file();
        if (file.empty()) return true;
        auto resolved = paths_.file(file);
        if (!resolved.ok()) {
            error(at, path, "its aperture_image: " + resolved.status().message());
            return false;
        }
        camera.aperture_image = BokehKernel(*resolved);
        return true;
    }

    std::optional<Chain> parsed(const TextNode& at, const std::string& path,
                                const ChainText& text) {
        ChainFile file = parse_chain(text, registry_);
        const Status status = file.status();
        for (auto& one : file.diagnostics) file_.diagnostics.push_back(std::move(one));
        if (!status.ok() || !hold_image(at, path, file.chain.camera)) return std::nullopt;
        io::ApertureFiles pictures;
        if (Status read = pictures.read(file.chain.camera); !read.ok()) {
            error(at, path, read);
            return std::nullopt;
        }
        return std::move(file.chain);
    }

    void read_chains(const TextNode& root) {
        const TextNode* chains = root.find("chains");
        if (!chains || !chains->is_map() || chains->entries.size() < 2)
            return error(chains ? *chains : root, "chains",
                         "is a map of at least two chains: lens: dof_first, joint: balanced");
        for (const auto& [key, value] : chains->entries) {
            const std::string path = "chains." + key.text;
            if (!is_name(key.text)) {
                error(key, path, "a name has letters, digits, _ and - only");
                continue;
            }
            auto text = chain_text(value, path);
            if (!text) continue;
            auto chain = parsed(value, path, *text);
            if (!chain) continue;
            study_.chains.push_back({key.text, std::move(*chain)});
            study_.chain_files.push_back(text->file_name);
        }
        // Questions name them.
        if (study_.kind == report::Kind::bench)
            for (const auto& [name, chain] : study_.chains)
                study_.variants.push_back({name, {}, chain.clone()});
        if (study_.chains.size() == chains->entries.size()) read_questions(root, study_, reporter_);
    }

    void read_sweep(const TextNode& root) {
        const TextNode* named = root.find("chain");
        if (!named) return error(root, "chain", "is missing: a chain's name or file");
        auto text = chain_text(*named, "chain");
        if (!text) return;
        auto chain = parsed(*named, "chain", *text);
        if (!chain) return;
        study_.chains.push_back({fs::path(text->file_name).stem().string(), std::move(*chain)});
        study_.chain_files.push_back(text->file_name);
        int most = experiment::kMaxVariants;
        if (const TextNode* limit = root.find("max_variants")) {
            const auto value = value_of(*limit);
            const auto* number = value.ok() ? std::get_if<int64_t>(&*value) : nullptr;
            if (!number || *number < 1 || *number > 100000)
                return error(*limit, "max_variants", "is an integer in 1..100000");
            most = int(*number);
        }
        const TextNode* list = root.find("sweep");
        if (!list || !list->is_list() || list->items.empty())
            return error(list ? *list : root, "sweep",
                         "is a list of texts: [\"motion_blur.samples=5,9,13\"]");
        std::vector<experiment::Sweep> sweeps;
        for (const TextNode& item : list->items) {
            auto sweep = experiment::parse_sweep(item.text);
            if (!sweep.ok()) return error(item, "sweep", sweep.status());
            if (sweep->key == "camera.aperture_image")
                return error(item, "sweep", "pictures of apertures cannot be swept in a study");
            sweeps.push_back(std::move(*sweep));
        }
        auto variants = experiment::sweep_variants(*text, registry_, {}, sweeps, most);
        if (!variants.ok()) return error(*list, "sweep", variants.status());
        study_.variants = std::move(*variants);
        if (study_.variants.size() < 2)
            return error(*list, "sweep", "makes one variant; there is nothing to compare");
        for (size_t b = 1; b < study_.variants.size(); ++b) study_.ask(0, b);
    }

    // ---------------------------------------------------------------------------- scenes
    struct Typed {
        sequence::JobSettings job;
        experiment::BenchSettings measured;
    };

    void set_row(const ParameterTable& table, ParameterRef settings, const TextEntry& entry,
                 const std::string& path) {
        if (!entry.value.is_scalar() && !entry.value.is_null())
            return error(
                entry.value, path,
                entry.value.describe() + " is not " + table.find(entry.key.text)->domain());
        auto value = value_of(entry.value);
        if (!value.ok()) return error(entry.value, path, value.status().message());
        // frames: 10 is a range like 10-12.
        if (table.find(entry.key.text)->type == ParameterType::text && entry.value.is_scalar())
            value = ParameterValue(entry.value.text);
        if (const auto* word = std::get_if<std::string>(&*value);
            word && (word->empty() || word->find('\0') != std::string::npos))
            return error(entry.value, path, "is empty, or has a zero byte");
        if (Status status = table.set(settings, entry.key.text, *value); !status.ok())
            error(entry.value, path, status.message());
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
            if (!is_own(row.key) &&
                (study_.kind == report::Kind::bench || experiment::ab_parameters().find(row.key)))
                known.push_back(row.key);
        for (const TextEntry& entry : map.entries) {
            const std::string& key = entry.key.text;
            const auto found = std::find(known.begin(), known.end(), key);
            if (found == known.end())
                error(entry.key, above + key, unknown_word("key", key, known));
            else if (size_t(found - known.begin()) < others)
                continue;
            else if (const Parameter* row = job_table_.find(key); row && takes(*row))
                set_row(job_table_, &typed.job, entry, above + key);
            else
                set_row(own, &typed.measured, entry, above + key);
        }
    }

    void read_scenes(const TextNode& root) {
        Typed common;
        common.measured.page_frames = 1;
        if (const TextNode* map = root.find("settings")) {
            if (map->is_map())
                read_settings(*map, "settings.", common, {});
            else
                error(*map, "settings", "is a map of settings of all scenes");
        }
        const TextNode* scenes = root.find("scenes");
        if (!scenes || !scenes->is_list() || scenes->items.empty())
            return error(scenes ? *scenes : root, "scenes", "is a list of scenes");
        std::set<std::string> names;
        for (size_t i = 0; i < scenes->items.size(); ++i) {
            const TextNode& node = scenes->items[i];
            const std::string above = concat("scenes[", i, "].");
            if (!node.is_map()) {
                error(node, concat("scenes[", i, "]"), "a scene is a map: {name: a, input: ...}");
                continue;
            }
            read_scene(node, above, common, names);
        }
    }

    void read_scene(const TextNode& node, const std::string& above, Typed typed,
                    std::set<std::string>& names) {
        const size_t before = file_.diagnostics.size();
        Scene scene;
        scene.name = text(node, "name", above).value_or("");
        if (!is_name(scene.name)) {
            const TextNode* name = node.find("name");
            error(name ? *name : node, above + "name",
                  concat("a scene has a name of letters, digits, _ and -, at most ", kMaxName));
        } else if (!names.insert(scene.name).second) {
            error(*node.find("name"), above + "name", "two scenes are named " + scene.name);
        }
        scene.family = text(node, "family", above).value_or(scene.name);
        scene.input = text(node, "input", above).value_or("");
        scene.truth = text(node, "truth", above).value_or("");
        if (!node.find("input")) error(node, above + "input", "is missing: the scene's frames");
        if (!node.find("truth") && study_.kind == report::Kind::ab)
            error(node, above + "truth", "is missing: what the scene is measured against");
        read_settings(node, above, typed, {"name", "family", "input", "truth"});
        if (file_.diagnostics.size() > before) return;
        typed.job.input = scene.input;
        scene.settings = job_table_.text(&typed.job) + " " +
                         experiment::bench_parameters().text(&typed.measured);
        scene.measured = typed.measured;
        complete(node, above, typed.job, scene);
        study_.scenes.push_back(std::move(scene));
    }

    std::optional<io::InputSpec> resolved(const TextNode& at, const std::string& path,
                                          const std::string& text) {
        auto spec = io::InputSpec::parse(text);
        if (!spec.ok()) {
            error(at, path, spec.status().message());
            return std::nullopt;
        }
        for (auto& [role, pattern] : spec->patterns) {
            auto found = paths_.pattern(pattern);
            if (!found.ok()) {
                error(at, path, found.status());
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
        auto found = paths_.file(text);
        if (!found.ok()) {
            const TextNode* at = node.find(key);
            error(at ? *at : node, above + key, found.status());
            return false;
        }
        text = *found;
        return true;
    }

    void complete(const TextNode& node, const std::string& above, sequence::JobSettings job,
                  Scene& scene) {
        auto input = resolved(*node.find("input"), above + "input", scene.input);
        if (!scene.truth.empty()) {
            const TextNode& at = *node.find("truth");
            auto truth = resolved(at, above + "truth", scene.truth);
            if (truth && truth->separate_files())
                error(at, above + "truth", "give one pattern, for color only");
            else if (truth)
                scene.measured.truth = truth->color().text();
            scene.measured.truth_is = scene.truth;
        }
        std::optional<io::PathPattern> behind;
        if (!job.behind.empty()) {
            const TextNode* at = node.find("behind");
            auto found = io::PathPattern::parse(job.behind);
            if (found.ok()) found = paths_.pattern(*found);
            if (!found.ok()) return error(at ? *at : node, above + "behind", found.status());
            behind = std::move(*found);
        }
        if (!resolve_file(node, above, "camera", job.camera)) return;
        if (!resolve_file(node, above, "ocio", job.ocio)) return;
        if (!is_path_word(job.profile) && !resolve_file(node, above, "profile", job.profile))
            return;
        if (!job.camera.empty()) {
            auto camera = load_camera(job.camera);
            if (camera.ok() && camera->status().ok()) {
                const TextNode* at = node.find("camera");
                bool good = hold_image(at ? *at : node, above + "camera", camera->camera);
                for (auto& [number, frame] : camera->frames)
                    good = hold_image(at ? *at : node, above + "camera", frame.camera) && good;
                if (!good) return;
            }
        }
        Diagnostics notes;
        auto run = sequence::run_settings_of(job, registry_, notes);
        for (auto& note : notes)
            if (note.severity != Severity::error) file_.diagnostics.push_back(std::move(note));
        if (!run.ok()) return error(node, above + scene.name, run.status());
        if (!input) return;
        run->input = std::move(*input);
        if (behind) run->input.patterns.emplace(Role::behind, std::move(*behind));
        run->version = version_;
        scene.measured.run = std::move(*run);
    }

    StudyFile& file_;
    Study& study_;
    const PassRegistry& registry_;
    const StudyPaths& paths_;
    const std::string& version_;
    const ParameterTable job_table_;
    Reporter reporter_;
};

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
    StudyReader(file, registry, paths, version).read(root);
    sort_by_place(file.diagnostics);
    return file;
}

}  // namespace postchain::study

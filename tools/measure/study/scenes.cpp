#include "tools/measure/study/scenes.h"

#include <algorithm>
#include <set>

#include "config/camera_file.h"
#include "config/scalar.h"
#include "tools/measure/experiment/experiment.h"

namespace postchain::study {
namespace {

bool is_path_word(const std::string& text) {
    return text.find_first_of("/.") == std::string::npos;
}

// Rows of bench that a study sets itself.
bool is_own(const std::string& key) {
    return key == "output" || key == "assets" || key == "on_existing" || key == "max_variants" ||
           key == "truth";
}

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
            const auto found = std::find(known.begin(), known.end(), key);
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
            auto camera = load_camera(job.camera);
            if (camera.ok() && camera->status().ok()) {
                const TextNode* at = node.find("camera");
                bool good = reading_.hold_image(at ? *at : node, above + "camera", camera->camera);
                for (auto& [number, frame] : camera->frames)
                    good = reading_.hold_image(at ? *at : node, above + "camera", frame.camera) &&
                           good;
                if (!good) return;
            }
        }
        Diagnostics notes;
        auto run = sequence::parse_job(job, reading_.registry, notes);
        for (auto& note : notes)
            if (note.severity != Severity::error)
                reading_.file.diagnostics.push_back(std::move(note));
        if (!run.ok()) return reading_.error(node, above + scene.name, run.status());
        if (!input) return;
        run->input = std::move(*input);
        if (behind) run->input.patterns.emplace(Role::behind, std::move(*behind));
        run->version = version_;
        scene.measured.run = std::move(*run);
    }

    Reading& reading_;
    const std::string& version_;
    const ParameterTable job_table_;
};

}  // namespace

void read_scenes(const TextNode& root, Reading& reading, const std::string& version) {
    SceneReader(reading, version).read(root);
}

}  // namespace postchain::study

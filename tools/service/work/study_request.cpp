#include "tools/service/work/study_request.h"

#include <filesystem>

#include "tools/service/work/held_paths.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

// `refused` counts the paths outside the roots.
study::StudyPaths paths_from(const fs::path& folder, const Roots& roots, size_t& refused) {
    return {[folder, &roots, &refused](const std::string& path) {
                auto resolved = roots.resolve((folder / path).string());
                refused += !resolved.ok();
                return resolved;
            },
            [folder, &roots, &refused](const io::PathPattern& pattern) -> Result<io::PathPattern> {
                auto whole = io::PathPattern::parse((folder / pattern.text()).string());
                if (!whole.ok()) return whole;
                auto resolved = resolve_pattern(*whole, roots);
                refused += !resolved.ok();
                return resolved;
            }};
}

}  // namespace

void read_study(RequestBody& body, const Roots& roots, const PassRegistry& registry,
                const std::string& version, study::Study& study, study::StudySettings& settings) {
    body.read_rows(study::study_parameters(), "", &settings);
    body.hold_rows(study::study_parameters(), &settings);
    const TextNode* node = body.find("study");
    if (!node) return body.fault("study", "missing; give a study's file or object");
    std::string file = joined_path(roots.folders().front(), kBodyFile), text;
    if (is_string(*node) && !RequestBody::has_zero(node->text)) {
        auto held = body.hold("study", node->text);
        if (!held) return;
        file = std::move(*held);
        auto read = read_text_file(file, StatusCode::usage);
        if (!read.ok()) return body.fault("study", read.status().message());
        text = std::move(*read);
    } else if (!node->is_map()) {
        return body.fault("study", node->describe() + " is not a study's file or object");
    }
    size_t refused = 0;
    const study::StudyPaths paths = paths_from(fs::path(file).parent_path(), roots, refused);
    study::StudyFile read = node->is_map()
                                ? study::read_study(*node, file, registry, paths, version)
                                : study::read_study(text, file, registry, paths, version);
    for (Diagnostic& one : read.diagnostics) {
        if (one.file == file && node->is_map()) one.file = kBodyFile;
        const bool is_refused = one.severity == Severity::error && refused > 0;
        if (is_refused) --refused;
        body.add(std::move(one), is_refused);
    }
    study = std::move(read.study);
    for (study::Scene& scene : study.scenes) scene.measured.run.source.layers.hold = hold_of(roots);
}

}  // namespace postchain::service

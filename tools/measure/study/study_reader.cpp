#include "tools/measure/study/study_reader.h"

#include <algorithm>
#include <filesystem>

#include "tools/measure/study/chains.h"
#include "tools/measure/study/questions.h"
#include "tools/measure/study/scenes.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;

void read(const TextNode& root, Reading& reading, const std::string& version) {
    Study& study = reading.file.study;
    if (!root.is_map())
        return reading.error(root, "", "a study is a map of keys, not " + root.describe());
    const TextNode* format = root.find("postchain_study");
    if (!format || format->text != std::to_string(kStudyFileVersion))
        reading.error(format ? *format : root, "postchain_study",
                      concat("is ", kStudyFileVersion, " in a study of this version"));
    study.title = reading.text(root, "title").value_or(fs::path(study.file).stem().string());
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
        if (std::find(known.begin(), known.end(), key.text) == known.end())
            reading.error(key, key.text, unknown_word("key", key.text, known));
    if (swept)
        read_sweep(root, reading);
    else
        read_chains(root, reading);
    read_margins(root, study, reading.reporter);
    read_scenes(root, reading, version);
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

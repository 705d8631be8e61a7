#include "tools/measure/study/chains.h"

#include <filesystem>

#include "config/chain_find.h"
#include "config/scalar.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/study/questions.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;

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
    if (!at.is_scalar() || at.text.empty()) {
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
    if (!status.ok() || !reading.hold_image(at, path, file.chain.camera)) return std::nullopt;
    io::ApertureFiles pictures;
    if (Status read = pictures.read(file.chain.camera); !read.ok()) {
        reading.error(at, path, read);
        return std::nullopt;
    }
    return std::move(file.chain);
}

}  // namespace

void read_chains(const TextNode& root, Reading& reading) {
    Study& study = reading.file.study;
    const TextNode* chains = root.find("chains");
    if (!chains || !chains->is_map() || chains->entries.size() < 2)
        return reading.error(chains ? *chains : root, "chains",
                             "is a map of at least two chains: lens: dof_first, joint: balanced");
    for (const auto& [key, value] : chains->entries) {
        const std::string path = "chains." + key.text;
        if (!is_name(key.text)) {
            reading.error(key, path, "a name has letters, digits, _ and - only");
            continue;
        }
        auto text = chain_text(value, path, reading);
        if (!text) continue;
        auto chain = parsed(value, path, *text, reading);
        if (!chain) continue;
        study.chains.push_back({key.text, std::move(*chain)});
        study.chain_files.push_back(text->file_name);
    }
    // Questions name them.
    if (study.kind == report::Kind::bench)
        for (const auto& [name, chain] : study.chains)
            study.variants.push_back({name, {}, chain.clone()});
    if (study.chains.size() == chains->entries.size())
        read_questions(root, study, reading.reporter);
}

void read_sweep(const TextNode& root, Reading& reading) {
    Study& study = reading.file.study;
    const TextNode* named = root.find("chain");
    if (!named) return reading.error(root, "chain", "is missing: a chain's name or file");
    auto text = chain_text(*named, "chain", reading);
    if (!text) return;
    auto chain = parsed(*named, "chain", *text, reading);
    if (!chain) return;
    study.chains.push_back({fs::path(text->file_name).stem().string(), std::move(*chain)});
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
    study.variants = std::move(*variants);
    if (study.variants.size() < 2)
        return reading.error(*list, "sweep", "makes one variant; there is nothing to compare");
    for (size_t b = 1; b < study.variants.size(); ++b) study.ask(0, b);
}

}  // namespace postchain::study

#include "tools/service/work/request_chain.h"

#include <filesystem>

#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

// An override; the path of an aperture image is relative to the first root.
std::string from_root(const std::string& text, const Roots& roots) {
    const std::string key = "camera.aperture_image=";
    if (!text.starts_with(key) || text.size() == key.size() || text[key.size()] == '/' ||
        text == key + "null")
        return text;
    return key + joined_path(roots.folders().front(), text.substr(key.size()));
}

}  // namespace

ChainReader::ChainReader(RequestBody& body, const Roots& roots, const PassRegistry& registry)
    : body_(body), roots_(roots), registry_(registry), sets_(body.list("set")) {
    for (std::string& text : sets_) text = from_root(text, roots);
}

void ChainReader::read(const std::string& key, NamedChain& chain, ChainText& text) {
    const std::string text_key = key + "_text";
    const TextNode* named = body_.find(key);
    const TextNode* written = body_.find(text_key);
    if (named && written) return body_.fault(text_key, "contradicts " + key + "; give one of them");
    if (!named && !written) return body_.fault(key, "missing; give a chain's name, file or object");
    // Files that a chain names are relative to the folder of its text.
    const std::string in_root = joined_path(roots_.folders().front(), kBodyFile);
    std::string shown_as;
    if (written) {
        if (!is_string(*written))
            return body_.fault(text_key, written->describe() + " is not a chain file's text");
        text = {in_root, written->text, false};
        shown_as = text_key;
    } else if (named->is_map()) {
        text = {in_root, {}, false, *named};
        shown_as = kBodyFile;
    } else if (is_string(*named) && named->text.empty()) {
        return body_.fault(key, "empty; give a chain's name, file or object");
    } else if (is_string(*named)) {
        if (!find(key, named->text, text)) return;
    } else {
        return body_.fault(key, named->describe() + " is not a chain's name, file or object");
    }
    chain.name = shown_as.empty() ? fs::path(text.file_name).stem().string() : key;
    ChainFile file = parse_chain(text, registry_, sets_);
    for (Diagnostic& one : file.diagnostics) {
        if (one.file == text.file_name && !shown_as.empty()) one.file = shown_as;
        body_.add(std::move(one));
    }
    if (!file.status().ok()) return;
    if (body_.confine_image(key, file.chain.camera)) {
        io::ApertureFiles images;
        if (Status status = images.read(file.chain.camera); !status.ok())
            body_.fault(key, "camera.aperture_image: " + status.message());
    }
    chain.chain = std::move(file.chain);
}

bool ChainReader::find(const std::string& key, const std::string& name, ChainText& text) {
    Status unresolved;
    auto found = find_named_chain(name, [&](const std::string& path) {
        auto resolved = roots_.resolve(path);
        unresolved = resolved.status();
        return resolved;
    });
    if (found.ok()) {
        text = std::move(*found);
        return true;
    }
    if (unresolved.ok())
        body_.fault(key, found.status().message());
    else
        body_.refuse_path(key, unresolved);
    return false;
}

}  // namespace postchain::service

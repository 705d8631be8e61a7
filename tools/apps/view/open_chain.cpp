#include "tools/apps/view/open_chain.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tools/apps/view/chain_text.h"
#include "tools/apps/view/save.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;

constexpr auto kKeepInterval = std::chrono::seconds(1);
constexpr int kViewersOfOneChain = 16;

Status not_one() {
    return Status(StatusCode::input, "the recovery file is damaged; its edits are lost");
}

// The edits as the text of a recovery file, JSON.
std::string recovery_text(const DocumentState& state) {
    io::Json json;
    json["chain"] = write_chain(state.chain);
    json["off"] = state.off;
    json["focus_keys"] = io::Json::object();
    for (const auto& [frame, distance] : state.focus_keys)
        json["focus_keys"][std::to_string(frame)] = distance;
    return io::json_text(json, 1) + "\n";
}

// Errors (input): not a recovery file.
Result<DocumentState> state_of_recovery(const std::string& text, const PassRegistry& registry) try {
    const auto read = io::read_json(text, "recovery", io::kReportLimits);
    if (!read.ok()) return not_one();
    const io::Json& json = *read;
    ChainFile file = parse_chain(json.at("chain").get<std::string>(), "recovery", registry);
    RETURN_IF_ERROR(file.status());
    DocumentState state;
    state.chain = std::move(file.chain);
    io::ApertureFiles pictures;
    RETURN_IF_ERROR(pictures.read(state.chain.camera));
    state.off = json.at("off").get<std::vector<bool>>();
    if (state.off.size() != state.chain.links.size()) return not_one();
    for (const auto& [frame, distance] : json.at("focus_keys").items())
        state.focus_keys[std::stoi(frame)] = distance.get<double>();
    return state;
} catch (const std::exception&) {
    return not_one();
}

}  // namespace

Recovery::Recovery(const std::string& folder, const std::string& chain_name) {
    if (folder.empty()) return;
    std::error_code error;
    fs::create_directories(folder, error);
    const std::string whole = fs::absolute(chain_name, error).lexically_normal().string();
    const std::string name = folder + "/" + hex_of(hash_text(whole));
    // The first that an earlier viewer left, otherwise the first that is free.
    for (const bool left : {true, false}) {
        for (int i = 0; i < kViewersOfOneChain && lock_ < 0; ++i) {
            path_ = concat(name, "-", i, ".json");
            lock_path_ = concat(name, "-", i, ".lock");
            if (left && !fs::exists(path_, error)) continue;
            lock_ = ::open(lock_path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
            if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) == 0) continue;
            ::close(lock_);
            lock_ = -1;
        }
    }
    if (lock_ < 0) path_.clear();
}

Recovery::~Recovery() {
    if (lock_ < 0) return;
    std::error_code error;
    if (!fs::exists(path_, error)) fs::remove(lock_path_, error);
    ::close(lock_);
}

std::string Recovery::left() const {
    std::error_code error;
    if (path_.empty() || !fs::exists(path_, error)) return "";
    const auto text = read_text_file(path_, StatusCode::input);
    return text.ok() ? *text : "";
}

void Recovery::discard() {
    std::error_code error;
    if (!path_.empty()) fs::remove(path_, error);
}

OpenChain::OpenChain(ChainToOpen given, const sequence::RunSettings& run, Messages& messages)
    : given_(std::move(given)),
      run_(run),
      messages_(messages),
      document_(builtin_passes(), given_.chain.clone()),
      recovery_(given_.recovery_folder, given_.name) {
    if (is_file()) stamp_ = io::FileStamp::of(name());
    kept_revision_ = document_.revision();
    const std::string left = recovery_.left();
    if (left.empty()) return;
    auto state = state_of_recovery(left, document_.registry());
    if (!state.ok()) {
        messages_.say(state.status().message(), true);
        return;
    }
    document_.restore(std::move(*state));
    messages_.say(
        "restored edits of a viewer that ended before they were saved; undo leads back to the "
        "file");
}

void OpenChain::reload_if_changed() {
    if (!is_file()) return;
    io::FileStamp stamp = io::FileStamp::of(name());
    if (stamp == stamp_) return;
    stamp_ = std::move(stamp);
    reload();
}

void OpenChain::reload() {
    const auto text = read_text_file(name(), StatusCode::chain);
    if (!text.ok()) return messages_.say(text.status().message(), true);
    if (*text == given_.text) return;
    ChainFile file = parse_chain(*text, name(), document_.registry(), given_.sets);
    if (!file.status().ok()) {
        for (const auto& one : file.diagnostics)
            if (one.severity == Severity::error) messages_.say(one.text(), true);
        return messages_.say(name() + ": the chain stays as it was; mend the file");
    }
    io::ApertureFiles pictures;
    if (const Status status = pictures.read(file.chain.camera); !status.ok())
        return messages_.say(status.at("camera.aperture_image").message(), true);
    given_.text = *text;
    document_.replace(std::move(file.chain), "reload");
    document_.saved();
    messages_.say(name() + ": reloaded");
}

void OpenChain::keep_edits(Clock::time_point now) {
    if (recovery_.path().empty() || kept_revision_ == document_.revision() ||
        document_.in_gesture() || now - kept_at_ < kKeepInterval)
        return;
    kept_at_ = now;
    kept_revision_ = document_.revision();
    if (!document_.unsaved()) return recovery_.discard();
    const Status status = save_text(run_, recovery_.path(), recovery_text(document_.state()),
                                    "the recovery file", true);
    if (!status.ok()) messages_.say(status.message(), true);
}

void OpenChain::discard_edits() {
    kept_revision_ = document_.revision();
    recovery_.discard();
}

Status OpenChain::save(const std::string& path, bool replace) {
    if (path.ends_with(".json"))
        return Status(StatusCode::output, path + ": chains are saved as YAML; name a .yaml file");
    ChainFileText saved = chain_file_text(given_.text, document_);
    sequence::RunSettings settings = run_;
    // The open chain file is the only input that is replaced by its own new text.
    std::erase_if(settings.other_inputs,
                  [&](const io::InputFile& file) { return file.path == name(); });
    bool own = is_file() && path == name();
    if (own && !replace) {
        const auto text = read_text_file(path, StatusCode::chain);
        own = !text.ok() || *text == given_.text;
    }
    RETURN_IF_ERROR(save_text(settings, path, saved.text, "the chain file", replace || own));
    given_.text = saved.text;
    given_.name = path;
    given_.is_file = true;
    given_.sets.clear();
    stamp_ = io::FileStamp::of(path);
    document_.saved(std::move(saved.off));
    messages_.say(path +
                  (saved.kept ? ": saved" : ": saved, written anew below its first comments"));
    if (!document_.keys_changed())
        discard_edits();
    else
        messages_.say("the focus keys are not in the chain file: save the camera file too");
    return Status();
}

}  // namespace postchain::view

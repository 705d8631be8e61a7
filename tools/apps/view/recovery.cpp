#include "tools/apps/view/recovery.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>

#include "config/chain_file.h"
#include "tools/apps/common/state.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;

constexpr int kViewersOfOneChain = 16;

Status not_one() {
    return Status(StatusCode::input, "the recovery file is damaged; its edits are lost");
}

}  // namespace

std::string recovery_text(const DocumentState& state) {
    io::Json json;
    json["chain"] = write_chain(state.chain);
    json["off"] = state.off;
    json["focus_keys"] = io::Json::object();
    for (const auto& [frame, distance] : state.focus_keys)
        json["focus_keys"][std::to_string(frame)] = distance;
    return io::json_text(json, 1) + "\n";
}

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

std::string recovery_folder() {
    const std::string state = state_folder();
    return state.empty() ? "" : state + "/view";
}

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

}  // namespace postchain::view

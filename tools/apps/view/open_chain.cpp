#include "tools/apps/view/open_chain.h"

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tools/apps/view/chain_text.h"
#include "tools/apps/view/save.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::view {
namespace {

constexpr auto kKeepInterval = std::chrono::seconds(1);

}  // namespace

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
    if (!document_.keys_changed()) discard_edits();
    if (document_.keys_changed())
        messages_.say("the focus keys are not in the chain file: save the camera file too");
    return Status();
}

}  // namespace postchain::view

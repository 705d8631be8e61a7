#include "tools/apps/postchain/like.h"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "chain/text.h"
#include "config/camera_file.h"
#include "tools/apps/postchain/log.h"

namespace postchain {
namespace {

bool is_given(const CLI::App& run, const std::string& key) {
    const std::string name = sequence::option_name(key);
    for (const std::string& one : {name, "--no-" + name.substr(2)})
        if (const CLI::Option* option = run.get_option_no_throw(one); option && option->count())
            return true;
    return false;
}

// Uses the camera file if it is unchanged, otherwise the values it gave for the recorded frame.
void apply_camera(const sequence::Record& record, Options& options) {
    if (record.camera_hash.empty()) return;
    const auto file = load_camera(options.job.camera);
    if (file.ok() && hex_of(file->text_hash) == record.camera_hash) return;
    log::warning(concat(options.like, ": the camera file ", options.job.camera,
                        file.ok() ? " has changed" : " no longer exists", ": its values of frame ",
                        record.frame, " are used for every frame, and its matrices are unknown"));
    options.job.camera.clear();
    options.recorded_camera = record.camera;
}

void compare_inputs(const sequence::Record& record, const std::string& like) {
    for (const auto& file : record.inputs) {
        std::error_code error;
        const auto bytes = std::filesystem::file_size(file.path, error);
        if (error)
            log::warning(concat(like, ": was made from ", file.path, ", which no longer exists"));
        else if (bytes != file.bytes)
            log::warning(concat(like, ": was made from ", file.path, " of ", file.bytes,
                                " bytes, which has ", bytes, " now"));
    }
}

}  // namespace

void add_like(CLI::App& run, Options& options) {
    run.add_option(
           "--like", options.like,
           "an output of `run`: repeats it with its chain, camera and settings; other options "
           "override them")
        ->type_name("OUT");
    CLI::Option* chain = run.get_option("CHAIN")->required(false);
    CLI::Option* input = run.get_option("--input")->required(false);
    run.final_callback([&options, chain, input] {
        if (!options.like.empty()) return;
        for (const CLI::Option* option : {chain, input})
            if (option->count() == 0) throw CLI::RequiredError(option->get_name());
    });
}

Result<std::optional<sequence::Record>> apply_like(const CLI::App& run, Options& options) {
    if (options.like.empty()) return std::optional<sequence::Record>();
    auto record = sequence::read_record(options.like);
    if (!record.ok()) return record.status().at("--like");
    if (record->version != kVersion)
        log::warning(concat(options.like, ": was made by postchain ", record->version, ", this is ",
                            kVersion, ": the result may differ"));
    if (options.chain.empty()) options.recorded_chain = record->chain;
    for (const auto& [key, value] : record->settings) {
        const Parameter* row = job_parameters().find(key);
        if (!row || !row->check(value).ok()) {
            log::warning(
                concat(options.like, ": its setting ", key, " is unknown in this version"));
            continue;
        }
        // The layer behind belongs to the recorded input.
        if (!is_given(run, key) && !(key == "behind" && is_given(run, "input")))
            row->set(&options.job, value);
    }
    if (!is_given(run, "input")) {
        compare_inputs(*record, options.like);
        if (!is_given(run, "frames")) options.job.frames = concat(record->frame);
    }
    if (!is_given(run, "camera")) apply_camera(*record, options);
    return std::optional(std::move(*record));
}

}  // namespace postchain

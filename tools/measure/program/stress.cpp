// postchain stress: the stability matrix of a chain, or of every pass and both orders.
//
//   CHAIN, or each pass of the registry separately + shipped chains of both orders
//     --tools/stress--> Matrix --> text or JSON on stdout
//     -o DIR            --> DIR/stress.txt, DIR/stress.json, DIR/index.html
#include "tools/measure/program/subcommands.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/measure/stress/page.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/run/device.h"
#include "tools/stress/matrix.h"
#include "tools/stress/subjects.h"

namespace postchain {
namespace {

struct StressOptions {
    std::string only;
    std::string folder;  // empty = writes no files
    io::OnExisting on_existing = io::OnExisting::fail;
};

using io::Json;

Result<std::vector<stress::Subject>> subjects_of(const Options& options) {
    std::vector<stress::Subject> subjects;
    if (!options.chain.empty()) {
        ASSIGN_OR_RETURN(auto file, load_chain_of(options));
        subjects.push_back({options.chain, std::move(file.chain)});
        return subjects;
    }
    if (!options.sets.empty()) return Status(StatusCode::usage, "--set: needs a CHAIN; name one");
    return stress::every_subject(builtin_passes());
}

// JSON has no infinities: they and NaN become null.
Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

// "postchain_stress" is the format version.
Json json_of(const stress::Matrix& matrix, const std::string& renderer) {
    Json cells = Json::array();
    for (const auto& cell : matrix.cells) {
        Json checks = Json::array();
        for (const auto& one : cell.measured) {
            Json check = {{"check", one.check},
                          {"verdict", stress::name_of(one.verdict)},
                          {"value", number(one.value)},
                          {"bound", number(one.bound)}};
            if (!one.note.empty()) check["note"] = one.note;
            if (one.limit) check["known"] = one.limit->reason;
            checks.push_back(std::move(check));
        }
        cells.push_back({{"chain", cell.subject},
                         {"row", cell.row},
                         {"cell", cell.cell},
                         {"precision", name_of(cell.precision)},
                         {"bits", hex_of(cell.bits)},
                         {"checks", std::move(checks)}});
    }
    return {{"postchain_stress", 1},
            {"version", kVersion},
            {"renderer", renderer},
            {"checks", matrix.checks()},
            {"ok", matrix.count(stress::Verdict::ok)},
            {"limits", matrix.count(stress::Verdict::limit)},
            {"failed", matrix.count(stress::Verdict::failed)},
            {"cells", std::move(cells)}};
}

constexpr const char* kText = "stress.txt";
constexpr const char* kJson = "stress.json";
constexpr const char* kPage = "index.html";

io::OutputFiles files_of(const Options& options, const StressOptions& stress,
                         const std::vector<stress::Subject>& subjects) {
    io::OutputFiles files(stress.on_existing);
    if (!options.chain.empty()) files.read({options.chain, "the chain file"});
    for (const auto& subject : subjects)
        for (const auto& picture : io::inputs_of(subject.chain.camera)) files.read(picture);
    if (stress.folder.empty()) return files;
    for (const char* name : {kText, kJson, kPage})
        files.write(io::OutputFile{stress.folder + "/" + name, "the matrix",
                                   "name another folder with --output"});
    return files;
}

// The command line, without options that do not affect the figures.
std::string command_of(const Options& options, const StressOptions& stress) {
    std::string text = "postchain stress";
    if (!options.chain.empty()) text += " " + options.chain;
    for (const auto& set : options.sets) text += " --set " + set;
    if (!stress.only.empty()) text += " --only '" + stress.only + "'";
    return text;
}

Result<int> stress_subcommand(const Options& options, const StressOptions& stress) {
    ASSIGN_OR_RETURN(auto subjects, subjects_of(options));
    const io::OutputFiles files = files_of(options, stress, subjects);
    RETURN_IF_ERROR(files.check());
    files.remove_left_temporaries();
    // The page needs it for its error maps; without it the cells are not run.
    if (!stress.folder.empty()) RETURN_IF_ERROR(io::image_module(StatusCode::output).status());
    ASSIGN_OR_RETURN(auto context, context_of(options));
    Executor executor(context->device());

    const StopOnSignal stop;
    stress::MatrixOptions matrix_options;
    matrix_options.only = stress.only;
    auto matrix = stress::run_matrix(executor, subjects, matrix_options,
                                     [&](const std::string& name, size_t done, size_t of) {
                                         log::progress(concat(done, " of ", of, ", ", name));
                                         return !stop.asked();
                                     });
    log::progress("");
    if (stop.asked()) return stop.interrupted("no report is written; run the same command again");
    if (!matrix.ok()) return matrix.status();

    const std::string text = stress::matrix_as_text(*matrix);
    const std::string json =
        io::json_text(json_of(*matrix, sequence::renderer_text(context->device()))) + "\n";
    std::fputs(options.json ? json.c_str() : text.c_str(), stdout);
    if (!stress.folder.empty()) {
        ASSIGN_OR_RETURN(auto pictures, stress::pictures_of(executor, subjects, *matrix));
        const std::string page = stress::matrix_as_page(
            *matrix, pictures,
            {kVersion, sequence::renderer_text(context->device()), command_of(options, stress)});
        std::error_code error;
        std::filesystem::create_directories(stress.folder, error);
        if (error)
            return Status(StatusCode::output,
                          "--output: " + stress.folder + ": " + error.message());
        const std::string start = stress.folder + "/";
        Status status = files.put(start + kText, text);
        if (status.ok()) status = files.put(start + kJson, json);
        if (status.ok()) status = files.put(start + kPage, page);
        RETURN_IF_ERROR(status);
    }
    return matrix->count(stress::Verdict::failed) ? kExitHealth : kExitOk;
}

}  // namespace

RunSubcommand add_stress(CLI::App& subcommand, Options& o) {
    const auto stress = std::make_shared<StressOptions>();
    add_chain(subcommand, o);
    subcommand.get_option("CHAIN")->required(false)->description(
        "chain file, or the name of a shipped chain (default: each pass separately, and both "
        "orders)");
    subcommand
        .add_option("-o,--output", stress->folder,
                    "folder for index.html (a page with images of failures), stress.txt and "
                    "stress.json")
        ->type_name("DIR");
    add_on_existing(subcommand, "if an output file exists", stress->on_existing);
    subcommand
        .add_option("--only", stress->only,
                    "only cells whose name CHAIN/ROW/CELL/PRECISION contains this; * matches any "
                    "characters")
        ->type_name("PATTERN");
    subcommand.add_flag("--json", o.json, "one JSON object");
    add_device(subcommand, o);
    return [&o, stress] { return stress_subcommand(o, *stress); };
}

}  // namespace postchain

// postchain blind: a page on which observers compare outputs without knowing which is which, and
// the evaluation of their choices.
//
//   NAME=OUT... --> DIR/index.html (for observers), DIR/key.json
//   --choices   --> counts, intervals and probabilities on stdout
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <set>

#include "chain/base/printable.h"
#include "config/text_tree.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/stop_on_signal.h"
#include "tools/measure/blind/comparison.h"
#include "tools/measure/report/words.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain {
namespace {

struct BlindOptions {
    std::vector<std::string> sides;  // "joint=out/joint.####.exr"
    std::string folder, truth;
    std::vector<std::string> choices;
    uint64_t seed = 1;
    io::OnExisting on_existing = io::OnExisting::fail;
};

constexpr const char* kMark = ".postchain-blind";
constexpr size_t kMaxBytes = size_t(256) << 20;  // all images of a page together
constexpr TextLimits kKeyLimits = {size_t(16) << 20, 8};

struct Side {
    std::string name;
    io::PathPattern files;
};

struct BlindWork {
    sequence::RunSettings settings;
    std::vector<Side> sides;
    std::optional<io::PathPattern> truth;
    std::vector<int> frames;
    io::OutputFiles files;
};

Result<Side> side_of(const std::string& text) {
    const size_t at = text.find('=');
    const std::string name = text.substr(0, at);
    if (at == std::string::npos || at == 0 ||
        name.find_first_not_of(
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") !=
            std::string::npos)
        return Status(StatusCode::usage,
                      text +
                          ": is not NAME=OUT, as in joint=out/joint.####.exr; a name has "
                          "letters, digits, _ and - only");
    ASSIGN_OR_RETURN(auto files, io::PathPattern::parse(text.substr(at + 1)).at(name));
    return Side{name, std::move(files)};
}

// Frames that every side has, or the requested ones.
Result<std::vector<int>> frames_of(const BlindWork& work) {
    std::vector<int> frames;
    if (work.settings.frames) {
        frames = work.settings.frames->frames;
    } else {
        for (const auto& [frame, path] : work.sides.front().files.discover())
            frames.push_back(frame);
        for (const Side& side : work.sides) {
            const auto found = side.files.discover();
            std::erase_if(frames, [&](int frame) { return !found.contains(frame); });
        }
    }
    if (frames.empty())
        return Status(StatusCode::input,
                      "the sides have no frame in common; render the same "
                      "frames of each");
    const size_t trials = frames.size() * work.sides.size() * (work.sides.size() - 1) / 2;
    if (trials > blind::kMaxTrials)
        return Status(StatusCode::usage, concat(trials, " pairs are more than the limit of ",
                                                blind::kMaxTrials, "; choose fewer with --frames"));
    return frames;
}

Result<BlindWork> work_of(const Options& options, const BlindOptions& blind) {
    BlindWork work;
    std::set<std::string> names;
    for (const std::string& text : blind.sides) {
        ASSIGN_OR_RETURN(auto side, side_of(text));
        if (!names.insert(side.name).second)
            return Status(StatusCode::usage, "two sides are named " + side.name);
        work.sides.push_back(std::move(side));
    }
    if (work.sides.size() < 2)
        return Status(
            StatusCode::usage,
            "a comparison needs two sides, as in lens=lens.####.exr joint=joint.####.exr; "
            "with --choices it evaluates a folder that exists");
    Options with_view = options;
    with_view.job.input = work.sides.front().files.text();
    with_view.job.preview = true;  // uses the view of previews
    ASSIGN_OR_RETURN(work.settings, run_settings_of(with_view));
    if (!blind.truth.empty()) {
        ASSIGN_OR_RETURN(work.truth, io::PathPattern::parse(blind.truth).at("--truth"));
    }
    ASSIGN_OR_RETURN(work.frames, frames_of(work));
    work.files = io::OutputFiles(blind.on_existing);
    for (const Side& side : work.sides) work.files.read(side.files, "side " + side.name);
    if (work.truth) work.files.read(*work.truth, "the ground truth");
    work.files.write(io::OutputFolder{blind.folder, "a blind comparison", kMark,
                                      "This folder is a blind comparison of postchain.\n",
                                      "name another folder with --output"});
    for (const char* name : {"index.html", "key.json"})
        work.files.write(io::OutputFile{blind.folder + "/" + name, "the comparison",
                                        "name another folder with --output"});
    RETURN_IF_ERROR(work.files.check());
    work.files.remove_left_temporaries();
    return work;
}

struct Shown {
    std::string png;
    int width = 0, height = 0;
};
// For display: the whole display window, black outside the data window.
Result<Shown> shown(const BlindWork& work, const std::string& path, int frame) {
    ASSIGN_OR_RETURN(auto color, sequence::read_color(work.settings.source, path, frame));
    const io::Window& display = color.input.display_window;
    ASSIGN_OR_RETURN(auto png,
                     io::encode_png_preview(io::placed(color.rgba(), color.input.window, display),
                                            {.view = work.settings.view}));
    return Shown{std::move(png), display.width(), display.height()};
}

Result<std::vector<blind::Picture>> pictures_of(const BlindWork& work, const StopOnSignal& stop) {
    std::vector<blind::Picture> pictures;
    size_t bytes = 0;
    for (const int frame : work.frames) {
        int width = 0, height = 0;
        for (size_t s = 0; s < work.sides.size() + (work.truth ? 1 : 0); ++s) {
            if (stop.asked()) return Status(StatusCode::canceled, "stopped");
            log::progress(concat("frame ", frame));
            const auto& files = s < work.sides.size() ? work.sides[s].files : *work.truth;
            const std::string path = files.format(frame);
            ASSIGN_OR_RETURN(auto image, shown(work, path, frame));
            if (s == 0) {
                width = image.width;
                height = image.height;
            } else if (image.width != width || image.height != height) {
                return Status(StatusCode::input,
                              concat(path, ": is ", image.width, "x", image.height,
                                     " and the first side's frame ", width, "x", height,
                                     "; render all sides at one size"));
            }
            bytes += image.png.size();
            if (bytes > kMaxBytes)
                return Status(StatusCode::usage,
                              concat("the images are larger than ", kMaxBytes >> 20,
                                     " MiB together; choose fewer with --frames"));
            pictures.push_back({frame, s, std::move(image.png)});
        }
    }
    return pictures;
}

Status write(const BlindWork& work, const std::string& path, std::string_view text) {
    ASSIGN_OR_RETURN(const auto permit, work.files.permit(path));
    return io::atomic_write_text(path, text, permit).status();
}

Result<int> make_folder(const Options& options, const BlindOptions& blind) {
    ASSIGN_OR_RETURN(auto work, work_of(options, blind));
    io::set_exr_threads(sequence::threads_of(options.threads));
    const StopOnSignal stop;
    const auto pictures = pictures_of(work, stop);
    log::progress("");
    if (stop.asked()) return stop.interrupted("no page is written; run the same command again");
    if (!pictures.ok()) return pictures.status();
    std::vector<std::string> names;
    for (const Side& side : work.sides) names.push_back(side.name);
    const blind::Comparison comparison =
        blind::make_comparison(names, work.frames, blind.seed, *pictures);
    const std::string page = blind.folder + "/index.html";
    Status status = work.files.make_folders();
    if (status.ok()) status = write(work, page, blind::page_of(comparison, *pictures));
    if (status.ok()) status = write(work, blind.folder + "/key.json", blind::key_text(comparison));
    RETURN_IF_ERROR(status);
    std::printf("%s\n", printable(page).c_str());
    log::info(concat(report::counted(comparison.trials.size(), "pair"), " of ", names.size(),
                     " sides; give observers ", page, " without key.json"));
    return kExitOk;
}

Result<int> evaluate(const Options& options, const BlindOptions& blind) {
    const std::string key = blind.folder + "/key.json";
    ASSIGN_OR_RETURN(const auto text, read_text_file(key, StatusCode::input, kKeyLimits));
    ASSIGN_OR_RETURN(const auto comparison, blind::comparison_from(text, key));
    std::vector<blind::Choice> choices;
    for (const std::string& file : blind.choices) {
        ASSIGN_OR_RETURN(const auto csv, read_text_file(file, StatusCode::input, kKeyLimits));
        RETURN_IF_ERROR(blind::read_choices(csv, file, comparison, choices));
    }
    std::set<std::string> observers;
    for (const auto& choice : choices) observers.insert(choice.observer);
    const auto results = blind::results_of(comparison, choices);
    if (options.json) {
        print_line(blind::results_json(comparison, results, observers.size()));
        return kExitOk;
    }
    std::printf("%s of %s, %s of images\n", report::counted(choices.size(), "choice").c_str(),
                report::counted(observers.size(), "observer").c_str(),
                report::counted(comparison.trials.size(), "pair").c_str());
    for (const auto& counts : results)
        std::printf("%s\n", printable(blind::words_of(comparison, counts)).c_str());
    return kExitOk;
}

Result<int> blind_subcommand(const Options& options, const BlindOptions& blind) {
    return blind.choices.empty() ? make_folder(options, blind) : evaluate(options, blind);
}

}  // namespace

RunSubcommand add_blind(CLI::App& subcommand, Options& o) {
    const auto blind = std::make_shared<BlindOptions>();
    subcommand
        .add_option("SIDE", blind->sides,
                    "two or more outputs of the same frames: lens=a.####.exr joint=b.####.exr")
        ->type_name("NAME=OUT");
    subcommand
        .add_option(
            "-o,--output", blind->folder,
            "folder of the comparison: index.html for observers, key.json for the evaluation")
        ->required()
        ->type_name("DIR");
    subcommand
        .add_option("-r,--truth", blind->truth,
                    "shown between both sides as a reference: both.####.exr")
        ->type_name("TRUTH");
    subcommand.add_option("--seed", blind->seed, "another order of pairs and sides")
        ->check(CLI::Range(int64_t(0), std::numeric_limits<int64_t>::max()))
        ->capture_default_str();
    add_on_existing(subcommand, "if the folder has a comparison", blind->on_existing);
    add_displayed(subcommand, o);
    const std::vector<CLI::Option*> of_the_folder = subcommand.get_options();
    CLI::Option* choices =
        subcommand
            .add_option("--choices", blind->choices,
                        "evaluate these choices of observers instead of making the folder")
            ->type_name("FILE");
    for (CLI::Option* option : of_the_folder)
        if (option != subcommand.get_help_ptr() && !option->check_lname("output"))
            choices->excludes(option);
    subcommand.add_flag("--json", o.json, "one JSON object on stdout")->needs(choices);
    return [&o, blind] { return blind_subcommand(o, *blind); };
}

}  // namespace postchain

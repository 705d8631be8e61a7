// Lists every place that writes a file (docs/command.md, "What is written, and what is never
// replaced"). Only tools/sequence/files/atomic_file opens files for writing, and only
// tools/sequence/files/output_files decides what may be replaced. All writers use it and are listed
// here; tests/command/replace_test.cpp and replace_report_test.cpp try each of them with foreign
// files and with inputs.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <regex>

#include "tests/structure/files.h"

namespace postchain::writers_test {
namespace {

using namespace structure;
using Counts = std::map<std::string, int>;  // by file

// Removes line comments.
std::string code_of(std::string line) {
    for (size_t at = line.find("//"); at != std::string::npos; at = line.find("//", at + 2)) {
        if (at > 0 && line[at - 1] == ':') continue;  // a URL in a string
        line.resize(at);
        break;
    }
    return line;
}

const std::vector<File>& sources() {
    static const auto all = [] {
        std::vector<File> found =
            files_below({"chain", "passes", "config", "tools"}, {".cpp", ".h"});
        for (File& file : found)
            for (std::string& line : file.lines) line = code_of(std::move(line));
        return found;
    }();
    return all;
}

struct Match {
    std::string file, place;
    std::smatch found;
};

// Every occurrence of the pattern.
std::vector<Match> matches_of(const std::string& pattern) {
    const std::regex expression(pattern);
    std::vector<Match> all;
    for (const File& file : sources())
        for (size_t i = 0; i < file.lines.size(); ++i) {
            const std::string& line = file.lines[i];
            for (std::sregex_iterator it(line.begin(), line.end(), expression), end; it != end;
                 ++it)
                all.push_back({file.name, place_of(file, i) + line, *it});
        }
    return all;
}

// Number of occurrences, without declarations in headers.
Counts count(const std::string& pattern) {
    Counts counts;
    for (const Match& one : matches_of(pattern))
        if (!one.file.ends_with(".h")) ++counts[one.file];
    return counts;
}

// Everything that can make, change or remove a file without the atomic writer.
const char* const kWays =
    R"(\bofstream\b|::fstream\b|\bfopen\b|\bfreopen\b|\bfdopen\b|\bFILE\s*\*|\bcreat\(|\bmkstemp)"
    R"(|\bO_WRONLY\b|\bO_RDWR\b|\bO_CREAT\b|\btruncate\(|\bresize_file\b|\bcopy_file\b|\bfs::copy\b)"
    R"(|\bfilesystem::copy\b|\brename(at2?)?\(|::remove(_all)?\(|::unlink\(|::link\(|\bsymlink\()"
    R"(|create_hard_link|create_symlink|\bImageOutput\b|Imf::\w*OutputFile\b|\bImageBuf\b.*write)"
    R"(|\bpng_image_write_to_(file|stdio)\b|\bpng_init_io\b)"
    R"(|_printer_file|basic_file_sink|\bmmap\(|\bsystem\(|\bpopen\()";

TEST(Writers, NothingElseOpensAFileForWriting) {
    const std::map<std::string, std::string> allowed = {
        {"tools/sequence/files/atomic_file.cpp", "the one that does"},
        {"tools/sequence/exr/exr_output.cpp", "OpenEXR, on a stream of the atomic file"},
        {"tools/sequence/exr/deep_writer.cpp", "OpenEXR, on a stream of the atomic file"},
        {"tools/sequence/image/image_codec.cpp", "OpenImageIO, into memory"},
        {"tools/measure/experiment/report_folder.cpp",
         "removes a report or study that is replaced"},
        {"tools/service/store/store_file.cpp",
         "SQLite, into a copy that gets its name when it is whole; a lock"},
        {"tools/service/work/remote_backend.cpp",
         "removes what tasks had in a folder of the service"},
        {"tools/service/work/remote_experiment.cpp", "chains of tasks, in the same folder"},
        {"tools/apps/postchain/selftest.cpp", "removes the folder that it has made"},
        {"tools/apps/view/main.cpp", "removes the folder of a scene that it has rendered"},
        {"tools/apps/view/recovery.cpp", "removes its own file of edits; a lock"},
        {"tools/apps/postchain/main.cpp", "/dev/null for streams that are closed"},
    };
    const Counts met = count(kWays);
    for (const auto& [file, times] : met)
        EXPECT_TRUE(allowed.count(file))
            << file << " opens, replaces or removes a file; write through AtomicFile";
    for (const auto& [file, why] : allowed) EXPECT_TRUE(met.count(file)) << file << ": " << why;
}

TEST(Writers, OpenExrAndOpenImageIoGetNoFileName) {
    for (const auto& [file, place, found] : matches_of(R"(Imf::\w*OutputFile\w*(\s+\w+)?\((\w+))"))
        EXPECT_EQ(found[2], "stream") << place;
    for (const auto& [file, place, found] : matches_of(R"(\bout->open\(([^,]+),)"))
        EXPECT_TRUE(found[1] == "\"memory.png\"" || found[1] == "memory.path()") << place;
}

// New writers also belong in tests/command/replace_test.cpp or replace_report_test.cpp.
TEST(Writers, AreTheseAndAskWhatMayBeReplaced) {
    const Counts expected = {
        // output: EXR, new EXR, other image; preview, sidecar
        {"tools/sequence/run/output_frame.cpp", 5},
        {"tools/sequence/run/run_sequence.cpp", 1},  // stage
        {"tools/measure/scenes/scene.cpp", 4},  // images, deep images, aperture image, camera.json
        {"tools/apps/postchain/diff.cpp", 2},   // maps
        {"tools/apps/postchain/selftest.cpp", 1},  // in its own folder
        {"tools/sequence/run/sheet.cpp", 1},
        {"tools/python/write_call.cpp", 2},     // an EXR, another format
        {"tools/apps/postchain/blind.cpp", 1},  // index.html, key.json
        {"tools/apps/view/save.cpp", 1},  // chain, camera, image, sheet, movie, state of the viewer
        {"tools/apps/postchain/stress.cpp", 1},
        {"tools/apps/postchain/tune.cpp", 1},
        {"tools/measure/report/report.cpp", 1},     // json, csv, md, images of the page, chains
        {"tools/measure/report/images.cpp", 2},     // images/
        {"tools/measure/report/page/page.cpp", 1},  // index.html
        {"tools/measure/experiment/result_store.cpp", 1},      // results/
        {"tools/measure/experiment/experiment_input.cpp", 1},  // truth/
        {"tools/measure/study/study_folder.cpp", 1},           // tasks/, report files of a study
    };
    const Counts found = count(
        R"(\bAtomicFile::create\(|\batomic_write_text\(|\bwrite_(planes|deep)_exr\(|\bwrite_filtered\()"
        R"(|\bwrite_png_preview\(|\bio::write_picture\()");
    const Counts permits = count(R"(\bpermit\()");
    // Their callers ask.
    constexpr std::array kWriters = {"exr", "files", "frame", "image"};
    for (const auto& [file, times] : found) {
        const bool is_writer = std::ranges::any_of(kWriters, [&file = file](const char* folder) {
            return file.starts_with(std::string("tools/sequence/") + folder + "/");
        });
        if (is_writer) continue;
        const auto known = expected.find(file);
        ASSERT_NE(known, expected.end()) << file << " writes files and is not listed";
        EXPECT_EQ(times, known->second) << file;
        EXPECT_TRUE(permits.count(file)) << file << " does not use OutputFiles::permit()";
    }
    for (const auto& [file, times] : expected) EXPECT_TRUE(found.count(file)) << file;
}

// Before its first write, a job checks all of its files and then removes leftovers of killed jobs.
TEST(Writers, RemoveWhatKillsLeft) {
    Counts checks = count(R"(\bfiles(->|\.)check(_names)?\(\))");
    checks.erase("tools/service/work/frames_work.cpp");  // its run removes them
    const Counts removals = count(R"(\bremove_left_temporaries\(\);)");
    // run, ab and bench, study, scene, diff, selftest, sheet, blind, stress, tune, view and its
    // export, write() of Python
    EXPECT_EQ(checks.size(), 13u);
    for (const auto& [file, times] : checks) EXPECT_TRUE(removals.count(file)) << file;
}

// Only the one place, and the words of an option, may allow replacing a file.
TEST(Writers, OnlyOnePlaceSaysOverwrite) {
    const std::set<std::string> allowed = {
        "tools/sequence/files/atomic_file.cpp", "tools/sequence/files/output_files.cpp",
        "tools/apps/postchain/options.cpp", "tools/apps/view/save.cpp",
        // Its own report, continued after a crash.
        "tools/service/work/experiment_work.cpp",
        // Its own results, in a folder with the mark of a study.
        "tools/measure/study/work.cpp",
        // Its own chain file of a stopped walk, unless it was edited.
        "tools/apps/postchain/tune.cpp"};
    const auto met = matches_of(R"((^|[^=!] )\(?(io::)?OnExisting::overwrite)");
    for (const Match& one : met) EXPECT_TRUE(allowed.count(one.file)) << one.place;
    EXPECT_GE(met.size(), 2u);
}

TEST(Writers, FaultsAreSeen) {
    const std::regex ways(kWays);
    for (const char* code :
         {"std::ofstream file(path);", "FILE* f = fopen(path, \"w\");", "std::fstream both(path);",
          "::open(path, O_WRONLY | O_CREAT)", "fs::rename(a, b);",
          "Imf::TiledOutputFile out(path);", "auto out = OIIO::ImageOutput::create(path);",
          "fs::copy_file(a, b);", "std::remove(path);"})
        EXPECT_TRUE(std::regex_search(code, ways)) << code;
    for (const char* code :
         {"std::ifstream file(path);", "std::remove_if(a, b, c)", "::open(path, O_RDONLY)"})
        EXPECT_FALSE(std::regex_search(code, ways)) << code;
}

}  // namespace
}  // namespace postchain::writers_test

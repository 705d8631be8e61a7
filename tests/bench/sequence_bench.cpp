// Measures the whole command on a sequence against oiiotool reading and writing the same channels,
// and its peak memory on a long sequence against a short one. All results are ratios of runs in the
// same session.
//
//   two EXR frames -> 24 numbered copies -> { postchain run paper, oiiotool, ... } -> medians
//   a small frame  -> 1000 copies        -> peak memory of 1000 frames / of 10
//
// oiiotool is used in its best form: one process for all frames, with channels kept in their types
// (by default it writes every channel as float, which is slower and larger). The best of three
// forms is chosen by CPU time before the pairs are run. Deflate levels differ between zlib and
// libdeflate, so output sizes are printed beside the times.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/bench/arguments.h"

namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;
using postchain::bench::fail;

constexpr int kFrames = 24;
constexpr int kLongRun = 1000;
constexpr int kShortRun = 10;

struct Cost {
    double wall_s = 0;
    double cpu_s = 0;     // user and system, of all threads
    double peak_mib = 0;  // resident
    Cost operator+(const Cost& o) const {
        return {wall_s + o.wall_s, cpu_s + o.cpu_s, std::max(peak_mib, o.peak_mib)};
    }
};

// Runs a program to its end; its stdout is dropped.
Cost run(const Words& words) {
    std::vector<char*> arguments;
    for (const auto& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const auto start = std::chrono::steady_clock::now();
    const pid_t child = fork();
    if (child < 0) fail("fork failed");
    if (child == 0) {
        const int nowhere = open("/dev/null", O_WRONLY);
        if (nowhere < 0 || dup2(nowhere, STDOUT_FILENO) < 0) _exit(126);
        execvp(arguments[0], arguments.data());
        _exit(127);
    }
    int status = 0;
    rusage usage = {};
    if (wait4(child, &status, 0, &usage) != child) fail("wait4 failed");
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail(words[0] + " failed");
    const auto seconds = [](const timeval& t) {
        return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
    };
    Cost cost;
    cost.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    cost.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    cost.peak_mib = double(usage.ru_maxrss) / 1024;  // Linux counts KiB
    return cost;
}

std::string numbered(const fs::path& folder, const char* stem, int frame) {
    char name[64];
    std::snprintf(name, sizeof(name), "%s.%04d.exr", stem, frame);
    return (folder / name).string();
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

std::string spread(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    char text[64];
    std::snprintf(text, sizeof(text), "%.2f (%.2f-%.2f)", values[values.size() / 2], values.front(),
                  values.back());
    return text;
}

// Fills `folder` with frames 1.. as copies of `sources` in turn.
void fill(const fs::path& folder, const Words& sources, int frames) {
    fs::create_directories(folder);
    for (int i = 0; i < frames; ++i)
        fs::copy_file(sources[size_t(i) % sources.size()], numbered(folder, "in", i + 1));
}

// All files of this program; removed at exit, even by fail().
const fs::path& scratch_folder() {
    static const fs::path folder =
        fs::temp_directory_path() / ("postchain_bench_" + std::to_string(getpid()));
    return folder;
}

void remove_scratch_folder() {
    std::error_code ignored;
    fs::remove_all(scratch_folder(), ignored);
}

struct Setup {
    std::string command = POSTCHAIN_COMMAND;
    fs::path folder;
    Words sources;
    std::string camera;
    int pairs = 5;
    Words run_words;               // of postchain run, e.g. its compression
    std::string copy_level = "4";  // of oiiotool's ZIP; OpenEXR's default
};

Words render(const Setup& setup, const char* folder, const char* size, std::string* camera) {
    const fs::path scene = setup.folder / folder;
    fs::create_directories(scene);
    run({setup.command, "scene", "wheels", "-q", "-o", scene.string(), "--size", size, "--frames",
         "1-2"});
    *camera = (scene / "camera.json").string();
    return {numbered(scene, "sharp", 1), numbered(scene, "sharp", 2)};
}

Cost run_chain(const Setup& setup, const fs::path& in, const std::string& camera, int frames) {
    const fs::path out = setup.folder / "out";
    fs::create_directories(out);
    Words words = {setup.command,
                   "run",
                   "paper",
                   "-q",
                   "--on-existing",
                   "overwrite",
                   "--camera",
                   camera,
                   "--frames",
                   "1-" + std::to_string(frames),
                   "-i",
                   (in / "in.####.exr").string(),
                   "-o",
                   (out / "out.####.exr").string()};
    words.insert(words.end(), setup.run_words.begin(), setup.run_words.end());
    return run(words);
}

// `-d CHANNEL=half` for each half channel, with its full name as listed by oiiotool.
Words keep_types(const std::string& file) {
    Words words;
    const std::string ask = "oiiotool --info -v '" + file + "'";
    FILE* pipe = popen(ask.c_str(), "r");
    if (!pipe) fail("oiiotool is not installed (package openimageio-tools)");
    std::string text;
    for (int c; (c = std::fgetc(pipe)) != EOF;) text += char(c);
    if (pclose(pipe) != 0) fail("oiiotool cannot read " + file);
    const std::string key = "channel list: ";
    size_t at = text.find(key);
    if (at == std::string::npos) fail("oiiotool lists no channels of " + file);
    const std::string list = text.substr(at + key.size(), text.find('\n', at) - at - key.size());
    for (size_t begin = 0; begin < list.size();) {
        const size_t end = std::min(list.find(", ", begin), list.size());
        const std::string channel = list.substr(begin, end - begin);  // "R (half)"
        const size_t space = channel.find(" (half)");
        if (space != std::string::npos) {
            words.push_back("-d");
            words.push_back(channel.substr(0, space) + "=half");
        }
        begin = end + 2;
    }
    return words;
}

struct Copier {
    std::string name;
    bool one_process = true;
    Words types;
};

Cost run_copier(const Setup& setup, const Copier& copier, const fs::path& in) {
    const fs::path out = setup.folder / "copied";
    fs::create_directories(out);
    const auto words = [&](const std::string& from, const std::string& to, const Words& range) {
        Words all = {"oiiotool"};
        all.insert(all.end(), range.begin(), range.end());
        all.push_back(from);
        all.insert(all.end(), copier.types.begin(), copier.types.end());
        all.insert(all.end(), {"--compression", "zip:" + setup.copy_level, "-o", to});
        return all;
    };
    if (copier.one_process)
        return run(words((in / "in.%04d.exr").string(), (out / "out.%04d.exr").string(),
                         {"--frames", "1-" + std::to_string(kFrames)}));
    Cost sum;
    for (int i = 1; i <= kFrames; ++i)
        sum = sum + run(words(numbered(in, "in", i), numbered(out, "out", i), {}));
    return sum;
}

uint64_t bytes_in(const fs::path& folder) {
    uint64_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".exr") bytes += entry.file_size();
    return bytes;
}

// Time per stage of the chain, from the sidecars of the last run.
void print_stages(const Setup& setup) {
    std::map<std::string, std::vector<double>> times;
    Words order;
    const auto note = [&](const std::string& name, double ms) {
        if (!times.count(name)) order.push_back(name);
        times[name].push_back(ms);
    };
    for (int i = 2; i <= kFrames; ++i) {  // the first frame compiles shaders
        std::ifstream in(numbered(setup.folder / "out", "out", i) + ".json");
        const auto sidecar = nlohmann::json::parse(in);
        const auto& ms = sidecar.at("times_ms");
        for (const char* stage : {"read", "convert", "filter", "write"})
            note(stage, ms.at(stage).get<double>());
        for (const auto& pass : ms.at("passes"))
            note("  " + pass.at("name").get<std::string>(), pass.at("ms").get<double>());
    }
    std::printf(
        "\nmilliseconds of wall clock per frame, median of frames 2 to %d (stages of\n"
        "neighboring frames overlap and slow each other: the sum is more than a frame)\n",
        kFrames);
    for (const auto& name : order)
        std::printf("  %-20s %8.1f\n", name.c_str(), median(times[name]));
}

void compare_with_copy(const Setup& setup) {
    const fs::path in = setup.folder / "in";
    fill(in, setup.sources, kFrames);
    const Words types = keep_types(setup.sources[0]);
    const std::vector<Copier> copiers = {{"one process, all channels float", true, {}},
                                         {"one process, types kept", true, types},
                                         {"a process per frame, types kept", false, types}};
    std::printf("oiiotool, CPU seconds for %d frames:\n", kFrames);
    run_copier(setup, copiers[0], in);  // warms the file cache
    size_t best = 0;
    double least = 0;
    for (size_t i = 0; i < copiers.size(); ++i) {
        const double cpu = run_copier(setup, copiers[i], in).cpu_s;
        std::printf("  %-32s %7.2f\n", copiers[i].name.c_str(), cpu);
        if (i == 0 || cpu < least) {
            least = cpu;
            best = i;
        }
    }
    std::printf("chosen: %s\n\n", copiers[best].name.c_str());
    std::printf("%4s %10s %10s %8s %10s %10s %8s\n", "pair", "chain s", "copy s", "ratio",
                "chain CPU", "copy CPU", "ratio");
    std::vector<double> wall, cpu;
    for (int pair = 1; pair <= setup.pairs; ++pair) {
        const Cost chain = run_chain(setup, in, setup.camera, kFrames);
        const Cost copy = run_copier(setup, copiers[best], in);
        wall.push_back(chain.wall_s / copy.wall_s);
        cpu.push_back(chain.cpu_s / copy.cpu_s);
        std::printf("%4d %10.2f %10.2f %8.2f %10.2f %10.2f %8.2f\n", pair, chain.wall_s,
                    copy.wall_s, wall.back(), chain.cpu_s, copy.cpu_s, cpu.back());
        std::fflush(stdout);
    }
    std::printf("chain over copy, median (range): wall clock %s, CPU %s; bytes written %.2f\n",
                spread(wall).c_str(), spread(cpu).c_str(),
                double(bytes_in(setup.folder / "out")) / double(bytes_in(setup.folder / "copied")));
    print_stages(setup);
}

void compare_memory(const Setup& setup) {
    std::string camera;
    const Words sources = render(setup, "small", "96x54", &camera);
    const fs::path in = setup.folder / "small_in";
    fill(in, sources, kLongRun);
    const double shorter = run_chain(setup, in, camera, kShortRun).peak_mib;
    const double longer = run_chain(setup, in, camera, kLongRun).peak_mib;
    std::printf("\npeak memory: %.1f MiB over %d frames of 96x54, %.1f MiB over %d: ratio %.3f\n",
                shorter, kShortRun, longer, kLongRun, longer / shorter);
}

}  // namespace

int main(int argc, char** argv) {
    Setup setup;
    const char* usage =
        "sequence_bench [--pairs N] [--command POSTCHAIN] [--run WORD]... [--copy-level N] "
        "[A.exr B.exr --camera FILE]";
    postchain::bench::Arguments arguments(argc, argv, usage);
    setup.pairs = arguments.count("--pairs", setup.pairs);
    setup.command = arguments.text("--command").value_or(setup.command);
    setup.run_words = arguments.texts("--run");
    setup.copy_level = arguments.text("--copy-level").value_or(setup.copy_level);
    setup.camera = arguments.text("--camera").value_or("");
    const Words files = arguments.words();
    if (!files.empty() && (files.size() != 2 || setup.camera.empty()))
        fail(std::string("give two files and a camera: ") + usage, 2);
    setup.folder = scratch_folder();
    std::atexit(remove_scratch_folder);
    try {
        setup.sources = files.empty() ? render(setup, "scene", "1280x720", &setup.camera) : files;
        compare_with_copy(setup);
        compare_memory(setup);
    } catch (const std::exception& e) {  // from std::filesystem and JSON
        fail(e.what());
    }
    return 0;
}

// postchain selftest: checks that this build renders correct images on this machine and device.
//
//   each pass of the registry, and both orders, over the reduced stability matrix (fp32)
//     --> against the double-precision reference; bit-identical when repeated and without elision
//   a frame of random values --> an EXR in a new folder --> read back, bit for bit
#include "tools/apps/postchain/subcommands.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/stress/subjects.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;
using io::Json;

constexpr const char* kFilesTest = "write and read";

using stress::TestRow;

double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

// Floats of every magnitude, the same on each machine.
ImageF frame_of_values() {
    ImageF image(67, 43, 4);
    uint64_t state = 1;
    for (float& value : image.data) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        const double part = double(state >> 40) / double(1 << 24);
        value = float((part - 0.25) * std::pow(10.0, double(state >> 33 & 15) - 8));
    }
    return image;
}

Status write_and_read(const std::string& path) {
    const ImageF image = frame_of_values();
    io::OutputFiles files(io::OnExisting::fail);
    files.write(io::OutputFile{path, "the file of the test", ""});
    RETURN_IF_ERROR(files.check());
    files.remove_left_temporaries();
    ASSIGN_OR_RETURN(const auto permit, files.permit(path));
    ASSIGN_OR_RETURN(auto written, io::write_planes_exr(path, image, {"R", "G", "B", "A"}, permit));
    const sequence::SourceSettings settings;
    ASSIGN_OR_RETURN(auto header, sequence::open_source_frame(settings, {{Role::color, path}}, 1));
    ASSIGN_OR_RETURN(auto frame, sequence::read_source_frame(settings, std::move(header), {},
                                                             io::Keep::nothing));
    const ImageF& read = *frame.planes.at(Role::color);
    if (read.width != image.width || read.height != image.height || read.channels != 4)
        return Status(StatusCode::output, path + ": has a different size when read back");
    size_t different = 0;
    for (size_t i = 0; i < image.data.size(); ++i)
        different += std::memcmp(&read.data[i], &image.data[i], sizeof(float)) != 0;
    if (!different) return Status();
    return Status(StatusCode::output, concat(path, ": ", different, " of ", image.data.size(),
                                             " values differ from those written"));
}

TestRow test_files() {
    TestRow row;
    row.name = kFilesTest;
    const double start = now_s();
    std::error_code error;
    std::string folder = (fs::temp_directory_path(error) / "postchain-selftest-XXXXXX").string();
    if (error || !mkdtemp(folder.data())) {
        row.faults.push_back("cannot create a temporary folder: " +
                             (error ? error.message() : std::string(std::strerror(errno))));
        return row;
    }
    const Status status = write_and_read(folder + "/values.0001.exr");
    if (!status.ok()) row.faults.push_back(status.message());
    fs::remove_all(folder, error);
    row.frames = 1;
    row.seconds = now_s() - start;
    return row;
}

Json json_of(const std::vector<TestRow>& rows, const gl::Device& device) {
    Json tests = Json::array();
    for (const TestRow& row : rows) {
        Json test = {{"test", row.name},
                     {"ok", row.faults.empty()},
                     {"frames", row.frames},
                     {"seconds", row.seconds},
                     {"faults", row.faults}};
        if (row.bound > 0) {
            test["reference"] = row.reference;
            test["bound"] = row.bound;
        }
        tests.push_back(std::move(test));
    }
    return {{"postchain_selftest", 1},
            {"version", kVersion},
            {"renderer", sequence::renderer_text(device)},
            {"vendor", device.vendor},
            {"software", device.software},
            {"tests", std::move(tests)}};
}

// `only`: pattern for test names, as in stress::matches(). Returns kExitHealth, after the table, if
// a test fails.
Result<int> selftest_subcommand(const Options& options, const std::string& only) {
    ASSIGN_OR_RETURN(auto all, stress::every_subject(builtin_passes()));
    std::erase_if(all, [&](const auto& one) { return !stress::matches(only, one.name); });
    const bool with_files = stress::matches(only, kFilesTest);
    if (all.empty() && !with_files)
        return Status(StatusCode::usage, "--only: no test name matches '" + only + "'");
    ASSIGN_OR_RETURN(auto context, context_of(options));
    const gl::Device& device = context->device();
    const StopOnSignal stop;
    if (!options.json) {
        std::printf("postchain %s on %s%s\n", kVersion, sequence::renderer_text(device).c_str(),
                    device.software ? " (software)" : "");
        stress::print_heads();
    }
    std::vector<TestRow> rows;
    bool failed = false;
    const auto add = [&](TestRow row) {
        log::progress("");
        failed |= !row.faults.empty();
        if (!options.json) stress::print_row(row);
        std::fflush(stdout);
        rows.push_back(std::move(row));
    };
    for (auto& subject : all) {
        // A new executor, so that tests do not share device state.
        Executor executor(device);
        const std::string name = subject.name;
        TestRow row = stress::test_subject(
            executor, std::move(subject), [&](const std::string& cell, size_t done, size_t of) {
                log::progress(concat(name, ", ", done, " of ", of, ", ", cell));
                return !stop.asked();
            });
        if (stop.asked()) return stop.interrupted("run the same command again");
        add(std::move(row));
    }
    if (with_files) add(test_files());
    if (options.json) {
        print_line(json_of(rows, device));
    } else if (failed) {
        std::printf(
            "FAILED: images from this device are not reliable; another device (--device software) "
            "or another driver may pass\n");
    } else {
        std::printf(
            "passed: each image matches the reference within the bound, and is bit-identical "
            "when repeated and with nothing left out\n");
    }
    return failed ? kExitHealth : kExitOk;
}

}  // namespace

RunSubcommand add_selftest(CLI::App& subcommand, Options& options) {
    const auto only = std::make_shared<std::string>();
    subcommand
        .add_option("--only", *only,
                    "only tests whose name contains this; * matches any characters")
        ->type_name("PATTERN");
    subcommand.add_flag("--json", options.json, "one JSON object");
    add_device(subcommand, options);
    return [&options, only] { return selftest_subcommand(options, *only); };
}

}  // namespace postchain

// postchain-preview: the processes in which the service reads files of clients for an image or a
// preview. What a damaged file does to one costs a request. work/job_files.h and work/previews.h
// start them and document what they say.
#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "chain/base/readable_file.h"
#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/pass/planner.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/apps/common/confine.h"
#include "tools/apps/common/options.h"
#include "tools/page/encode.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/memory.h"
#include "tools/sequence/source/reduced_frame.h"
#include "tools/sequence/source/reduced_lengths.h"
#include "tools/sequence/source/sequence_reader.h"
#include "tools/sequence/source/sequence_survey.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/previews.h"

namespace postchain::service {
namespace {

using io::Json;

constexpr int kKeptBytes = 1 << 29;
constexpr int kStrips = 4;  // at a time: color is a fraction of what strip_rows() expects
// A pixel of an image in a reply: its color, half floats, and both packed, here and in the service.
constexpr uint64_t kShownBytes = 4 * sizeof(float) + 3 * 3 * sizeof(uint16_t);

bool send_all(std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const ssize_t got = ::write(STDOUT_FILENO, text.data() + at, text.size() - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += size_t(got);
    }
    return true;
}

std::string message_of(char type, const std::string& bytes) {
    const uint64_t length = bytes.size();
    std::string message(kMessageHead, type);
    std::memcpy(message.data() + 1, &length, sizeof(length));
    return message + bytes;
}

// The service's lines. The process ends with its input.
class Inbox {
  public:
    // The next line that is not kStop.
    std::string task() {
        for (;;) {
            while (lines_.empty()) read(-1);
            const std::string line = std::move(lines_.front());
            lines_.pop_front();
            if (line != kStop) return line;
        }
    }
    // Whether the last task is no longer wanted.
    bool stopped() {
        read(0);
        return std::ranges::count(lines_, kStop) > 0;
    }

  private:
    void read(int patience_ms) {
        pollfd ready = {STDIN_FILENO, POLLIN, 0};
        if (::poll(&ready, 1, patience_ms) <= 0) return;
        std::array<char, 65536> part;
        const ssize_t got = ::read(STDIN_FILENO, part.data(), part.size());
        if (got == 0 || (got < 0 && errno != EINTR)) _exit(0);
        for (const char c : std::string_view(part.data(), size_t(std::max<ssize_t>(got, 0)))) {
            if (c == '\n')
                lines_.push_back(std::exchange(line_, ""));
            else
                line_ += c;
        }
    }

    std::deque<std::string> lines_;
    std::string line_;  // that has no end yet
};

// Reads these folders, and keeps compiled programs where the service says.
Status confine_to_reading(const std::vector<std::string>& folders) {
    Confinement to{folders, {}, devices_of_system()};
    if (const char* programs = std::getenv("MESA_SHADER_CACHE_DIR"))
        to.writes.emplace_back(programs);
    confine_files(folders);
    return confine(to);
}

Json json_of(const Status& status) {
    return {{"code", int(status.code())}, {"message", status.message()}};
}

// Errors of a chain, for Programs' places in a body.
Json json_of(const Diagnostics& faults) {
    Json list = Json::array();
    for (const Diagnostic& one : faults)
        if (one.severity == Severity::error)
            list.push_back({{"file", one.file},
                            {"line", one.line},
                            {"column", one.column},
                            {"path", one.path},
                            {"message", one.message}});
    return {{"faults", list}};
}

// ----------------------------------------------------------------------------------------- words
// The settings of words like those of `plan` and `run`; others are ignored.
struct Words {
    explicit Words(const std::vector<std::string>& words) {
        CLI::App app;
        app.allow_extras();
        add_list(app, "--set", "KEY=VALUE", options.sets, "");
        for (const char* group : {sequence::kInputGroup, sequence::kPlanGroup})
            add_settings(app, job_parameters(), group, &options.job);
        // A file that no job names has no settings.
        for (CLI::Option* option : app.get_options()) option->required(false);
        std::vector<std::string> reversed(words.rbegin(), words.rend());
        app.parse(reversed);
    }
    Result<sequence::RunSettings> settings() const {
        Diagnostics notes;
        return sequence::parse_job(options.job, builtin_passes(), notes);
    }
    Options options;
};

// ----------------------------------------------------------------------------------------- images

// A PNG, an EXR, or the values for a page (kPictureType).
Result<std::string> bytes_of(const ImageF& color, const std::string& type) {
    if (type == page::kPictureType) return page::picture_file(color);
    if (type == kExrType) return io::planes_exr_bytes(color, {"R", "G", "B", "A"});
    return io::encode_png_preview(color);
}

// The color of a file, at most `side` pixels wide and high. Errors: (input), (output); (memory):
// over settings.max_memory.
Result<std::string> image_of(const std::string& path, int frame, int side, const std::string& type,
                             const sequence::SourceSettings& settings) {
    ASSIGN_OR_RETURN(auto header,
                     sequence::open_source_frame(settings, {{Role::color, path}}, frame));
    const int width = header.window.width(), height = header.window.height();
    const double scale = std::min(1.0, double(side) / std::max(width, height));
    const int shown_width = sequence::reduced_side(width, scale);
    const int shown_height = sequence::reduced_side(height, scale);
    const auto bytes_of_rows = [&](int rows) {
        return sequence::frame_bytes(header, {Role::color}, io::Keep::nothing, rows) +
               kShownBytes * uint64_t(shown_width) * uint64_t(shown_height);
    };
    // Larger frames are read in strips.
    const bool in_strips = scale < 1 && bytes_of_rows(height) > settings.max_memory;
    const int rows = in_strips ? std::min(height, kStrips * sequence::strip_rows(header)) : height;
    const uint64_t bytes = bytes_of_rows(rows);
    if (bytes > settings.max_memory && settings.max_memory > 0)
        return Status(StatusCode::memory, concat(path, ": needs ", sequence::bytes_text(bytes),
                                                 " of memory; images of this service may need ",
                                                 sequence::bytes_text(settings.max_memory),
                                                 "; request a smaller side, or render smaller"));
    if (scale == 1) {
        ASSIGN_OR_RETURN(auto source, sequence::read_source_frame(settings, std::move(header), {},
                                                                  io::Keep::nothing));
        return bytes_of(*source.planes.at(Role::color), type);
    }
    std::optional<io::RowShrinker> small;
    RETURN_IF_ERROR(
        sequence::scan_source_frame(settings, header, rows, [&](const FramePlanes& planes, int) {
            const ImageF& color = planes.at(Role::color);
            if (!small) small.emplace(width, height, color.channels, shown_width, shown_height);
            small->add(color);
        }).status());
    return bytes_of(small->image(), type);
}

Result<std::string> image_of_task(const Json& task) {
    const std::string path = task.at("path");
    // Loaded from wherever the program finds it.
    if (io::image_format_of(path)) (void)io::image_module(StatusCode::input);
    RETURN_IF_ERROR(confine_to_reading(task.at("folders").get<std::vector<std::string>>()));
    const Words words(task.at("words").get<std::vector<std::string>>());
    sequence::SourceSettings source;
    if (!words.options.job.input.empty()) {
        ASSIGN_OR_RETURN(const auto settings, words.settings());
        source = settings.source;
    }
    source.max_memory = task.at("memory");
    return image_of(path, task.at("frame"), task.at("side"), task.at("type"), source);
}

int run_image_process() {
    // The buffers of each strip are those of the one before.
    mallopt(M_MMAP_THRESHOLD, kKeptBytes);
    mallopt(M_TRIM_THRESHOLD, kKeptBytes);
    const auto image = []() -> Result<std::string> {
        try {
            return image_of_task(Json::parse(Inbox().task()));
        } catch (...) {
            return status_of_exception("the image");
        }
    }();
    (void)send_all(image.ok() ? *image : io::json_text(json_of(image.status())));
    // Nothing that a damaged file has left behind is run any more.
    _exit(image.ok() ? 0 : 1);
}

// --------------------------------------------------------------------------------------- previews
struct PreviewRequest {
    Chain chain;
    sequence::RunSettings run;
    int frame = 0;
    double scale = 1;  // of the frame's width and height, at most 1
};

// The frame that a request names, and the settings to read it.
struct NamedFrame {
    sequence::RunSettings settings;
    std::map<Role, std::string> files;
};
Result<NamedFrame> named_frame(const PreviewRequest& request, sequence::RunSettings settings) {
    settings.frames = io::FrameRange{{request.frame}};
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
    const auto files = list.files.find(request.frame);
    if (files == list.files.end()) return sequence::absent_frame(request.frame, settings);
    return NamedFrame{std::move(settings), files->second};
}

struct PreparedPreview {
    Plan plan;
    SharedPlanes planes;
};

// Reads the request's frame with its neighbors and the chain's mattes, and reduces it: color and
// mattes by mean, depth and motion vectors by center pixel. Scales motion vectors and the passes'
// lengths in pixels. Errors: those of reading and planning.
Result<PreparedPreview> prepare_preview(PreviewRequest& request) {
    Chain& chain = request.chain;
    ASSIGN_OR_RETURN(const auto named,
                     named_frame(request, sequence::settings_for(request.run, {&chain})));
    const sequence::RunSettings& settings = named.settings;
    sequence::SequenceReader reader(
        settings.source, settings.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.source, header, settings.plan);
        });
    ASSIGN_OR_RETURN(auto opened, reader.open(request.frame, named.files));
    ASSIGN_OR_RETURN(auto source, reader.read(opened));
    source.description.frame_number = request.frame;
    if (request.scale < 1) {
        sequence::reduce_frame(source, request.scale);
        sequence::reduce_lengths(chain, request.scale);
    }
    ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, source, settings.plan));
    return PreparedPreview{std::move(plan), std::move(source.planes)};
}

// Makes previews, on one thread: its context is current there.
class PreviewMaker {
  public:
    explicit PreviewMaker(Inbox& inbox) : inbox_(inbox) {}

    Status begin(const std::string& line) try {
        const Json settings = Json::parse(line);
        memory_ = settings.at("memory");
        RETURN_IF_ERROR(confine_to_reading(settings.at("folders").get<std::vector<std::string>>()));
        ASSIGN_OR_RETURN(device_, sequence::choose_device(settings.at("device"),
                                                          settings.at("threads").get<int>()));
        return Status();
    } catch (...) {
        return status_of_exception("the process for previews");
    }

    // The reply to a task.
    std::string answer(const Json& task) {
        faults_.clear();
        const auto made = task.contains("test") ? test() : preview(task);
        if (made.ok()) return message_of(kDone, *made);
        return message_of(kFailed, io::json_text(has_errors(faults_) ? json_of(faults_)
                                                                     : json_of(made.status())));
    }

  private:
    // The renderer. Makes the device if there is none, and filters a small image with a known
    // result; after a fault of it with a new device. Errors (gl).
    Result<std::string> test() {
        if (!executor_ || !run_test().ok()) {
            // After a loss of the context a new one may work.
            const Status made = make_device();
            if (!made.ok()) executor_.reset();
            RETURN_IF_ERROR(made);
        }
        return sequence::renderer_text(context_->device());
    }

    Result<std::string> preview(const Json& task) {
        // A user's folders are fewer than those that the process may open.
        confine_files(task.at("folders").get<std::vector<std::string>>());
        const std::string folder = task.at("start");
        std::filesystem::current_path(folder);
        const Words words(task.at("words").get<std::vector<std::string>>());
        ChainText text;
        if (task.contains("chain")) {
            ASSIGN_OR_RETURN(text, find_chain(task.at("chain")));
        } else {
            text.file_name = concat(folder, "/", task.at("chain_name").get<std::string>());
            text.text = task.at("chain_text");
        }
        ChainFile chain = parse_chain(text, builtin_passes(), words.options.sets);
        faults_ = chain.diagnostics;
        RETURN_IF_ERROR(chain.status());
        io::ApertureFiles images;
        RETURN_IF_ERROR(images.read(chain.chain.camera).at("camera.aperture_image"));
        ASSIGN_OR_RETURN(auto settings, words.settings());
        if (memory_ > 0 &&
            (settings.source.max_memory == 0 || settings.source.max_memory > memory_))
            settings.source.max_memory = memory_;
        PreviewRequest request{std::move(chain.chain), std::move(settings), task.at("frame"),
                               task.at("scale")};
        ASSIGN_OR_RETURN(const auto image, filter(request));
        return bytes_of(image, task.at("type"));
    }

    Result<ImageF> filter(PreviewRequest& request) {
        const Status canceled(StatusCode::canceled, "the preview was canceled");
        if (inbox_.stopped()) return canceled;
        if (!executor_) RETURN_IF_ERROR(make_device());
        request.run.plan.device = executor_->device_class();
        ASSIGN_OR_RETURN(auto prepared, prepare_preview(request));
        if (inbox_.stopped()) return canceled;
        const ContinueScope stop(
            *executor_, [&] { return inbox_.stopped() ? RunDecision::stop : RunDecision::go_on; });
        ASSIGN_OR_RETURN(auto planes, executor_->filter(prepared.plan, prepared.planes));
        return std::move(planes.at(Role::color));
    }

    Status make_device() try {
        executor_.reset();
        ASSIGN_OR_RETURN(context_, egl::Context::create(device_));
        executor_ = std::make_unique<Executor>(context_->device());
        return run_test();
    } catch (...) {
        return status_of_exception("the GL context");
    }

    Status run_test() try {
        constexpr int kSide = 16;
        constexpr float kValue = 0.25f;
        Chain chain;
        if (!chain.append(builtin_passes(), "fxaa")) return Status();
        FrameDescription frame;
        frame.width = frame.height = frame.display_width = frame.display_height = kSide;
        frame.planes = {Role::color};
        PlanOptions options;
        options.elide = false;
        options.device = executor_->device_class();
        ASSIGN_OR_RETURN(auto plan, make_plan(chain, frame, options));
        FramePlanes planes;
        planes.emplace(Role::color, ImageF(kSide, kSide, 4, kValue));
        ASSIGN_OR_RETURN(auto result, executor_->filter(plan, planes));
        // An anti-aliasing filter keeps a uniform image.
        for (const float value : result.at(Role::color).data)
            if (!(std::abs(value - kValue) < 1e-3f))
                return Status(StatusCode::gl,
                              concat("a test dispatch returned ", value, " instead of ", kValue,
                                     "; the device is not reliable"));
        return Status();
    } catch (...) {
        return status_of_exception("the test of the GL device");
    }

    Inbox& inbox_;
    egl::ContextOptions device_;
    uint64_t memory_ = 0;
    Diagnostics faults_;  // of the last task's chain
    std::unique_ptr<egl::Context> context_;
    std::unique_ptr<Executor> executor_;  // destroyed before its context
};

int run_preview_process() {
    Inbox inbox;
    PreviewMaker maker(inbox);
    const Status begun = maker.begin(inbox.task());
    for (;;) {
        const std::string task = inbox.task();
        std::string reply;
        try {
            reply = begun.ok() ? maker.answer(Json::parse(task))
                               : message_of(kFailed, io::json_text(json_of(begun)));
        } catch (...) {
            reply = message_of(kFailed, io::json_text(json_of(status_of_exception("the preview"))));
        }
        if (!send_all(reply)) _exit(1);
    }
}

}  // namespace
}  // namespace postchain::service

int main(int argc, char** argv) {
    using namespace postchain::service;
    const std::string_view word = argc == 2 ? argv[1] : "";
    if (word == kImageWord) return run_image_process();
    if (word == kPreviewWord) return run_preview_process();
    std::fputs("postchain-preview: postchain-serve starts this program\n", stderr);
    return 2;
}

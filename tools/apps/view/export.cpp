#include "tools/apps/view/export.h"

#include <cmath>

#include "chain/gl/executor.h"
#include "tools/apps/view/frame_store.h"
#include "tools/apps/view/messages.h"
#include "tools/apps/view/movie.h"
#include "tools/apps/view/save.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/png.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/run/run_sequence.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::view {
namespace {

constexpr int kThumbnailWidth = 320;
constexpr size_t kMaxCells = 48;

Status stopped(const ExportJob& job) {
    return Status(StatusCode::canceled, job.path + ": stopped");
}

// Filters single frames as the viewer does.
class FrameFilter {
  public:
    FrameFilter(const ExportJob& job, Executor& executor) : job_(job), executor_(executor) {}

    Result<Image<uint8_t>> shown(int number, const io::PreviewOptions& options,
                                 const std::function<ImageF(const ImageF&)>& change = {}) {
        ASSIGN_OR_RETURN(auto color, filtered(number));
        return io::shown_image(change ? change(color) : color, options);
    }

  private:
    Result<ImageF> filtered(int number) {
        const Chain& chain = *job_.chains.at(number);
        sequence::RunSettings settings = sequence::settings_for(job_.run, {&chain});
        settings.plan.device = executor_.device_class();
        ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, io::FrameRange{{number}}));
        const auto files = list.files.find(number);
        if (files == list.files.end()) return sequence::absent_frame(number, settings);
        sequence::SequenceReader reader(
            settings.source, settings.input, [&](const sequence::FrameHeader& header) {
                return sequence::planes_needed(chain, settings.source, header, settings.plan);
            });
        ASSIGN_OR_RETURN(auto opened, reader.open(number, files->second));
        ASSIGN_OR_RETURN(auto source, reader.read(opened));
        source.description.frame_number = number;
        ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, source, settings.plan));
        ASSIGN_OR_RETURN(auto planes, executor_.filter(plan, source.planes));
        return std::move(planes.at(Role::color));
    }

    const ExportJob& job_;
    Executor& executor_;
};

Status write_frames(const ExportJob& job, Executor& executor, const std::string& renderer,
                    const std::atomic<bool>& stop, const std::function<void(int)>& progress) {
    ASSIGN_OR_RETURN(auto output, io::PathPattern::parse(job.path));
    sequence::RunSettings settings = job.run;
    settings.output = std::move(output);
    settings.on_existing = on_existing(job.replace);
    settings.watch.reset();
    // No frame is written if one cannot be.
    settings.frames = io::FrameRange{job.frames};
    std::vector<int> gaps;
    ASSIGN_OR_RETURN(const auto tasks, sequence::plan_tasks(settings, true, gaps));
    const io::OutputFiles files =
        sequence::files_of_run(*job.chains.at(job.frames[0]), settings, tasks);
    RETURN_IF_ERROR(files.check());
    files.remove_left_temporaries();
    int done = 0;
    for (const int frame : job.frames) {
        settings.frames = io::FrameRange{{frame}};
        Status failed;
        const auto summary =
            sequence::run_sequence(*job.chains.at(frame), settings, executor, renderer,
                                   {[&](const sequence::FrameReport& report,
                                        const sequence::RunProgress&) { failed = report.status; },
                                    &stop});
        if (!summary.ok()) return summary.status();
        if (!failed.ok()) return failed;
        if (stop) return stopped(job);
        progress(++done);
    }
    return Status();
}

Status write_sheet(const ExportJob& job, FrameFilter& filter, const std::atomic<bool>& stop,
                   const std::function<void(int)>& progress) {
    const auto chosen = io::evenly_chosen(job.frames.size(), kMaxCells);
    io::SheetLayout layout;
    std::optional<io::ContactSheet> sheet;
    const auto shrink = [&](const ImageF& color) {
        const double scale = std::min(1.0, double(kThumbnailWidth) / color.width);
        return io::shrunk(color, std::max(1, int(std::lround(color.width * scale))),
                          std::max(1, int(std::lround(color.height * scale))));
    };
    for (size_t i = 0; i < chosen.size(); ++i) {
        if (stop) return stopped(job);
        const int frame = job.frames[chosen[i]];
        ASSIGN_OR_RETURN(const auto shown, filter.shown(frame, job.display, shrink));
        if (!sheet) {
            layout.cells = int(chosen.size());
            layout.columns = std::max(1, int(std::ceil(std::sqrt(double(chosen.size())))));
            layout.width = shown.width;
            layout.height = shown.height;
            sheet.emplace(layout);
        }
        if (shown.width <= layout.width && shown.height <= layout.height)
            sheet->put(int(i), 0, shown);
        else
            sheet->say(int(i), 0, "another size");
        sheet->label(int(i), concat(frame));
        progress(int(i) + 1);
    }
    sheet->footer(concat(chosen.size(), " of ", job.frames.size(), " frames"));
    ASSIGN_OR_RETURN(const auto png, io::encode_png(sheet->picture()).at(job.path));
    return save_text(job.run, job.path, png, "the contact sheet", job.replace);
}

Status write_movie(const ExportJob& job, FrameFilter& filter, const std::atomic<bool>& stop,
                   const std::function<void(int)>& progress) {
    ASSIGN_OR_RETURN(auto made, new_file(job.run, job.path, "the movie", job.replace));
    std::unique_ptr<Movie> movie;
    int done = 0;
    for (const int frame : job.frames) {
        if (stop) return stopped(job);
        ASSIGN_OR_RETURN(const auto shown, filter.shown(frame, job.display));
        if (!movie) {
            ASSIGN_OR_RETURN(movie,
                             Movie::open(std::move(made.file), shown.width, shown.height, job.fps));
        }
        RETURN_IF_ERROR(movie->add(shown));
        progress(++done);
    }
    return movie->finish(made.on_existing);
}

}  // namespace

Status run_export(const ExportJob& job, const std::atomic<bool>& stop,
                  const std::function<void(int done)>& progress) try {
    if (job.frames.empty()) return Status(StatusCode::usage, "there is no frame to write");
    ASSIGN_OR_RETURN(auto context, egl::Context::create(job.context));
    Executor executor(context->device());
    const StopScope stops(executor, &stop);
    if (job.kind == ExportKind::frames)
        return write_frames(job, executor, sequence::renderer_text(context->device()), stop,
                            progress);
    FrameFilter filter(job, executor);
    if (job.kind == ExportKind::sheet) return write_sheet(job, filter, stop, progress);
    if (job.kind == ExportKind::movie) return write_movie(job, filter, stop, progress);
    ASSIGN_OR_RETURN(const auto shown, filter.shown(job.frames[0], job.display));
    ASSIGN_OR_RETURN(const auto png, io::encode_png(shown).at(job.path));
    return save_text(job.run, job.path, png, "the image", job.replace);
} catch (...) {
    return status_of_exception(job.path);
}

Exporter::~Exporter() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
}

void Exporter::report(const std::function<void(ExportState&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(state_);
    }
    wake_();
}

ExportState Exporter::state() const {
    const std::lock_guard lock(mutex_);
    return state_;
}

bool Exporter::start(ExportJob job) {
    if (state().running) return false;
    if (thread_.joinable()) thread_.join();
    stop_ = false;
    state_ = {.running = true, .total = int(job.frames.size()), .text = job.path};
    thread_ = std::thread([this, job = std::move(job)] {
        give_way();
        const Status status = run_export(job, stop_, [this](int done) {
            report([&](ExportState& state) { state.done = done; });
        });
        report([&](ExportState& state) {
            state.running = false;
            state.failed = !status.ok();
            state.text =
                status.ok() ? job.path + ": written" : in_words_of_window(status.message());
        });
    });
    return true;
}

}  // namespace postchain::view

// Writes frames through the chain on a thread and GL context of its own, while the viewer goes on.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "chain/egl/context.h"
#include "chain/pass/chain.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::view {

enum class ExportKind {
    frames,  // files as `postchain run` writes them
    png,     // the first frame as it is shown
    sheet,   // a PNG with thumbnails of all frames
    movie,   // an MP4 by the command ffmpeg, frames as they are shown
};

struct ExportJob {
    ExportKind kind = ExportKind::frames;
    std::string path;  // of frames: a pattern
    bool replace = false;
    std::vector<int> frames;
    std::map<int, std::shared_ptr<const Chain>> chains;  // by frame
    sequence::RunSettings run;
    io::PreviewOptions display;  // of png, sheet and movie
    double fps = 24;
    egl::ContextOptions context;
};

struct ExportState {
    bool running = false;
    int done = 0, total = 0;
    std::string text;  // the outcome, or what is written
    bool failed = false;
};

class Exporter {
  public:
    explicit Exporter(std::function<void()> wake) : wake_(std::move(wake)) {}
    ~Exporter();
    Exporter(const Exporter&) = delete;
    Exporter& operator=(const Exporter&) = delete;

    // False if one is running.
    bool start(ExportJob job);
    void cancel() { stop_ = true; }
    ExportState state() const;

  private:
    void report(const std::function<void(ExportState&)>& change);

    const std::function<void()> wake_;
    std::atomic<bool> stop_ = false;
    mutable std::mutex mutex_;
    ExportState state_;
    std::thread thread_;
};

// Runs the job on this thread. `progress`: frames done. Errors: those of run_sequence() and of
// reading and writing; (output): ffmpeg is not installed or fails.
Status run_export(const ExportJob& job, const std::atomic<bool>& stop,
                  const std::function<void(int done)>& progress);

}  // namespace postchain::view

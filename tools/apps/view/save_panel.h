// Files that are saved.
#pragma once

#include <functional>
#include <string>

#include "tools/apps/view/export.h"
#include "tools/apps/view/file_dialog.h"
#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class SavePanel {
  public:
    SavePanel(UiContext& ui, FileDialog& dialog, std::function<void()> wake);
    void draw();
    bool save_chain();  // false: it failed, and the message is shown
    bool save_keys();   // into the camera file; false: as above
    const std::string& chain_path() const { return chain_path_; }
    const std::string& camera_path() const { return camera_path_; }
    const Exporter& exporter() const { return exporter_; }

  private:
    void save_button(const char* name, const char* label, std::string& path, FileKind kind,
                     const char* hint, const std::function<void(const std::string&)>& save);
    void start_export(ExportKind kind, const std::string& path);

    UiContext& ui_;
    FileDialog& dialog_;
    Exporter exporter_;
    std::string chain_path_, camera_path_ = "camera.json", frames_path_ = "filtered.####.exr",
                             png_path_ = "frame.png", sheet_path_ = "sheet.png",
                             movie_path_ = "movie.mp4";
    bool replace_ = false;
};

}  // namespace postchain::view

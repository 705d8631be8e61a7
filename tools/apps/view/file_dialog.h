// A list of files to choose one from, to open it or to save into it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/apps/view/files.h"
#include "tools/apps/view/ui_context.h"

namespace postchain::view {

class FileDialog {
  public:
    explicit FileDialog(UiContext& ui) : ui_(ui) {}

    // Shows the list of the path's folder; `done` gets the path that is chosen.
    void ask(FileKind kind, bool saves, const std::string& path,
             std::function<void(const std::string&)> done);
    bool is_open() const { return open_; }
    void draw();

  private:
    void enter(const std::string& folder);
    void choose();

    UiContext& ui_;
    bool open_ = false, saves_ = false, focus_ = false;
    FileKind kind_ = FileKind::chain;
    std::string folder_, typed_folder_, name_, trouble_;
    std::vector<FileRow> rows_;
    std::function<void(const std::string&)> done_;
};

}  // namespace postchain::view

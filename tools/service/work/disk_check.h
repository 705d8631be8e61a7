// Whether folders can be written. A disk that does not answer holds up its own thread only.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace postchain::service {

// Why files cannot be written to a folder; empty = they can.
std::string trouble_of_folder(const std::string& folder);

class DiskCheck {
  public:
    explicit DiskCheck(
        std::vector<std::string> folders,
        std::function<std::string(const std::string& folder)> trouble_of = trouble_of_folder);

    // The faults of the folders; empty = none. Waits a second for a new result; later it says which
    // folder does not answer.
    std::string fault();

  private:
    struct Inside;
    std::shared_ptr<Inside> inside_;  // also of the thread, which may end later
};

}  // namespace postchain::service

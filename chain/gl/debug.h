// GL's error flag, and labels for GL debuggers.
#pragma once

#include <string>

#include "chain/base/status.h"

namespace postchain::gl {

// The GL error flag as a Status, and cleared: out of memory is named as such. The flag is shared
// with the host, and reading it may wait for the driver.
Status check_error(const std::string& doing);
void forget_errors();

// Groups the GL calls of a scope in debuggers (KHR_debug), unless the host's own groups leave no
// room for one.
class DebugGroup {
  public:
    explicit DebugGroup(const std::string& label);
    ~DebugGroup();
    DebugGroup(const DebugGroup&) = delete;
    DebugGroup& operator=(const DebugGroup&) = delete;

  private:
    bool pushed_ = false;
};
// `kind`: GL_TEXTURE, GL_BUFFER or GL_PROGRAM.
void label(unsigned kind, unsigned name, const std::string& label);

}  // namespace postchain::gl

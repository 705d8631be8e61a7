// A point in the commands of the current context.
#pragma once

#include <functional>
#include <utility>

namespace postchain::gl {

// Does a little other work; false: there is none at present.
using Meanwhile = std::function<bool()>;

class Fence {
  public:
    Fence() = default;  // passed
    static Fence here();
    Fence(Fence&& other) noexcept : sync_(std::exchange(other.sync_, nullptr)) {}
    Fence& operator=(Fence&& other) noexcept {
        std::swap(sync_, other.sync_);
        return *this;
    }
    ~Fence();

    // True if the device has passed the fence, or if the context is lost, which the caller's next
    // check finds.
    bool passed();
    // Waits; first does other work for as long as there is some.
    void wait(const Meanwhile& meanwhile = {});
    // It went with its context.
    void abandon() { sync_ = nullptr; }

  private:
    void* sync_ = nullptr;  // GLsync
};

}  // namespace postchain::gl

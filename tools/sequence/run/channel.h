// Channel<T>: a bounded queue between two threads.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

namespace postchain::sequence {

template <class T>
class Channel {
  public:
    explicit Channel(size_t capacity) : capacity_(capacity) {}

    // Waits while the channel is full. Returns false, and drops the value, if the channel is
    // closed.
    bool push(T value) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return closed_ || items_.size() < capacity_; });
        if (closed_) return false;
        items_.push_back(std::move(value));
        changed_.notify_all();
        return true;
    }
    // Waits for a value; empty if the channel is closed and empty.
    std::optional<T> pop() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return closed_ || !items_.empty(); });
        return take();
    }
    // pop() with a timeout; empty also when it runs out.
    template <class Duration>
    std::optional<T> pop_for(Duration duration) {
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, duration, [&] { return closed_ || !items_.empty(); });
        return take();
    }
    bool is_over() {
        const std::lock_guard lock(mutex_);
        return closed_ && items_.empty();
    }
    // The value that is taken next; null if it is empty. Stays valid until this thread takes it.
    const T* front() {
        const std::lock_guard lock(mutex_);
        return items_.empty() ? nullptr : &items_.front();
    }
    // A value if one is available; does not wait.
    std::optional<T> try_pop() {
        std::unique_lock lock(mutex_);
        return take();
    }
    void close() {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        changed_.notify_all();
    }

  private:
    std::optional<T> take() {
        if (items_.empty()) return std::nullopt;
        T value = std::move(items_.front());
        items_.pop_front();
        changed_.notify_all();
        return value;
    }
    const size_t capacity_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<T> items_;
    bool closed_ = false;
};

}  // namespace postchain::sequence

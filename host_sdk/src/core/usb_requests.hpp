// What other threads ask of a probe on USB, until its answer comes.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <lightwell/link_message.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell::core {

/// Between any threads, which ask and wait, and one reader thread, which sends and hears answers.
class UsbRequests {
 public:
  /// Writes a LinkRequest with this id.
  using Encode = std::function<void(std::uint32_t id, std::vector<std::byte>& out)>;

  /// Waits for the answer. unavailable where none comes in time, or the link is down or broke meanwhile. `wake` tells
  /// the reader thread that there is something to send.
  [[nodiscard]] Result<LinkResponse> ask(const Encode& encode, Duration timeout, const std::function<void()>& wake) {
    std::unique_lock lock(mutex_);
    if (!up_) return Status(StatusCode::unavailable, "not connected");
    const std::uint32_t id = next_id_++;
    PendingRequest& mine = requests_.emplace_back();
    const auto here = std::prev(requests_.end());
    mine.id = id;
    encode(id, mine.request);
    lock.unlock();
    wake();
    lock.lock();
    const bool over =
        changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return mine.answer.has_value(); });
    Result<LinkResponse> answer =
        over ? *std::move(mine.answer)
             : Result<LinkResponse>(Status(StatusCode::unavailable, "the probe did not answer in time"));
    requests_.erase(here);
    return answer;
  }

  // The reader thread's side.

  [[nodiscard]] std::uint32_t new_id() {
    const std::lock_guard lock(mutex_);
    return next_id_++;
  }
  /// One that was not sent yet, into `out`, and its id; nothing where there is none.
  [[nodiscard]] std::optional<std::uint32_t> next(std::vector<std::byte>& out) {
    const std::lock_guard lock(mutex_);
    for (PendingRequest& q : requests_) {
      if (q.sent || q.answer) continue;
      q.sent = true;
      out = q.request;
      return q.id;
    }
    return std::nullopt;
  }
  void answered(const LinkResponse& response) {
    const std::lock_guard lock(mutex_);
    for (PendingRequest& q : requests_)
      if (q.sent && !q.answer && q.id == response.id) q.answer = response;
    changed_.notify_all();
  }
  void link_up() {
    const std::lock_guard lock(mutex_);
    up_ = true;
  }
  /// Whether a request that was sent was obeyed, nobody knows.
  void link_down() {
    const std::lock_guard lock(mutex_);
    up_ = false;
    for (PendingRequest& q : requests_)
      if (!q.answer) q.answer = Status(StatusCode::unavailable, "the link broke before the probe answered");
    changed_.notify_all();
  }

 private:
  struct PendingRequest {
    std::uint32_t id = 0;
    std::vector<std::byte> request;
    bool sent = false;
    std::optional<Result<LinkResponse>> answer;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<PendingRequest> requests_;  ///< At most one for each thread that waits.
  std::uint32_t next_id_ = 1;
  bool up_ = false;
};

}  // namespace lightwell::core

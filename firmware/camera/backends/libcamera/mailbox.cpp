#include "camera/backends/libcamera/mailbox.hpp"

#include <utility>

namespace lightwell::libcam {

void Mailbox::prepare(Events& post, std::size_t completions, std::size_t returns) {
  max_completions_ = completions;
  for (Events* p : {&post, &filling_}) {
    p->completions.reserve(completions);
    p->returned.reserve(returns);
  }
}

void Mailbox::complete(const Completion& completion) {
  const std::lock_guard lock(mutex_);
  // Full only with completions of an older session: each buffer is queued at most once.
  if (filling_.completions.size() == max_completions_) return;
  filling_.completions.push_back(completion);
  changed_.notify_all();
}

void Mailbox::give_back(int slot) {
  const std::lock_guard lock(mutex_);
  filling_.returned.push_back(slot);
  changed_.notify_all();
}

void Mailbox::cameras_changed() {
  const std::lock_guard lock(mutex_);
  filling_.cameras_changed = true;
  changed_.notify_all();
}

void Mailbox::stop() {
  const std::lock_guard lock(mutex_);
  filling_.stop = true;
  changed_.notify_all();
}

void Mailbox::take(Events& post, Clock::time_point limit) {
  post.completions.clear();
  post.returned.clear();
  post.cameras_changed = false;
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, limit, [this] {
    return filling_.stop || filling_.cameras_changed || !filling_.completions.empty() || !filling_.returned.empty();
  });
  // Swap, so that both vectors keep their capacity.
  std::swap(post.completions, filling_.completions);
  std::swap(post.returned, filling_.returned);
  post.cameras_changed = std::exchange(filling_.cameras_changed, false);
  post.stop = filling_.stop;
}

void Mailbox::restart() {
  const std::lock_guard lock(mutex_);
  filling_.completions.clear();
  filling_.stop = false;
}

}  // namespace lightwell::libcam

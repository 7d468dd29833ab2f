#include "feed.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <utility>

#include "broker_login.hpp"

namespace lightwell::tool {
namespace {

volatile std::sig_atomic_t signal_seen = 0;

void on_signal(int) { signal_seen = 1; }

}  // namespace

void stop_on_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

bool stop_requested() { return signal_seen != 0; }

Result<ProbeOptions> options_with(const std::string& credentials) {
  Result<ProbeOptions> options = probe_options();
  if (options.ok()) options->credentials.folder = credentials;
  return options;
}

Result<std::unique_ptr<Feed>> Feed::open(const std::string& uri, const std::string& credentials) {
  std::unique_ptr<Feed> feed(new Feed);
  Result<ProbeOptions> made = options_with(credentials);
  if (!made.ok()) return made.status();
  ProbeOptions& options = *made;
  options.on_descriptor = [raw = feed.get()](const Arrival& arrival) { raw->put(arrival); };
  Result<Probe> probe = Probe::connect(uri, std::move(options));
  if (!probe.ok()) return probe.status();
  feed->probe_.emplace(std::move(*probe));
  return feed;
}

Feed::~Feed() {
  {
    // Release the reader thread, which may wait in put(), because the probe's destructor joins it.
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
  probe_.reset();
}

void Feed::put(const Arrival& arrival) {
  ReceivedDescriptor item{{arrival.bytes.begin(), arrival.bytes.end()},
                          arrival.descriptor,
                          arrival.mid_exposure,
                          arrival.received,
                          arrival.stored};
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return closed_ || waiting_.size() < kMaxWaiting; });
  if (closed_) return;
  waiting_.push_back(std::move(item));
  changed_.notify_all();
}

std::optional<ReceivedDescriptor> Feed::next(HostTime deadline) {
  // Wait in short periods, because neither a signal nor the end of a recording notifies the condition variable.
  constexpr std::int64_t kPollPeriod = 20'000'000;
  for (;;) {
    const bool last_poll = over() || stop_requested() || monotonic_now_ns() >= deadline.ns;
    std::unique_lock lock(mutex_);
    const auto wait = last_poll ? 0 : std::min(kPollPeriod, deadline.ns - monotonic_now_ns());
    if (changed_.wait_for(lock, std::chrono::nanoseconds(wait), [this] { return !waiting_.empty(); })) {
      std::optional<ReceivedDescriptor> item;
      item.emplace(std::move(waiting_.front()));
      waiting_.pop_front();
      changed_.notify_all();
      return item;
    }
    if (last_poll) return std::nullopt;
  }
}

bool Feed::over() const {
  if (probe_->stats().state != LinkState::ended) return false;
  const std::lock_guard lock(mutex_);
  return waiting_.empty();
}

}  // namespace lightwell::tool

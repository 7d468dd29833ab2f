// A probe at a broker: one thread that follows its topics, and asks for its clock, without which nothing is taken.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/back_off.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/status_codec.hpp>

#include "core/replay_protection.hpp"
#include "core/clock_map.hpp"
#include "core/mqtt_login.hpp"
#include "core/probe_info.hpp"
#include "core/source.hpp"

namespace lightwell::core {
namespace {

constexpr Duration kSecond{1'000'000'000};
/// Round trips that follow each other at the start: the best of a few is a much better clock than one.
constexpr int kFirstRoundTrips = 4;
constexpr Duration kFirstPollPeriod{100'000'000};
/// From then on: clocks drift by 6 ms at most in between. Thousands of clients do not ask more often than a probe
/// answers.
constexpr Duration kPollPeriod{60'000'000'000};
constexpr Duration kResponseTimeout{1'000'000'000};
constexpr Duration kRetryMin{500'000'000}, kRetryMax{8'000'000'000};
/// A probe that is there has its status retained: it comes with the subscription.
constexpr Duration kStatusTimeout{500'000'000};

struct PendingRequest {
  std::array<std::byte, 16> correlation{};
  HostTime sent;
};

/// All that the thread uses. It may outlive the source by as long as the system's resolver takes to give a name up, and
/// then touches nothing else.
class SubscriberThread {
 public:
  SubscriberThread(const MqttAddress& address, const ProbeOptions& options, DescriptorReceiver& receiver)
      : base_(address.base),
        topics_(address.base),
        reply_topic_(topics_.replies + random_name()),
        silence_limit_(options.silence_limit),
        receiver_(receiver),
        retry_(kRetryMin, kRetryMax, std::random_device{}()),
        random_(std::random_device{}()),
        session_(session_options(address, options)) {}

  void run() {
    set_state(LinkState::connecting);
    while (!stopping_) {
      session_.run_once(until_due());
      if (!stopping_) on_time({monotonic_now_ns()});
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  /// True where the thread ends soon: it may be in the observer, which is waited for. False where it is in the
  /// resolver, behind which it sees that it was stopped before it touches anything.
  [[nodiscard]] bool stop() {
    stopping_ = true;
    session_.wake();
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::milliseconds(900), [&] { return ended_; }) || !session_.resolving();
  }

 private:
  MqttSession::Options session_options(const MqttAddress& address, const ProbeOptions& options) {
    MqttSession::Options out;
    out.address = address;
    out.login = login_of(options.mqtt);
    // The answers first: who asks at once must not miss them.
    out.subscriptions = {reply_topic_, topics_.status, topics_.descriptor};
    out.retry_min = options.retry_min;
    out.retry_max = options.retry_max;
    out.connect_timeout = options.connect_timeout;
    // What is above a descriptor's size and below this is counted.
    out.largest_packet = 256 * 1024;
    out.on_connected = [this] { on_connected(); };
    out.on_lost = [this](const std::string& why) { on_lost(why); };
    out.on_message = [this](const MqttMessage& message) { on_message(message); };
    return out;
  }

  // What the broker brings.

  void on_connected() {
    connected_at_ = last_received_ = {monotonic_now_ns()};
    status_ = StatusOf::unknown;
    question_.reset();
    timeout_reported_ = false;
  }

  void on_lost(const std::string& why) {
    // The thread may have come out of the resolver long after the source went.
    if (stopping_) return;
    question_.reset();
    receiver_.report_error(why);
    set_state(LinkState::waiting);
  }

  void on_message(const MqttMessage& message) {
    if (stopping_) return;
    const HostTime received{monotonic_now_ns()};
    if (message.topic == topics_.descriptor) {
      on_descriptor(message.payload, received);
    } else if (message.topic == topics_.status) {
      on_status(message.payload, received);
    } else if (message.topic == reply_topic_) {
      on_answer(message, received);
    }
  }

  void on_descriptor(std::span<const std::byte> bytes, HostTime received) {
    if (bytes.size() > kMaxDescriptorBytes) {
      receiver_.refuse_oversized(bytes.size());
    } else if (clock_synchronized_) {
      last_received_ = received;
      take(bytes, received);
    } else {
      // Retained, perhaps long ago: how old it is will be known with the clock.
      held_.assign(bytes.begin(), bytes.end());
      held_received_ = received;
    }
  }

  void take(std::span<const std::byte> bytes, HostTime received) {
    const auto when = [&](const CaptureTime& time) {
      const std::optional<MappedTime> mapped = gate_.admit(time.mid_exposure, received, clock_);
      // Perhaps the probe began anew and this is right: its clock tells.
      if (!mapped && !question_) next_question_ = std::min(next_question_, std::max(last_answer_ + kSecond, received));
      return mapped;
    };
    receiver_.take(bytes, received, when);
  }

  void on_status(std::span<const std::byte> bytes, HostTime received) {
    if (bytes.size() > kMaxMqttStatusBytes) {
      receiver_.refuse("a status of " + std::to_string(bytes.size()) + " bytes");
      return;
    }
    if (std::ranges::equal(bytes, std::as_bytes(std::span(kMqttGone)))) {
      status_ = StatusOf::gone;
      clock_synchronized_ = false;
      question_.reset();
      receiver_.report_error("the probe has left " + base_ + ": it was stopped, or the broker lost it");
      set_state(LinkState::gone);
      return;
    }
    Result<StatusSnapshot> status = decode_status(bytes);
    if (!status.ok()) {
      receiver_.refuse(status.status().message());
      return;
    }
    last_received_ = received;
    snapshot_ = std::move(*status);
    if (status_ != StatusOf::alive) {
      status_ = StatusOf::alive;
      round_trips_ = 0;
      next_question_ = received;
      retry_.reset();
    }
    describe(received);
  }

  void on_answer(const MqttMessage& message, HostTime received) {
    if (!question_ || !std::ranges::equal(message.correlation, question_->correlation)) {
      receiver_.refuse("an answer to no question");
      return;
    }
    const Result<ProbeTime> clock = message.payload.size() <= kMaxMqttStatusBytes
                                        ? decode_clock(message.payload)
                                        : Status(StatusCode::data_loss, "clock: an answer that is too long");
    if (!clock.ok()) {
      receiver_.refuse(clock.status().message());
      return;
    }
    const std::optional<Duration> before = clock_.known() ? std::optional(clock_.offset(received)) : std::nullopt;
    const Duration doubt = clock_.uncertainty(received) + (received - question_->sent);
    clock_.add(question_->sent, *clock, received);
    // The probe's clock was set anew: it rebooted, or another one took its place.
    if (before && std::llabs((clock_.offset(received) - *before).ns) > doubt.ns) {
      gate_.forget();
      receiver_.reset_sequence();
    }
    question_.reset();
    retry_.reset();
    clock_synchronized_ = true;
    last_answer_ = last_received_ = received;
    ++round_trips_;
    next_question_ = received + jittered(round_trips_ < kFirstRoundTrips ? kFirstPollPeriod : kPollPeriod);
    describe(received);
    if (!held_.empty()) take(held_, held_received_);
    held_.clear();
  }

  // What time brings.

  [[nodiscard]] Duration until_due() const {
    if (!session_.connected()) return kSecond;
    const HostTime now{monotonic_now_ns()};
    HostTime due = now + kSecond;
    if (status_ == StatusOf::unknown && !timeout_reported_) due = connected_at_ + kStatusTimeout;
    if (status_ == StatusOf::alive) {
      due = std::min(due, question_ ? question_->sent + kResponseTimeout : next_question_);
      if (!timeout_reported_) due = std::min(due, last_received_ + silence_limit_);
    }
    return std::clamp(due - now, Duration{1'000'000}, kSecond);
  }

  void on_time(HostTime now) {
    if (!session_.connected()) return;
    if (status_ == StatusOf::unknown && now > connected_at_ + kStatusTimeout && !timeout_reported_) {
      timeout_reported_ = true;
      receiver_.report_error("no probe has published below " + base_ + " at this broker");
    }
    if (status_ != StatusOf::alive) return;
    if (question_ && now > question_->sent + kResponseTimeout) {
      question_.reset();
      next_question_ = now + retry_.next();
      if (!clock_synchronized_) receiver_.report_error("the probe does not tell its clock, so no age is known");
    }
    if (!question_ && now >= next_question_) ask(now);
    if (!clock_synchronized_) return;
    if (now > last_received_ + silence_limit_) {
      if (!timeout_reported_) receiver_.report_error("the probe fell silent");
      timeout_reported_ = true;
      set_state(LinkState::waiting);
    } else {
      timeout_reported_ = false;
      set_state(LinkState::connected);
    }
  }

  void set_state(LinkState state) {
    if (state != state_) receiver_.set_state(state);
    state_ = state;
  }

  void ask(HostTime now) {
    std::random_device unpredictable;
    PendingRequest question;
    for (std::byte& b : question.correlation) b = static_cast<std::byte>(unpredictable());
    question.sent = {monotonic_now_ns()};
    if (session_.ask(topics_.clock, reply_topic_, question.correlation))
      question_ = question;
    else
      next_question_ = now + retry_.next();
  }

  void describe(HostTime now) {
    if (!clock_synchronized_ || status_ != StatusOf::alive) return;
    receiver_.describe(probe_info(snapshot_, clock_, now));
  }

  [[nodiscard]] Duration jittered(Duration mean) {
    std::uniform_real_distribution<double> jitter(0.75, 1.25);
    return {static_cast<std::int64_t>(static_cast<double>(mean.ns) * jitter(random_))};
  }

  enum class StatusOf : std::uint8_t { unknown, alive, gone };

  const std::string base_;
  const MqttTopics topics_;
  const std::string reply_topic_;
  const Duration silence_limit_;
  DescriptorReceiver& receiver_;
  Backoff retry_;
  std::minstd_rand random_;

  StatusOf status_ = StatusOf::unknown;
  StatusSnapshot snapshot_;
  HostTime connected_at_, last_received_, last_answer_, next_question_;
  bool timeout_reported_ = false;
  std::optional<LinkState> state_;

  ClockMap clock_;
  /// An answer of this probe has come since it was last said to be gone.
  bool clock_synchronized_ = false;
  std::optional<PendingRequest> question_;
  int round_trips_ = 0;
  ReplayProtection gate_;
  std::vector<std::byte> held_;  ///< The last descriptor that came without a trusted clock.
  HostTime held_received_;

  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;

  MqttSession session_;  // last: it calls into the others
};

class MqttSource final : public Source {
 public:
  MqttSource(const MqttAddress& address, const ProbeOptions& options, DescriptorReceiver& receiver)
      : uri_(address.uri()),
        subscriber_(std::make_shared<SubscriberThread>(address, options, receiver)),
        thread_([follower = subscriber_] { follower->run(); }) {}

  ~MqttSource() override {
    // A resolver that hangs keeps the thread.
    subscriber_->stop() ? thread_.join() : thread_.detach();
  }

  Result<EstimatorState> estimator() override { return no_commands(); }
  Status change_estimator(const EstimatorUpdate&) override { return no_commands(); }
  Result<double> report_lux(double, Vec3f) override { return no_commands(); }

 private:
  [[nodiscard]] Status no_commands() const {
    return {StatusCode::failed_precondition,
            uri_ +
                ": a probe takes no commands from a broker, where whoever may publish could give them; connect to it "
                "over grpc:// or USB for that"};
  }

  const std::string uri_;
  const std::shared_ptr<SubscriberThread> subscriber_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Source> make_mqtt_source(const MqttAddress& address, const ProbeOptions& options, DescriptorReceiver& receiver) {
  return std::make_unique<MqttSource>(address, options, receiver);
}

}  // namespace lightwell::core

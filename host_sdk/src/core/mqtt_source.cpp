// MQTT: the connection, one thread that subscribes to a probe's topics and requests its clock, without which
// descriptors are not accepted; and discovery at a broker.
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

#include <lightwell/backoff.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/mqtt_session.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/status.hpp>
#include <lightwell/text.hpp>

#include "core/clock_map.hpp"
#include "core/discovery_backends.hpp"
#include "core/source.hpp"

namespace lightwell::core {
namespace {

constexpr Duration kSecond{1'000'000'000};
/// The first round trips follow each other quickly, so that the clocks agree soon after the connection.
constexpr int kFirstPolls = 4;
constexpr Duration kFirstPollPeriod{100'000'000};
/// Later round trips: clocks drift by at most 6 ms in between, and a probe can respond to thousands of clients.
constexpr Duration kPollPeriod{60'000'000'000};
constexpr Duration kResponseTimeout{1'000'000'000};
constexpr Duration kRetryMin{500'000'000}, kRetryMax{8'000'000'000};
/// The broker sends a probe's retained status with the subscription.
constexpr Duration kStatusTimeout{500'000'000};

/// Sixteen random hexadecimal digits.
std::string random_name() {
  std::random_device random;
  return formatted("%08x%08x", static_cast<unsigned>(random()), static_cast<unsigned>(random()));
}

/// The login with a client identifier that is unique to this connection: a broker disconnects a client when another one
/// connects with the same identifier.
MqttLogin login_of(const MqttCredentials& c) {
  return {"lightwell-sdk-" + random_name(), c.user, c.password, c.ca_file, c.certificate_file, c.key_file};
}

struct PendingRequest {
  std::array<std::byte, 16> correlation{};
  HostTime sent;
};

/// The thread and all that it uses. It can outlive the source while the system's resolver blocks, and then accesses
/// nothing else.
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

  /// Stops the thread. True if it ends soon: it has ended, or runs the application's callback, for which the caller
  /// waits. False if it is inside the resolver; after that it checks `stopping_` before it accesses anything else.
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
    // The reply topic first, so that no response to an early request is missed.
    out.subscriptions = {reply_topic_, topics_.status, topics_.descriptor};
    if (options.plane == PlaneReception::receive) out.subscriptions.push_back(topics_.plane);
    out.retry_min = options.retry_min;
    out.retry_max = options.retry_max;
    out.connect_timeout = options.connect_timeout;
    // Above the limit of descriptors, so that oversized messages are received and counted.
    out.largest_packet = 256 * 1024;
    out.on_connected = [this] { on_connected(); };
    out.on_lost = [this](const std::string& why) { on_lost(why); };
    out.on_message = [this](const MqttMessage& message) { on_message(message); };
    return out;
  }

  // Events of the session.

  void on_connected() {
    connected_at_ = last_received_ = {monotonic_now_ns()};
    status_ = ProbeStatus::unknown;
    pending_request_.reset();
    timeout_reported_ = false;
  }

  void on_lost(const std::string& why) {
    // The resolver may have returned long after the source was destroyed.
    if (stopping_) return;
    pending_request_.reset();
    receiver_.report_error(why);
    set_state(LinkState::waiting);
  }

  void on_message(const MqttMessage& message) {
    if (stopping_) return;
    const HostTime received{monotonic_now_ns()};
    if (message.topic == topics_.descriptor) {
      on_descriptor(message.payload, received);
    } else if (message.topic == topics_.plane) {
      on_plane(message.payload, received);
    } else if (message.topic == topics_.status) {
      on_status(message.payload, received);
    } else if (message.topic == reply_topic_) {
      on_clock_response(message, received);
    }
  }

  void on_descriptor(std::span<const std::byte> bytes, HostTime received) {
    if (bytes.size() > kMaxDescriptorBytes) {
      receiver_.refuse_oversized(bytes.size());
    } else if (clock_synchronized_) {
      last_received_ = received;
      admit(bytes, received);
    } else {
      // It may be an old retained message; its age is known once the clock is.
      held_.assign(bytes.begin(), bytes.end());
      held_received_ = received;
    }
  }

  void on_plane(std::span<const std::byte> bytes, HostTime received) {
    if (bytes.size() > kMaxPlaneMessageBytes) return receiver_.refuse_oversized(bytes.size());
    // The probe repeats what was missed.
    if (!clock_synchronized_) return;
    last_received_ = received;
    receiver_.receive_plane(bytes, received, [&](const PlaneInfo& info) {
      return plane_replay_protection_.admit(info.capture, info.mid_exposure, received, clock_);
    });
  }

  void admit(std::span<const std::byte> bytes, HostTime received) {
    const auto when = [&](const CaptureTime& time) {
      const std::optional<MappedTime> mapped = replay_protection_.admit(time.mid_exposure, received, clock_);
      // The probe may have restarted, so that the descriptor is valid: request its clock.
      if (!mapped && !pending_request_)
        next_request_ = std::min(next_request_, std::max(last_response_ + kSecond, received));
      return mapped;
    };
    receiver_.receive(bytes, received, when);
  }

  void on_status(std::span<const std::byte> bytes, HostTime received) {
    if (bytes.size() > kMaxMqttStatusBytes) {
      receiver_.refuse("a status of " + std::to_string(bytes.size()) + " bytes");
      return;
    }
    if (std::ranges::equal(bytes, std::as_bytes(std::span(kMqttGone)))) {
      status_ = ProbeStatus::gone;
      clock_synchronized_ = false;
      pending_request_.reset();
      receiver_.report_error("the probe has left " + base_ + ": it was stopped, or lost its connection to the broker");
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
    if (status_ != ProbeStatus::alive) {
      status_ = ProbeStatus::alive;
      round_trips_ = 0;
      next_request_ = received;
      retry_.reset();
    }
    describe(received);
  }

  void on_clock_response(const MqttMessage& message, HostTime received) {
    if (!pending_request_ || !std::ranges::equal(message.correlation, pending_request_->correlation)) {
      receiver_.refuse("a response without a request");
      return;
    }
    const Result<ProbeTime> clock = message.payload.size() <= kMaxMqttStatusBytes
                                        ? decode_clock(message.payload)
                                        : Status(StatusCode::data_loss, "clock: the response is too long");
    if (!clock.ok()) {
      receiver_.refuse(clock.status().message());
      return;
    }
    const std::optional<Duration> before = clock_.known() ? std::optional(clock_.offset(received)) : std::nullopt;
    const Duration uncertainty = clock_.uncertainty(received) + (received - pending_request_->sent);
    clock_.add(pending_request_->sent, *clock, received);
    // The probe's clock was reset: it rebooted, or was replaced by another probe.
    if (before && std::llabs((clock_.offset(received) - *before).ns) > uncertainty.ns) {
      replay_protection_.forget();
      plane_replay_protection_.forget();
      receiver_.reset_sequence();
    }
    pending_request_.reset();
    retry_.reset();
    clock_synchronized_ = true;
    last_response_ = last_received_ = received;
    ++round_trips_;
    next_request_ = received + jittered(round_trips_ < kFirstPolls ? kFirstPollPeriod : kPollPeriod);
    describe(received);
    if (!held_.empty()) admit(held_, held_received_);
    held_.clear();
  }

  // Timers.

  [[nodiscard]] Duration until_due() const {
    if (!session_.connected()) return kSecond;
    const HostTime now{monotonic_now_ns()};
    HostTime due = now + kSecond;
    if (status_ == ProbeStatus::unknown && !timeout_reported_) due = connected_at_ + kStatusTimeout;
    if (status_ == ProbeStatus::alive) {
      due = std::min(due, pending_request_ ? pending_request_->sent + kResponseTimeout : next_request_);
      if (!timeout_reported_) due = std::min(due, last_received_ + silence_limit_);
    }
    return std::clamp(due - now, Duration{1'000'000}, kSecond);
  }

  void on_time(HostTime now) {
    if (!session_.connected()) return;
    if (status_ == ProbeStatus::unknown && now > connected_at_ + kStatusTimeout && !timeout_reported_) {
      timeout_reported_ = true;
      receiver_.report_error("no probe has published below " + base_ + " at this broker");
    }
    if (status_ != ProbeStatus::alive) return;
    if (pending_request_ && now > pending_request_->sent + kResponseTimeout) {
      pending_request_.reset();
      next_request_ = now + retry_.next();
      if (!clock_synchronized_) receiver_.report_error("the probe does not report its clock, so no age is known");
    }
    if (!pending_request_ && now >= next_request_) request_clock(now);
    if (!clock_synchronized_) return;
    if (now > last_received_ + silence_limit_) {
      if (!timeout_reported_) receiver_.report_error("no data from the probe within silence_limit");
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

  void request_clock(HostTime now) {
    std::random_device unpredictable;
    PendingRequest request;
    for (std::byte& b : request.correlation) b = static_cast<std::byte>(unpredictable());
    request.sent = {monotonic_now_ns()};
    if (session_.request(topics_.clock, reply_topic_, request.correlation))
      pending_request_ = request;
    else
      next_request_ = now + retry_.next();
  }

  void describe(HostTime now) {
    if (!clock_synchronized_ || status_ != ProbeStatus::alive) return;
    receiver_.describe(probe_info(snapshot_, clock_, now));
  }

  [[nodiscard]] Duration jittered(Duration mean) {
    std::uniform_real_distribution<double> jitter(0.75, 1.25);
    return {static_cast<std::int64_t>(static_cast<double>(mean.ns) * jitter(random_))};
  }

  enum class ProbeStatus : std::uint8_t { unknown, alive, gone };

  const std::string base_;
  const MqttTopics topics_;
  const std::string reply_topic_;
  const Duration silence_limit_;
  DescriptorReceiver& receiver_;
  Backoff retry_;
  std::minstd_rand random_;

  ProbeStatus status_ = ProbeStatus::unknown;
  StatusSnapshot snapshot_;
  HostTime connected_at_, last_received_, last_response_, next_request_;
  bool timeout_reported_ = false;
  std::optional<LinkState> state_;

  ClockMap clock_;
  /// A clock response was received since the probe was last reported as gone.
  bool clock_synchronized_ = false;
  std::optional<PendingRequest> pending_request_;
  int round_trips_ = 0;
  ReplayProtection replay_protection_;
  PlaneReplayProtection plane_replay_protection_;
  std::vector<std::byte> held_;  ///< The last descriptor received while the clock was unknown.
  HostTime held_received_;

  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;

  MqttSession session_;  // last, because its callbacks use the members above
};

class MqttSource final : public Source {
 public:
  MqttSource(const MqttAddress& address, const ProbeOptions& options, DescriptorReceiver& receiver)
      : Source(address.uri()),
        subscriber_(std::make_shared<SubscriberThread>(address, options, receiver)),
        thread_([follower = subscriber_] { follower->run(); }) {}

  ~MqttSource() override {
    // A blocking resolver keeps the thread alive.
    subscriber_->stop() ? thread_.join() : thread_.detach();
  }

 private:
  [[nodiscard]] Result<LinkResponse> request(const LinkCommand&) override {
    return Status(StatusCode::failed_precondition,
                  name() +
                      ": a probe accepts no commands over MQTT, because any client that may publish could send them; "
                      "connect to it over grpc:// or USB for that");
  }

  const std::shared_ptr<SubscriberThread> subscriber_;
  std::thread thread_;
};

constexpr std::string_view kStatus = "/status";

/// Topic levels below the base that are searched; more would match topics of other applications.
std::vector<std::string> status_topics(const std::string& base) {
  std::vector<std::string> out;
  if (!base.empty()) out.push_back(base + std::string(kStatus));
  std::string level = base.empty() ? "+" : base + "/+";
  for (int i = 0; i < 3; ++i, level += "/+") out.push_back(level + std::string(kStatus));
  return out;
}

/// Adds the probe of a status message that is retained at the broker.
void add_status(const MqttMessage& message, const MqttAddress& broker, DiscoveryResults& results) {
  MqttAddress own = broker;
  own.base = message.topic.substr(0, message.topic.size() - kStatus.size());
  // Any client may publish on any topic: a topic that is not a valid base is ignored.
  const Result<MqttAddress> address = parse_mqtt_address(own.uri());
  if (!address.ok() || address->base != own.base) return results.refuse();
  FoundProbe probe;
  probe.by = FoundBy::mqtt;
  probe.instance = own.base;
  probe.links = {{own.uri(), own.transport == MqttTransport::tls ? "tls" : "none"}};
  if (std::string_view(reinterpret_cast<const char*>(message.payload.data()), message.payload.size()) == kMqttGone) {
    probe.gone = true;
  } else {
    const Result<StatusSnapshot> status = message.payload.size() <= kMaxMqttStatusBytes
                                              ? decode_status(message.payload)
                                              : Status(StatusCode::data_loss, "too long");
    if (!status.ok()) return results.refuse();
    probe.name = status->probe_name;
    probe.id = status->probe_id;
    probe.calibration_id = status->calibration_id;
    probe.version = status->version;
  }
  results.put("mqtt " + own.base, std::move(probe));
}

}  // namespace

Result<std::unique_ptr<Source>> make_source(const MqttAddress& address, const ProbeOptions& options,
                                            DescriptorReceiver& receiver) {
  if (Status s = check_plain_login(address); !options.mqtt.user.empty() && !s.ok()) return s;
  return std::unique_ptr<Source>(std::make_unique<MqttSource>(address, options, receiver));
}

void discover_at_broker(const MqttAddress& broker, const MqttCredentials& credentials, Duration timeout,
                        DiscoveryResults& results) {
  std::string failure = "the broker does not respond";
  MqttSession::Options options;
  options.address = broker;
  options.login = login_of(credentials);
  options.subscriptions = status_topics(broker.base);
  options.retry_min = {200'000'000};
  options.retry_max = {1'000'000'000};
  options.connect_timeout = timeout;
  options.on_connected = [&] { failure.clear(); };
  options.on_lost = [&](const std::string& why) { failure = why; };
  options.on_message = [&](const MqttMessage& message) { add_status(message, broker, results); };
  MqttSession session(options);
  const HostTime end = HostTime{monotonic_now_ns()} + timeout;
  for (Duration left = timeout; left.ns > 0; left = end - HostTime{monotonic_now_ns()}) session.run_once(left);
  if (!failure.empty()) results.problem(broker.uri() + ": " + failure);
}

}  // namespace lightwell::core

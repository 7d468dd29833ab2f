#include "link/mqtt/mqtt_link.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <tuple>
#include <utility>

#include <lightwell/files.hpp>
#include <lightwell/mqtt_session.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>

#include "link/plane_queue.hpp"
#include "link/token_bucket.hpp"

namespace lightwell {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kStatusPeriod = kSecond;
/// Rate limit: a thousand clients that connect at once have their first round trip within two seconds.
constexpr double kClockAnswersPerSecond = 500;

/// The state that the thread uses. It may outlive the link while the system's name resolver blocks.
class Worker {
 public:
  Worker(const MqttAddress& address, MqttLogin login, Commands& commands)
      : topics_(address.base), commands_(commands), session_(options_for(address, std::move(login))) {}

  void run() {
    while (!stopping_) {
      // While a message is being sent, nothing else is due.
      session_.run_once({session_.idle() ? until_due_ns() : kSecond});
      if (stopping_) break;
      if (session_.idle()) publish_due();
    }
    // Replaces the retained status, as the last will would after a lost connection.
    if (session_.connected()) session_.publish(topics_.status, std::as_bytes(std::span(kMqttGone)), true);
    session_.close(Duration{kSecond / 2});
    set_error_message("stopped");
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  void publish(const EncodedDescriptor& descriptor) {
    {
      const std::lock_guard lock(mutex_);
      if (next_) ++counters_.coalesced;
      next_ = descriptor;
    }
    session_.wake();
  }

  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) {
    {
      const std::lock_guard lock(mutex_);
      newest_plane_ = plane;
      planes_.put(plane);
    }
    session_.wake();
  }

  /// True if the thread has ended or ends soon. False if it blocks in the name resolver; after that it checks stopping_
  /// before it uses commands_.
  [[nodiscard]] bool stop() {
    stopping_ = true;
    session_.wake();
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::milliseconds(900), [&] { return ended_; }) || !session_.resolving();
  }

  [[nodiscard]] LinkCounters counters() const {
    const bool connected = session_.connected();
    const std::lock_guard lock(mutex_);
    LinkCounters out = counters_;
    out.clients = connected ? 1 : 0;
    return out;
  }

  /// Why the broker is not connected, for people; empty while it is.
  [[nodiscard]] std::string error_message() const {
    const std::lock_guard lock(mutex_);
    return error_message_.empty() ? plane_error_message_ : error_message_;
  }

 private:
  MqttSession::Options options_for(const MqttAddress& address, MqttLogin login) {
    MqttSession::Options options;
    options.address = address;
    options.login = std::move(login);
    options.will_topic = topics_.status;
    options.will_payload = kMqttGone;
    options.subscriptions = {topics_.clock};
    options.retry_min = {kSecond / 4};
    options.retry_max = {8 * kSecond};
    options.connect_timeout = {5 * kSecond};
    // Small, so that a slow broker receives the newest descriptor instead of a backlog.
    options.send_buffer_bytes = 16 * 1024;
    options.on_connected = [this] {
      // Publish the status at once, before any descriptor: it replaces the retained last will.
      next_status_ns_ = 1;
      set_error_message({});
      restart_planes();
    };
    options.on_lost = [this](const std::string& why) { set_error_message(why); };
    options.on_message = [this](const MqttMessage& message) { publish_clock(message); };
    return options;
  }

  void set_error_message(const std::string& error_message) {
    const std::lock_guard lock(mutex_);
    error_message_ = error_message;
  }

  /// Time until something is to be published, unless wake() is called before.
  [[nodiscard]] std::int64_t until_due_ns() const {
    const std::lock_guard lock(mutex_);
    return next_ || !planes_.empty() ? 0 : next_status_ns_ - monotonic_now_ns();
  }

  /// Subscribers may lack what was published before.
  void restart_planes() {
    const std::lock_guard lock(mutex_);
    plane_error_message_.clear();
    planes_.clear();
    if (newest_plane_) planes_.put(newest_plane_);
  }

  /// Publishes the status if it is due, and then one other message, unless the status is still being sent. A message of
  /// a plane goes between two descriptors, so that a descriptor waits for one such message at most, and a slow broker
  /// gets both.
  void publish_due() {
    const std::int64_t now = monotonic_now_ns();
    if (now >= next_status_ns_) {
      next_status_ns_ = now + kStatusPeriod;
      const std::string status = encode_status(commands_.status());
      session_.publish(topics_.status, std::as_bytes(std::span(status)), true);
      if (!session_.idle()) return;
    }
    EncodedMessage descriptor, plane;
    {
      const std::lock_guard lock(mutex_);
      if (!next_ || descriptor_was_last_) plane = planes_.take();
      if (!plane) descriptor = std::exchange(next_, nullptr);
    }
    descriptor_was_last_ = descriptor != nullptr;
    if (plane) publish_plane_message(*plane);
    if (!descriptor || session_.publish(topics_.descriptor, *descriptor, true)) return;
    // The descriptor exceeds the broker's maximum size, or the connection was lost: both count as coalesced.
    const std::lock_guard lock(mutex_);
    ++counters_.coalesced;
  }

  /// Not retained: a broker would keep a photograph after its owner has forbidden it, and after the probe has left.
  void publish_plane_message(std::span<const std::byte> message) {
    const bool sent = session_.publish(topics_.plane, message, false), connected = session_.connected();
    const std::lock_guard lock(mutex_);
    plane_error_message_.clear();
    if (sent) return;
    planes_.require_whole();
    if (connected)
      plane_error_message_ = "the broker accepts no message of " + std::to_string(message.size()) +
                             " bytes, so clients lack captured planes: allow packets of 70000 bytes (mosquitto: "
                             "max_packet_size)";
  }

  /// Answers a clock request, or refuses it: a delayed answer would give a wrong time, and the client repeats the
  /// request.
  void publish_clock(const MqttMessage& request) {
    const bool valid = request.topic == topics_.clock && request.payload.size() <= kMaxMqttCorrelationBytes &&
                       !request.correlation.empty() && request.correlation.size() <= kMaxMqttCorrelationBytes &&
                       is_reply_topic(topics_, request.response_topic);
    const std::int64_t now = monotonic_now_ns();
    if (!valid || !rate_limit_.take(now)) return count_refused();
    const std::string clock = encode_clock({monotonic_now_ns()});
    if (!session_.respond(request, std::as_bytes(std::span(clock)))) count_refused();
  }

  void count_refused() {
    const std::lock_guard lock(mutex_);
    ++counters_.messages_refused;
  }

  const MqttTopics topics_;
  Commands& commands_;
  TokenBucket rate_limit_{kClockAnswersPerSecond, kClockAnswersPerSecond};
  std::int64_t next_status_ns_ = 0;
  bool descriptor_was_last_ = false;  ///< The last message other than a status.
  std::atomic<bool> stopping_{false};

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  EncodedDescriptor next_;
  std::shared_ptr<const EncodedPlane> newest_plane_;  ///< Null: none yet.
  PlaneQueue planes_;
  LinkCounters counters_;
  bool ended_ = false;
  std::string error_message_ = "not connected yet", plane_error_message_;

  MqttSession session_;  // Last, because its callbacks use the other members.
};

/// The content of the file; empty without a path.
Result<std::string> content_of(const std::string& field, const std::string& path) {
  if (path.empty()) return std::string();
  Result<std::optional<std::string>> text = read_named_file(path);
  if (!text) return text.status().in("mqtt." + field);
  if (*text) return std::move(**text);
  return Status(StatusCode::not_found, "mqtt." + field + ": " + path + ": there is no such file");
}

/// The file has the user name in the first line and the password in the second.
Status read_login(const std::string& path, MqttLogin& login) {
  if (path.empty()) return {};
  const Result<std::string> text = content_of("login_file", path);
  if (!text) return text.status();
  std::tie(login.user, login.password) = mqtt_login_of(*text);
  if (login.user.empty())
    return invalid_argument("mqtt.login_file: " + path + ": the first line, the user name, is empty");
  if (login.user.size() > 1024 || login.password.size() > 1024)
    return invalid_argument("mqtt.login_file: " + path + ": a line is longer than 1024 bytes");
  return {};
}

class MqttLink final : public Link {
 public:
  MqttLink(MqttConfig config, const std::string& probe_name, Commands& commands)
      : config_(std::move(config)), commands_(commands) {
    if (config_.client_id.empty()) config_.client_id = "lightwell-" + probe_name;
  }
  ~MqttLink() override { stop(); }

  Status start() override {
    if (Status s = config_.validate(); !s.ok()) return s;
    const Result<MqttAddress> address = config_.address();
    if (!address) return address.status();
    for (const auto& [field, path] : {std::pair{"ca_file", config_.ca_file},
                                      {"certificate_file", config_.certificate_file},
                                      {"key_file", config_.key_file}})
      if (Status s = content_of(field, path).status(); !s.ok()) return s;
    MqttLogin login{config_.client_id, {}, {}, config_.ca_file, config_.certificate_file, config_.key_file};
    if (Status s = read_login(config_.login_file, login); !s.ok()) return s;
    address_ = address->uri();
    worker_ = std::make_shared<Worker>(*address, std::move(login), commands_);
    thread_ = std::thread([worker = worker_] { worker->run(); });
    return {};
  }

  void publish(const EncodedDescriptor& descriptor) override {
    if (worker_) worker_->publish(descriptor);
  }

  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override {
    if (worker_) worker_->publish_plane(plane);
  }

  void stop() override {
    if (!thread_.joinable()) return;
    // A thread that blocks in the resolver is detached; it owns its worker and uses nothing else afterwards.
    worker_->stop() ? thread_.join() : thread_.detach();
  }

  LinkCounters counters() const override { return worker_ ? worker_->counters() : LinkCounters{}; }
  std::string_view name() const override { return "mqtt"; }
  std::string address() const override { return address_; }
  std::string error_message() const override { return worker_ ? worker_->error_message() : "not started"; }

 private:
  MqttConfig config_;
  Commands& commands_;
  std::string address_;
  std::shared_ptr<Worker> worker_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Link> make_mqtt_link(const MqttConfig& config, const std::string& probe_name, Commands& commands) {
  return std::make_unique<MqttLink>(config, probe_name, commands);
}

}  // namespace lightwell

// WebSocket connection: one thread that receives from a probe and reconnects.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/backoff.hpp>
#include <lightwell/client_tls.hpp>
#include <lightwell/codec.hpp>
#include <lightwell/link_message.hpp>
#include <lightwell/pipe_signal.hpp>

#include "core/credential_store.hpp"
#include "core/link_requests.hpp"
#include "core/source.hpp"
#include "core/web_addresses.hpp"
#include "core/web_client.hpp"

namespace lightwell::core {
namespace {

/// Round trips before the clock is used for the time stamps of descriptors.
constexpr int kRoundTripsBeforeDescriptors = 2;
/// First byte of every LightingDescriptor, and of no LinkResponse: its first field is wire_version.
constexpr std::byte kDescriptorStart{0x08};

/// The WebSocket of the captured plane. The connection outlives it.
class PlaneStream final : public WebHandler {
 public:
  explicit PlaneStream(DescriptorReceiver& receiver) : receiver_(receiver) {}

  void on_open() override { receiver_.restart_plane(); }
  void on_message(std::span<const std::byte> bytes) override { receiver_.receive_plane(bytes, {monotonic_now_ns()}); }
  void on_oversized(std::size_t bytes) override { receiver_.refuse_oversized(bytes); }
  void on_closed(const std::string& why) override { receiver_.report_error("the plane's stream ended: " + why); }
  bool next_message(std::vector<std::byte>&) override { return false; }

 private:
  DescriptorReceiver& receiver_;
};

/// One connection to a probe, from its start to its end: requests Info until the clock is known, then takes descriptors
/// and requests Info once a second.
class WebConnection final : public WebHandler {
 public:
  WebConnection(WebClient& client, const ProbeOptions& options, DescriptorReceiver& receiver, LinkRequests& requests)
      : client_(client),
        options_(options),
        receiver_(receiver),
        requests_(requests),
        plane_(receiver),
        started_{monotonic_now_ns()},
        last_received_(started_) {}

  [[nodiscard]] bool over() const { return over_; }
  /// Whether the probe responded.
  [[nodiscard]] bool succeeded() const { return round_trips_ > 0; }
  [[nodiscard]] bool opened() const { return open_; }

  [[nodiscard]] HostTime due() const {
    if (!open_) return started_ + options_.connect_timeout;
    const HostTime silent = last_received_ + options_.silence_limit;
    return info_id_ ? silent : std::min(silent, next_info_);
  }

  /// Does what is due; call it after every event and at due().
  void on_time(HostTime now) {
    if (over_) return;
    if (!open_ && now >= due()) return on_closed("no response within connect_timeout");
    if (!open_) return;
    if (now >= last_received_ + options_.silence_limit)
      on_closed("no data from the probe within silence_limit");
    else if ((!info_id_ && now >= next_info_) || requests_.has_unsent())
      client_.write_soon(*this);
  }

  void on_open() override {
    open_ = true;
    last_received_ = next_info_ = {monotonic_now_ns()};
    receiver_.set_state(LinkState::connected);
  }

  void on_message(std::span<const std::byte> bytes) override {
    const HostTime received{monotonic_now_ns()};
    if (!bytes.empty() && bytes.front() == kDescriptorStart)
      on_descriptor(bytes, received);
    else
      on_response(bytes, received);
    // Time spent in the application's callback does not count as silence of the probe.
    last_received_ = {monotonic_now_ns()};
  }

  void on_oversized(std::size_t bytes) override { receiver_.refuse_oversized(bytes); }

  void on_closed(const std::string& why) override {
    if (over_) return;
    over_ = true;
    receiver_.report_error(why);
  }

  bool next_message(std::vector<std::byte>& out) override {
    const HostTime now{monotonic_now_ns()};
    if (!info_id_ && now >= next_info_) {
      info_id_ = requests_.new_id();
      info_sent_ = now;
      encode_info_request(*info_id_, out);
      return true;
    }
    return requests_.next(out).has_value();
  }

 private:
  void on_descriptor(std::span<const std::byte> bytes, HostTime received) {
    if (round_trips_ >= kRoundTripsBeforeDescriptors)
      receiver_.receive(bytes, received,
                        [&](const CaptureTime& time) { return clock_.mapped(time.mid_exposure, received); });
    else
      held_.assign(bytes.begin(), bytes.end()), held_received_ = received;
  }

  void on_response(std::span<const std::byte> bytes, HostTime received) {
    const Result<LinkResponse> response = decode_link_response(bytes);
    if (!response)
      receiver_.refuse("a message that is neither a descriptor nor a response");
    else if (info_id_ == response->id)
      on_info(*response, received);
    else
      requests_.answered(*response);
  }

  void on_info(const LinkResponse& response, HostTime received) {
    info_id_.reset();
    next_info_ = received + kInfoPeriod;
    if (!response.status.ok() || !response.info)
      return on_closed(response.status.ok() ? "the probe's response does not match the request"
                                            : response.status.message());
    clock_.add(info_sent_, response.info->clock_now, received);
    ++round_trips_;
    if (round_trips_ < kFirstRoundTrips) next_info_ = received + kFirstInfoPeriod;
    if (round_trips_ < kRoundTripsBeforeDescriptors) {
      next_info_ = received;
      return;
    }
    requests_.link_up();
    receiver_.describe(probe_info(response.info->status, clock_, received));
    // After describe(), which lets connect() return: an application may hold back descriptors until then.
    if (round_trips_ == kRoundTripsBeforeDescriptors) begin();
  }

  /// The clock is known.
  void begin() {
    if (!held_.empty()) on_descriptor(held_, held_received_);
    if (options_.plane != PlaneReception::none && !client_.open("/v1/planes", plane_))
      receiver_.report_error("the plane's stream cannot be opened");
  }

  WebClient& client_;
  const ProbeOptions& options_;
  DescriptorReceiver& receiver_;
  LinkRequests& requests_;
  PlaneStream plane_;

  ClockMap clock_;
  const HostTime started_;
  HostTime last_received_, next_info_, info_sent_;
  std::optional<std::uint32_t> info_id_;  ///< Of the pending request.
  int round_trips_ = 0;
  std::vector<std::byte> held_;  ///< The last descriptor received while the clock was unknown.
  HostTime held_received_;
  bool open_ = false, over_ = false;
};

class WebSource final : public Source {
 public:
  WebSource(const WebAddress& address, const ProbeOptions& options, std::unique_ptr<ClientTls> tls,
            DescriptorReceiver& receiver)
      : Source(address.host_port),
        options_(options),
        tls_(std::move(tls)),
        receiver_(receiver),
        backoff_(options.retry_min, options.retry_max, std::random_device{}()),
        thread_([this] { follow(); }) {}

  ~WebSource() override {
    stopping_ = true;
    wake();
    thread_.join();
  }

 private:
  [[nodiscard]] Result<LinkResponse> request(const LinkCommand& command) override {
    const Result<LinkResponse> answer = requests_.send_request(command, options_.connect_timeout, [this] { wake(); });
    const Status status = answer ? answer->status : answer.status();
    return status.ok() ? answer : status.in(name());
  }

  /// Interrupts the reader thread's wait.
  void wake() {
    const std::lock_guard lock(mutex_);
    if (client_ != nullptr) client_->wake();
    changed_.notify_all();
  }

  void follow() {
    // OpenSSL writes to sockets whose other end may be closed.
    block_pipe_signal();
    while (!stopping_) {
      receiver_.set_state(LinkState::connecting);
      if (connect()) backoff_.reset();
      requests_.link_down();
      if (stopping_) return;
      receiver_.set_state(LinkState::waiting);
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, std::chrono::nanoseconds(backoff_.next().ns), [this] { return stopping_.load(); });
    }
  }

  /// Tries the addresses of the host until one accepts a connection, and runs that to its end; true if the probe
  /// responded.
  bool connect() {
    const Result<std::vector<std::string>> addresses = addresses_of(name(), stopping_);
    if (!addresses) {
      receiver_.report_error(addresses.status().message());
      return false;
    }
    for (const std::string& address : *addresses) {
      if (tls_) tls_->forget_rejection();
      WebClient client({.host_port = name(),
                        .address = address,
                        .port = split_host_port(name()).port,
                        .tls = tls_.get(),
                        .token = options_.credentials.token,
                        .max_message_bytes = kMaxDescriptorBytes,
                        .connect_timeout_s = static_cast<int>(options_.connect_timeout.ns / 1'000'000'000 + 1)});
      use(&client);
      WebConnection connection(client, options_, receiver_, requests_);
      run(client, connection);
      use(nullptr);
      if (connection.opened() || stopping_) return connection.succeeded();
    }
    return false;
  }

  void run(WebClient& client, WebConnection& connection) {
    if (!client.open("/v1/descriptors", connection)) return receiver_.report_error("no memory for a connection");
    while (!connection.over() && !stopping_) {
      client.run_once(std::max(connection.due() - HostTime{monotonic_now_ns()}, Duration{1'000'000}));
      connection.on_time({monotonic_now_ns()});
    }
  }

  void use(WebClient* client) {
    const std::lock_guard lock(mutex_);
    client_ = client;
  }

  const ProbeOptions options_;
  const std::unique_ptr<ClientTls> tls_;
  DescriptorReceiver& receiver_;
  LinkRequests requests_;
  Backoff backoff_;  ///< Of the reader thread.

  std::mutex mutex_;
  std::condition_variable changed_;
  WebClient* client_ = nullptr;  ///< For wake(); null between connections.
  std::atomic<bool> stopping_{false};
  std::thread thread_;  // last, because it uses all members above
};

}  // namespace

Result<std::unique_ptr<Source>> make_source(const WebAddress& address, ProbeOptions options,
                                            DescriptorReceiver& receiver) {
  Result<ProbeCredentials> credentials = credentials_for(options.credentials, address);
  if (!credentials) return credentials.status();
  options.credentials = std::move(*credentials);
  const ProbeCredentials& c = options.credentials;
  std::unique_ptr<ClientTls> tls;
  if (address.transport == Transport::tls) {
    const ClientTlsOptions trust{c.pinned, c.ca, split_host_port(address.host_port).host, c.client_certificate,
                                 c.client_key};
    if (const Status s = ClientTls::make(trust).assign_to(tls); !s.ok()) return s;
  }
  return std::unique_ptr<Source>(std::make_unique<WebSource>(address, options, std::move(tls), receiver));
}

}  // namespace lightwell::core

#include "link/usb_gadget/usb_gadget_link.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "link/plane_queue.hpp"
#include "link/usb_gadget/ffs_port.hpp"

namespace lightwell {
namespace {

/// Delay after a failed transfer. Without it the loop would spin while an endpoint is disabled and its event is
/// pending.
constexpr Duration kPause{20'000'000};
/// Maximum number of queued responses; a correct host waits for each response.
constexpr std::size_t kMaxResponses = 16;
/// A multiple of every packet size, large enough for the largest request in its frame.
constexpr std::size_t kReceiveBytes = 16 * 1024;
static_assert(kReceiveBytes > kFrameHeaderBytes + kMaxLinkMessageBytes + 1);

class GadgetLink final : public UsbGadgetLink {
 public:
  GadgetLink(std::unique_ptr<GadgetPort> port, std::uint32_t session, Commands& commands)
      : port_(std::move(port)), commands_(commands), writer_(session), received_(kReceiveBytes) {}
  ~GadgetLink() override { stop(); }

  Status start() override {
    if (Status s = port_->open(); !s.ok()) return s;
    stopping_ = false;
    thread_ = std::thread([this] { run(); });
    return {};
  }

  void publish(const EncodedDescriptor& descriptor) override {
    {
      const std::lock_guard lock(mutex_);
      if (!listening_) {
        ++counters_.descriptors_without_listener;
        return;
      }
      if (newest_) ++coalesced_;
      newest_ = descriptor;
    }
    port_->wake();
  }

  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override {
    {
      const std::lock_guard lock(mutex_);
      newest_plane_ = plane;
      if (!plane_wanted_) return;
      plane_queue_.put(plane);
      counters_.planes_replaced = plane_queue_.replaced();
    }
    port_->wake();
  }

  void stop() override {
    if (!thread_.joinable()) return;
    stopping_ = true;
    port_->wake();
    thread_.join();
    port_->close();
    end_stream();
    set_listening(HostListening::no);
    sending_ = receiving_ = false;
  }

  LinkCounters counters() const override {
    const std::lock_guard lock(mutex_);
    return {.clients = listening_ ? 1U : 0U,
            .coalesced = coalesced_,
            .messages_refused =
                counters_.from_host.refused() + counters_.invalid_requests + counters_.plane_requests_refused};
  }
  UsbGadgetCounters usb_counters() const override {
    const std::lock_guard lock(mutex_);
    return counters_;
  }
  std::string_view name() const override { return "usb_gadget"; }
  std::string address() const override { return "usb:"; }

 private:
  enum class HostListening { yes, no };

  void run() {
    while (!stopping_) {
      on(port_->wait(until_due()));
      on_time({monotonic_now_ns()});
      serve();
    }
  }

  [[nodiscard]] Duration until_due() const {
    const ProbeTime now{monotonic_now_ns()};
    Duration wait{1'000'000'000};
    if (enabled_ && now < resume_at_) wait = std::min(wait, resume_at_ - now);
    return wait;
  }

  void on(const PortEvent& event) {
    switch (event.kind) {
      case PortEvent::Kind::enabled:
        end_stream();
        enabled_ = true;
        suspended_ = false;
        resume_at_ = {};
        break;
      case PortEvent::Kind::disabled:
        end_stream();
        enabled_ = false;
        break;
      case PortEvent::Kind::suspended:
      case PortEvent::Kind::resumed:
        suspended_ = event.kind == PortEvent::Kind::suspended;
        break;
      case PortEvent::Kind::sent:
        on_sent(event);
        break;
      case PortEvent::Kind::received:
        on_received(event);
        break;
      case PortEvent::Kind::woken:
      case PortEvent::Kind::timeout:
        break;
    }
  }

  void on_time(ProbeTime now) {
    if (last_request_ && now - *last_request_ > kListenerTimeout) {
      last_request_.reset();
      set_listening(HostListening::no);
    }
  }

  /// Discards the state of the byte stream: the next host has not sent a request yet.
  void end_stream() {
    reader_.begin_stream();
    responses_.clear();
    plane_requested_.reset();
    last_request_.reset();
    set_listening(HostListening::no);
  }

  void set_listening(HostListening listening) {
    const std::lock_guard lock(mutex_);
    listening_ = listening == HostListening::yes;
    if (!listening_ && newest_) {
      newest_.reset();
      ++counters_.descriptors_without_listener;
    }
    if (!listening_) {
      plane_wanted_ = false;
      plane_queue_.clear();
    }
    counters_.from_host = reader_.counters();
  }

  void on_sent(const PortEvent& event) {
    sending_ = false;
    if (event.error == 0 && event.bytes == frame_.size()) return;
    send_failed();
  }

  void on_received(const PortEvent& event) {
    receiving_ = false;
    if (event.error != 0) {
      pause();
      return;
    }
    const FrameReader::FrameCallback take = [this](const LinkFrame& frame) { handle_request(frame); };
    reader_.push(std::span(received_).first(std::min(event.bytes, received_.size())), take);
    // A transfer that filled the buffer may continue in the next one.
    if (event.bytes < received_.size()) reader_.end_transfer(take);
    const std::lock_guard lock(mutex_);
    counters_.from_host = reader_.counters();
  }

  void handle_request(const LinkFrame& frame) {
    std::vector<std::byte> response;
    const bool request = frame.kind == FrameKind::request;
    const StartPlaneStream start_planes = [this] { return start_plane_stream(); };
    if (!request || !answer_link_request(frame.payload, commands_, response, start_planes).ok()) {
      const std::lock_guard lock(mutex_);
      ++counters_.invalid_requests;
      return;
    }
    responses_.push_back(std::move(response));
    const bool too_many = responses_.size() > kMaxResponses;
    if (too_many) responses_.pop_front();
    last_request_ = {monotonic_now_ns()};
    const std::lock_guard lock(mutex_);
    ++counters_.requests;
    if (too_many) ++counters_.responses_dropped;
    listening_ = true;
  }

  /// The host gets the plane that is known, whole, and then every update.
  Status start_plane_stream() {
    const ProbeTime now{monotonic_now_ns()};
    const bool early = plane_requested_ && now - *plane_requested_ < kPlaneRepeat;
    const std::lock_guard lock(mutex_);
    if (early) {
      ++counters_.plane_requests_refused;
      return {StatusCode::resource_exhausted, "the plane was requested less than a second ago; request it later"};
    }
    plane_requested_ = now;
    plane_wanted_ = true;
    plane_queue_.clear();
    if (newest_plane_) plane_queue_.put(newest_plane_);
    return {};
  }

  /// Starts transfers in idle directions.
  void serve() {
    if (!enabled_ || ProbeTime{monotonic_now_ns()} < resume_at_) return;
    if (!receiving_) {
      receiving_ = port_->begin_receive(received_);
      if (!receiving_) pause();
    }
    // While the bus is suspended, the descriptor stays in its slot, where a newer one replaces it.
    if (!sending_ && !suspended_) send_next();
  }

  /// Responses first, because the host measures the round-trip time. A message of a plane goes between two descriptors,
  /// so that a descriptor waits for one such message at most, and a host that reads slowly gets both.
  void send_next() {
    if (!responses_.empty()) {
      begin_send(FrameKind::response, responses_.front());
      responses_.pop_front();
      return;
    }
    EncodedMessage message;
    FrameKind kind = FrameKind::plane;
    {
      const std::lock_guard lock(mutex_);
      if (!newest_ || last_sent_ == FrameKind::descriptor) message = plane_queue_.take();
      if (!message) {
        kind = FrameKind::descriptor;
        message.swap(newest_);
      }
    }
    if (message) begin_send(kind, *message);
  }

  void begin_send(FrameKind kind, std::span<const std::byte> message) {
    // All kinds are within the size limits. A message that is not would use no sequence number.
    if (!writer_.write(kind, message, frame_).ok()) return;
    // A response between two descriptors changes nothing about whose turn it is.
    if (kind != FrameKind::response) last_sent_ = kind;
    sending_kind_ = kind;
    {
      const std::lock_guard lock(mutex_);
      counters_.frames_begun = writer_.sequence();
      if (kind == FrameKind::descriptor) ++counters_.descriptors_begun;
      if (kind == FrameKind::plane) ++counters_.plane_messages_begun;
    }
    sending_ = port_->begin_send(frame_);
    if (sending_) return;
    send_failed();
  }

  void send_failed() {
    pause();
    const std::lock_guard lock(mutex_);
    ++counters_.frames_failed;
    if (sending_kind_ == FrameKind::plane) plane_queue_.require_whole();
  }

  void pause() { resume_at_ = ProbeTime{monotonic_now_ns()} + kPause; }

  const std::unique_ptr<GadgetPort> port_;
  Commands& commands_;

  // Used by the link's thread only.
  FrameReader reader_;
  FrameWriter writer_;
  std::vector<std::byte> received_, frame_;  ///< Owned by the port while a transfer is in progress.
  std::deque<std::vector<std::byte>> responses_;
  std::optional<ProbeTime> last_request_;
  std::optional<ProbeTime> plane_requested_;  ///< When the host's last accepted request of the plane came.
  FrameKind last_sent_ = FrameKind::plane;    ///< Kind of the last frame that was no response.
  FrameKind sending_kind_ = FrameKind::response;
  ProbeTime resume_at_;
  bool enabled_ = false, suspended_ = false, sending_ = false, receiving_ = false;

  mutable std::mutex mutex_;
  EncodedDescriptor newest_;
  std::shared_ptr<const EncodedPlane> newest_plane_;  ///< For a host that requests it later; null: none.
  PlaneQueue plane_queue_;                            ///< Empty while no host wants planes.
  bool plane_wanted_ = false;
  bool listening_ = false;
  std::uint64_t coalesced_ = 0;
  UsbGadgetCounters counters_;

  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(const UsbGadgetConfig& config, Commands& commands) {
  return make_usb_gadget_link(make_ffs_port([mount = config.functionfs_mount] { return open_ffs(mount); }),
                              std::random_device{}(), commands);
}

std::unique_ptr<UsbGadgetLink> make_usb_gadget_link(std::unique_ptr<GadgetPort> port, std::uint32_t session,
                                                    Commands& commands) {
  return std::make_unique<GadgetLink>(std::move(port), session, commands);
}

}  // namespace lightwell

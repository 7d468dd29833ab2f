// USB connection: one thread that receives from a probe and reconnects.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/backoff.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/link_message.hpp>

#include "core/link_requests.hpp"
#include "core/source.hpp"
#include "core/usb_transport.hpp"

namespace lightwell::core {
namespace {

/// A response takes a few milliseconds; after this time the frame of the request or of the response counts as lost.
constexpr Duration kResponseTimeout{250'000'000};

/// The request of the stream of captured planes, of one connection.
struct PlaneRequest {
  enum class State : std::uint8_t {
    due,      ///< To be sent at `at`.
    pending,  ///< Sent at `at`.
    done,     ///< Accepted, or refused for good.
  };
  State state = State::due;
  std::uint32_t id = 0;  ///< While pending.
  HostTime at;
};
/// Pause before another request of planes after one that failed; the probe accepts one a second.
constexpr Duration kPlaneRetry{1'000'000'000};

/// State of one connection, from open() to close().
struct UsbConnection {
  HostTime last_received;
  HostTime next_info;
  std::optional<std::uint32_t> info_id;  ///< Identifier of the pending Info request.
  std::uint32_t sent_id = 0;             ///< Identifier of the request that is being sent.
  HostTime info_sent;
  PlaneRequest plane;
  int round_trips = 0;
  bool sending = false, over = false;
};

class UsbSource final : public Source {
 public:
  UsbSource(std::unique_ptr<UsbTransport> transport, const UsbAddress& address, const ProbeOptions& options,
            DescriptorReceiver& receiver)
      : Source(address.serial.empty() ? "usb" : "usb:" + address.serial),
        transport_(std::move(transport)),
        address_(address),
        options_(options),
        receiver_(receiver),
        backoff_(options.retry_min, options.retry_max, std::random_device{}()),
        writer_(std::random_device{}()),
        thread_([this] { follow(); }) {}

  ~UsbSource() override {
    stopping_ = true;
    transport_->wake();
    thread_.join();
  }

 private:
  [[nodiscard]] Result<LinkResponse> request(const LinkCommand& command) override {
    const Result<LinkResponse> answer =
        requests_.send_request(command, options_.connect_timeout, [this] { transport_->wake(); });
    const Status status = answer ? answer->status : answer.status();
    // A request without arguments is invalid only for a probe that does not know it.
    if (std::holds_alternative<GetConfig>(command) && status.code() == StatusCode::invalid_argument)
      return no_get_config();
    return status.ok() ? answer : status.in(name());
  }

  void follow() {
    while (!stopping_) {
      receiver_.set_state(LinkState::connecting);
      if (const Status opened = transport_->open(address_.serial); !opened.ok())
        receiver_.report_error(opened.message());
      else if (run_connection())
        backoff_.reset();
      transport_->close();
      if (stopping_) break;
      receiver_.set_state(LinkState::waiting);
      pause(backoff_.next());
    }
    requests_.link_down();
  }

  /// Waits until the pause is over or a probe is plugged in.
  void pause(Duration duration) {
    const HostTime end = HostTime{monotonic_now_ns()} + duration;
    for (HostTime now{monotonic_now_ns()}; now < end && !stopping_; now = {monotonic_now_ns()})
      if (transport_->wait(end - now).kind == UsbEvent::Kind::arrived) {
        backoff_.reset();
        return;
      }
  }

  /// Runs one connection until its end; true if the probe responded.
  bool run_connection() {
    // An unfinished frame of the last connection is dropped; missing frames are counted by their sequence numbers.
    reader_.begin_stream();
    UsbConnection c;
    c.last_received = c.next_info = {monotonic_now_ns()};
    while (!c.over && !stopping_) {
      on_time(c, {monotonic_now_ns()});
      if (c.over) break;
      if (!c.sending) send_next(c);
      on_event(c, transport_->wait(due(c) - HostTime{monotonic_now_ns()}));
    }
    requests_.link_down();
    return c.round_trips > 0;
  }

  [[nodiscard]] HostTime due(const UsbConnection& c) const {
    const HostTime silent = c.last_received + options_.silence_limit;
    const HostTime info = c.info_id ? c.info_sent + kResponseTimeout : c.next_info;
    const bool pending = c.plane.state == PlaneRequest::State::pending;
    // While a transfer is in progress, its end is awaited.
    if (!wants_plane(c) || (c.sending && !pending)) return std::min(silent, info);
    return std::min({silent, info, pending ? c.plane.at + kResponseTimeout : c.plane.at});
  }

  /// Planes are requested when the probe is known to respond.
  [[nodiscard]] bool wants_plane(const UsbConnection& c) const {
    return options_.plane == PlaneReception::receive && c.round_trips > 0 && c.plane.state != PlaneRequest::State::done;
  }

  void on_time(UsbConnection& c, HostTime now) {
    if (now >= c.last_received + options_.silence_limit) {
      receiver_.report_error(name() + ": no data from the probe within silence_limit");
      c.over = true;
    }
    if (c.info_id && now >= c.info_sent + kResponseTimeout) {
      c.info_id.reset();
      c.next_info = now;
    }
    if (c.plane.state == PlaneRequest::State::pending && now >= c.plane.at + kResponseTimeout) retry_plane(c, now);
  }

  static void retry_plane(UsbConnection& c, HostTime now) {
    c.plane = {PlaneRequest::State::due, 0, now + kPlaneRetry};
  }

  void send_next(UsbConnection& c) {
    const HostTime now{monotonic_now_ns()};
    const bool asks = !c.info_id && now >= c.next_info;
    if (asks) {
      c.info_id = requests_.new_id();
      c.info_sent = now;
      c.sent_id = *c.info_id;
      encode_info_request(*c.info_id, message_);
    } else if (wants_plane(c) && c.plane.state == PlaneRequest::State::due && now >= c.plane.at) {
      c.plane = {PlaneRequest::State::pending, requests_.new_id(), now};
      c.sent_id = c.plane.id;
      encode_plane_request(c.plane.id, message_);
    } else if (const auto id = requests_.next(message_)) {
      c.sent_id = *id;
    } else {
      return;
    }
    // Requests of the SDK never exceed the limit.
    if (!writer_.write(FrameKind::request, message_, frame_).ok()) return;
    if (const Status started = transport_->begin_send(frame_); started.ok())
      c.sending = true;
    else
      // The loss of the connection is reported by an event, after the data received before it.
      on_not_sent(c, started.message());
  }

  void on_event(UsbConnection& c, const UsbEvent& event) {
    switch (event.kind) {
      case UsbEvent::Kind::received:
        on_received(c, event);
        break;
      case UsbEvent::Kind::sent:
        c.sending = false;
        if (!event.error.empty()) on_not_sent(c, event.error);
        break;
      case UsbEvent::Kind::failed:
      case UsbEvent::Kind::gone:
        receiver_.report_error(name() + ": " + event.error);
        c.over = event.kind == UsbEvent::Kind::gone;
        break;
      case UsbEvent::Kind::arrived:
      case UsbEvent::Kind::woken:
      case UsbEvent::Kind::timeout:
        break;
    }
  }

  void on_not_sent(UsbConnection& c, const std::string& error) {
    receiver_.report_error(name() + ": " + error);
    if (c.plane.state == PlaneRequest::State::pending && c.plane.id == c.sent_id)
      return retry_plane(c, {monotonic_now_ns()});
    if (c.info_id != c.sent_id) {
      requests_.answered({c.sent_id, Status(StatusCode::unavailable, error), {}, {}, {}});
      return;
    }
    c.info_id.reset();
    c.next_info = HostTime{monotonic_now_ns()} + kFirstInfoPeriod;
  }

  void on_received(UsbConnection& c, const UsbEvent& event) {
    const HostTime received{monotonic_now_ns()};
    const FrameReader::FrameCallback take = [&](const LinkFrame& frame) { on_frame(c, frame, received); };
    reader_.push(event.bytes, take);
    if (event.transfer_end == UsbEvent::TransferEnd::of_transfer) reader_.end_transfer(take);
    const FrameCounters& counters = reader_.counters();
    receiver_.set_frame_counters(counters.lost, counters.refused() + misplaced_);
    // Time spent in the application's callback does not count as silence of the probe.
    c.last_received = {monotonic_now_ns()};
  }

  void on_frame(UsbConnection& c, const LinkFrame& frame, HostTime received) {
    if (frame.session != session_) {
      // The probe restarted; its clock may have been reset, too, and the revisions of its plane.
      session_ = frame.session;
      clock_.forget();
      receiver_.reset_sequence();
      receiver_.restart_plane();
      c.plane = {};
    }
    if (frame.kind == FrameKind::descriptor) {
      // A probe responds before it sends descriptors, so only the first descriptors can arrive while the clock is
      // unknown.
      if (clock_.known())
        receiver_.receive(frame.payload, received,
                          [&](const CaptureTime& time) { return clock_.mapped(time.mid_exposure, received); });
      return;
    }
    if (frame.kind == FrameKind::plane && options_.plane == PlaneReception::receive)
      return receiver_.receive_plane(frame.payload, received);
    if (frame.kind != FrameKind::response) {
      ++misplaced_;
      return;
    }
    const Result<LinkResponse> response = decode_link_response(frame.payload);
    if (!response)
      ++misplaced_;
    else if (c.info_id == response->id)
      on_info(c, *response, received);
    else if (c.plane.state == PlaneRequest::State::pending && c.plane.id == response->id)
      on_plane_response(c, response->status, received);
    else
      requests_.answered(*response);
  }

  void on_plane_response(UsbConnection& c, const Status& status, HostTime received) {
    if (status.code() == StatusCode::resource_exhausted) return retry_plane(c, received);
    c.plane.state = PlaneRequest::State::done;
    // The request has no argument, so that it is invalid only for a probe that does not know it.
    if (!status.ok())
      receiver_.report_error(name() +
                             ": the probe's firmware is older than this SDK and sends no planes by USB; update "
                             "lightwelld there");
  }

  void on_info(UsbConnection& c, const LinkResponse& response, HostTime received) {
    c.info_id.reset();
    c.next_info = received + (++c.round_trips < kFirstRoundTrips ? kFirstInfoPeriod : kInfoPeriod);
    if (!response.status.ok() || !response.info) {
      const Status error = response.status.ok() ? unexpected_response() : response.status.in(name());
      return receiver_.report_error(error.message());
    }
    const InfoAnswer& answer = *response.info;
    clock_.add(c.info_sent, answer.clock_now, received);
    receiver_.set_state(LinkState::connected);
    requests_.link_up();
    // Last, because this lets connect() return.
    receiver_.describe(probe_info(answer.status, clock_, received));
  }

  const std::unique_ptr<UsbTransport> transport_;
  const UsbAddress address_;
  const ProbeOptions options_;
  DescriptorReceiver& receiver_;
  LinkRequests requests_;

  // Used by the reader thread only.
  Backoff backoff_;
  FrameReader reader_;
  FrameWriter writer_;
  ClockMap clock_;
  std::optional<std::uint32_t> session_;
  std::uint64_t misplaced_ = 0;  ///< Intact frames of a kind that the probe must not send.
  std::vector<std::byte> message_, frame_;

  std::atomic<bool> stopping_{false};
  std::thread thread_;  // last, because it uses all members above
};

}  // namespace

std::unique_ptr<Source> make_usb_source(std::unique_ptr<UsbTransport> transport, const UsbAddress& address,
                                        const ProbeOptions& options, DescriptorReceiver& receiver) {
  return std::make_unique<UsbSource>(std::move(transport), address, options, receiver);
}

Result<std::unique_ptr<Source>> make_source(const UsbAddress& address, const ProbeOptions& options,
                                            DescriptorReceiver& receiver) {
  Result<std::unique_ptr<UsbTransport>> transport = make_libusb_transport();
  if (!transport) return transport.status();
  return make_usb_source(std::move(*transport), address, options, receiver);
}

}  // namespace lightwell::core

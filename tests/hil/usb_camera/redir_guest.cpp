#include "hil/usb_camera/redir_guest.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <poll.h>
#include <usbredirparser.h>

#include <sys/socket.h>

namespace lightwell::usb_camera::bench {

namespace {

TransferStatus status_of(std::uint8_t wire) {
  switch (wire) {
    case usb_redir_success:
      return TransferStatus::success;
    case usb_redir_cancelled:
      return TransferStatus::cancelled;
    case usb_redir_stall:
      return TransferStatus::stalled;
    default:
      return TransferStatus::refused;
  }
}

}  // namespace

struct RedirGuest::Callbacks {
  static RedirGuest& guest(void* self) { return *static_cast<RedirGuest*>(self); }

  static void log(void*, int, const char*) {}
  static int read(void* self, std::uint8_t* data, int count) {
    const ssize_t n = ::recv(guest(self).socket_.get(), data, static_cast<std::size_t>(count), MSG_DONTWAIT);
    if (n > 0) return static_cast<int>(n);
    return n < 0 && errno == EAGAIN ? 0 : -1;
  }
  static int write(void* self, std::uint8_t* data, int count) {
    const ssize_t n =
        ::send(guest(self).socket_.get(), data, static_cast<std::size_t>(count), MSG_DONTWAIT | MSG_NOSIGNAL);
    return n >= 0 ? static_cast<int>(n) : errno == EAGAIN ? 0 : -1;
  }
  static void connect(void* self, usb_redir_device_connect_header* h) {
    RedirGuest& g = guest(self);
    g.connected = true;
    ++g.connects;
    g.vendor = h->vendor_id;
    g.product = h->product_id;
    g.speed = h->speed;
  }
  static void disconnect(void* self) {
    guest(self).connected = false;
    ++guest(self).disconnects;
  }
  static void interface_info(void* self, usb_redir_interface_info_header* h) {
    guest(self).interfaces = static_cast<int>(h->interface_count);
  }
  static void ep_info(void* self, usb_redir_ep_info_header* h) {
    guest(self).stream_endpoint_type = h->type[17];
    guest(self).stream_packet = h->max_packet_size[17];
  }
  static void configuration(void* self, std::uint64_t id, usb_redir_configuration_status_header* h) {
    guest(self).configuration_results_[id] = h->status == usb_redir_success;
  }
  static void alt(void*, std::uint64_t, usb_redir_alt_setting_status_header*) {}
  static void iso_status(void* self, std::uint64_t, usb_redir_iso_stream_status_header* h) {
    if (h->status == usb_redir_inval) ++guest(self).refusals;
  }
  static void interrupt_status(void* self, std::uint64_t, usb_redir_interrupt_receiving_status_header* h) {
    if (h->status == usb_redir_inval) ++guest(self).refusals;
  }
  static void streams_status(void*, std::uint64_t, usb_redir_bulk_streams_status_header*) {}
  static void receiving_status(void*, std::uint64_t, usb_redir_bulk_receiving_status_header*) {}
  static void control(void* self, std::uint64_t id, usb_redir_control_packet_header* h, std::uint8_t* data, int count) {
    SetupReply reply{h->status != usb_redir_success, {}};
    if (data != nullptr) {
      reply.data.assign(data, data + count);
      usbredirparser_free_packet_data(guest(self).parser_.get(), data);
    }
    guest(self).control_results_[id] = std::move(reply);
  }
  static void bulk(void* self, std::uint64_t id, usb_redir_bulk_packet_header* h, std::uint8_t* data, int count) {
    RedirGuest& g = guest(self);
    g.bulk_results[id] = status_of(h->status);
    if (g.video != nullptr)
      g.video->complete(id, status_of(h->status), {data, data == nullptr ? 0 : static_cast<std::size_t>(count)});
    if (data != nullptr) usbredirparser_free_packet_data(g.parser_.get(), data);
  }
  static void iso(void* self, std::uint64_t, usb_redir_iso_packet_header*, std::uint8_t* data, int) {
    if (data != nullptr) usbredirparser_free_packet_data(guest(self).parser_.get(), data);
  }
  static void interrupt(void* self, std::uint64_t, usb_redir_interrupt_packet_header*, std::uint8_t* data, int) {
    if (data != nullptr) usbredirparser_free_packet_data(guest(self).parser_.get(), data);
  }
};

void RedirGuest::Destroy::operator()(usbredirparser* parser) const { usbredirparser_destroy(parser); }

RedirGuest::RedirGuest(FileDescriptor socket) : socket_(std::move(socket)), parser_(usbredirparser_create()) {
  using C = Callbacks;
  usbredirparser& p = *parser_;
  p.priv = this;
  p.log_func = C::log;
  p.read_func = C::read;
  p.write_func = C::write;
  p.device_connect_func = C::connect;
  p.device_disconnect_func = C::disconnect;
  p.interface_info_func = C::interface_info;
  p.ep_info_func = C::ep_info;
  p.configuration_status_func = C::configuration;
  p.alt_setting_status_func = C::alt;
  p.iso_stream_status_func = C::iso_status;
  p.interrupt_receiving_status_func = C::interrupt_status;
  p.bulk_streams_status_func = C::streams_status;
  p.bulk_receiving_status_func = C::receiving_status;
  p.control_packet_func = C::control;
  p.bulk_packet_func = C::bulk;
  p.iso_packet_func = C::iso;
  p.interrupt_packet_func = C::interrupt;
  std::array<std::uint32_t, USB_REDIR_CAPS_SIZE> capabilities{};
  for (const int capability : {usb_redir_cap_connect_device_version, usb_redir_cap_filter,
                               usb_redir_cap_device_disconnect_ack, usb_redir_cap_ep_info_max_packet_size,
                               usb_redir_cap_64bits_ids, usb_redir_cap_32bits_bulk_length, usb_redir_cap_bulk_streams})
    usbredirparser_caps_set_cap(capabilities.data(), capability);
  usbredirparser_init(parser_.get(), "a test's guest", capabilities.data(), USB_REDIR_CAPS_SIZE, 0);
}

RedirGuest::~RedirGuest() = default;

bool RedirGuest::step(int timeout_ms) {
  pollfd fd{socket_.get(), POLLIN, 0};
  while (usbredirparser_has_data_to_write(parser_.get()) > 0) {
    const int before = usbredirparser_has_data_to_write(parser_.get());
    if (usbredirparser_do_write(parser_.get()) < 0) return !(gone = true);
    if (usbredirparser_has_data_to_write(parser_.get()) == before) {
      fd.events |= POLLOUT;
      break;
    }
  }
  if (::poll(&fd, 1, timeout_ms) < 0) return false;
  if (usbredirparser_do_read(parser_.get()) != 0) gone = true;
  return !gone;
}

bool RedirGuest::until(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    if (!step(20)) return condition();
  }
  return true;
}

std::optional<SetupReply> RedirGuest::control(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                                              std::uint16_t index, std::uint16_t length, const Bytes& data) {
  const std::uint64_t id = next_id_++;
  usb_redir_control_packet_header h{};
  h.endpoint = type & 0x80;
  h.requesttype = type;
  h.request = request;
  h.value = value;
  h.index = index;
  h.length = length;
  Bytes copy = data;
  usbredirparser_send_control_packet(parser_.get(), id, &h, copy.empty() ? nullptr : copy.data(),
                                     static_cast<int>(copy.size()));
  if (!until([&] { return control_results_.contains(id); })) return std::nullopt;
  return control_results_[id];
}

bool RedirGuest::set_configuration(std::uint8_t number) {
  const std::uint64_t id = next_id_++;
  usb_redir_set_configuration_header h{number};
  usbredirparser_send_set_configuration(parser_.get(), id, &h);
  return until([&] { return configuration_results_.contains(id); }) && configuration_results_[id];
}

bool RedirGuest::commit(std::uint8_t format, std::uint8_t frame, std::uint32_t interval) {
  Bytes asked = {1, 0, format, frame};
  put(asked, interval, 4);
  asked.resize(34);
  const auto set = control(0x21, 1, 0x0100, 1, 34, asked);
  if (!set || set->stalled) return false;
  const auto got = control(0xA1, 0x81, 0x0100, 1, 34);
  if (!got || got->stalled || got->data.size() != 34) return false;
  payload_bytes_ = get(got->data, 22, 4);
  const auto done = control(0x21, 1, 0x0200, 1, 34, got->data);
  return done && !done->stalled;
}

bool RedirGuest::stream(std::size_t frames, std::size_t transfers, std::size_t length) {
  if (video == nullptr) video = std::make_unique<VideoHost>(payload_bytes_, length);
  const std::size_t wanted = video->frames.size() + frames;
  return until([&] {
    while (video->queued.size() < transfers) {
      video->queued.push_back(next_id_);
      submit(next_id_++, length);
    }
    return video->frames.size() >= wanted;
  });
}

void RedirGuest::submit(std::uint64_t id, std::size_t length, std::uint8_t endpoint) {
  usb_redir_bulk_packet_header h{};
  h.endpoint = endpoint;
  h.length = static_cast<std::uint16_t>(length);
  h.length_high = static_cast<std::uint16_t>(length >> 16);
  usbredirparser_send_bulk_packet(parser_.get(), id, &h, nullptr, 0);
}

void RedirGuest::cancel(std::uint64_t id) { usbredirparser_send_cancel_data_packet(parser_.get(), id); }

void RedirGuest::send_raw(const Bytes& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = ::send(socket_.get(), bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (n <= 0) return;
    at += static_cast<std::size_t>(n);
  }
}

void RedirGuest::send_unsupported_requests() {
  usb_redir_start_iso_stream_header iso{};
  iso.endpoint = 0x81;
  usbredirparser_send_start_iso_stream(parser_.get(), 900, &iso);
  usb_redir_stop_iso_stream_header stop{};
  stop.endpoint = 0x81;
  usbredirparser_send_stop_iso_stream(parser_.get(), 901, &stop);
  usb_redir_start_interrupt_receiving_header start{};
  start.endpoint = 0x81;
  usbredirparser_send_start_interrupt_receiving(parser_.get(), 902, &start);
  usb_redir_stop_interrupt_receiving_header end{};
  end.endpoint = 0x81;
  usbredirparser_send_stop_interrupt_receiving(parser_.get(), 903, &end);
}

void RedirGuest::reset_bus() { usbredirparser_send_reset(parser_.get()); }

}  // namespace lightwell::usb_camera::bench

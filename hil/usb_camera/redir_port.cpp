#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <span>
#include <usbredirparser.h>
#include <utility>

#include <sys/socket.h>

#include "usb_camera/server.hpp"

namespace lightwell::usb_camera {
namespace {

// Limit of pending output, more than all transfers that a well-behaved host queues.
constexpr std::uint64_t kMaxPendingBytes = std::uint64_t{8} << 20;
// Limit of input per read(), so that one connection cannot block the others.
constexpr std::size_t kMaxReadBytes = std::size_t{64} << 10;

// Endpoints are numbered as in libusbredirhost: 0 to 15 towards the device, 16 to 31 towards the host.
constexpr std::size_t kControlOut = 0, kControlIn = 16, kStreamingIn = 17;
constexpr std::uint16_t kControlPacket = 64;

/// In the order of TransferStatus.
constexpr std::array<std::uint8_t, 4> kWireStatus = {usb_redir_success, usb_redir_cancelled, usb_redir_stall,
                                                     usb_redir_inval};

/// The parser's functions take non-const pointers to data that they do not change.
std::uint8_t* unchanged(std::span<const std::uint8_t> data) {
  return data.empty() ? nullptr : const_cast<std::uint8_t*>(data.data());
}

}  // namespace

/// The parser's callbacks. The parser does not test whether a callback is set, so there is one for everything that a
/// usb-guest can send; otherwise a host could crash the program.
struct RedirPort::Callbacks {
  static RedirPort& port(void* self) { return *static_cast<RedirPort*>(self); }
  static usbredirparser* parser(void* self) { return port(self).parser_.get(); }

  /// Frees the data of a packet.
  struct Data {
    void* self;
    std::uint8_t* data;
    ~Data() {
      if (data != nullptr) usbredirparser_free_packet_data(parser(self), data);
    }
    Data(void* s, std::uint8_t* d) : self(s), data(d) {}
    Data(const Data&) = delete;
    Data& operator=(const Data&) = delete;
  };

  static void log(void*, int, const char*) {}

  static int read(void* self, std::uint8_t* data, int count) {
    // The parser reads until no data is left. Without a limit, a flood of requests would keep it from returning, and
    // its responses would grow without bound.
    RedirPort& p = port(self);
    const std::size_t most = std::min(static_cast<std::size_t>(count), p.may_read_);
    if (most == 0 || !p.wants_read()) return 0;
    const ssize_t n = ::recv(p.socket_.get(), data, most, MSG_DONTWAIT);
    if (n > 0) {
      p.may_read_ -= static_cast<std::size_t>(n);
      return static_cast<int>(n);
    }
    return n < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : -1;
  }

  static int write(void* self, std::uint8_t* data, int count) {
    const ssize_t n =
        ::send(port(self).socket_.get(), data, static_cast<std::size_t>(count), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n >= 0) return static_cast<int>(n);
    return errno == EAGAIN || errno == EINTR ? 0 : -1;
  }

  static void hello(void* self, usb_redir_hello_header*) {
    port(self).greeted_ = true;
    port(self).announce();
  }

  static void reset(void* self) { port(self).device_.bus_reset(); }

  static void set_configuration(void* self, std::uint64_t id, usb_redir_set_configuration_header* header) {
    RedirPort& p = port(self);
    const bool done = p.device_.set_configuration(header->configuration);
    if (done) p.describe();
    usb_redir_configuration_status_header status{};
    status.status = done ? usb_redir_success : usb_redir_stall;
    status.configuration = p.device_.configuration();
    usbredirparser_send_configuration_status(parser(self), id, &status);
  }

  static void get_configuration(void* self, std::uint64_t id) {
    usb_redir_configuration_status_header status{};
    status.configuration = port(self).device_.configuration();
    usbredirparser_send_configuration_status(parser(self), id, &status);
  }

  static void set_alt_setting(void* self, std::uint64_t id, usb_redir_set_alt_setting_header* header) {
    const bool done = port(self).device_.set_interface(header->interface, header->alt);
    if (done) port(self).describe();
    alt_status(self, id, header->interface, done);
  }

  static void get_alt_setting(void* self, std::uint64_t id, usb_redir_get_alt_setting_header* header) {
    alt_status(self, id, header->interface, header->interface <= kStreamingInterface);
  }

  static void alt_status(void* self, std::uint64_t id, std::uint8_t interface, bool done) {
    usb_redir_alt_setting_status_header status{};
    status.status = done ? usb_redir_success : usb_redir_stall;
    status.interface = interface;
    usbredirparser_send_alt_setting_status(parser(self), id, &status);
  }

  static void control(void* self, std::uint64_t id, usb_redir_control_packet_header* header, std::uint8_t* data,
                      int count) {
    const Data owned(self, data);
    RedirPort& p = port(self);
    const SetupPacket packet{header->requesttype, header->request, header->value, header->index, header->length};
    const std::span<const std::uint8_t> given(data, data == nullptr ? 0 : static_cast<std::size_t>(count));
    const SetupReply reply = p.device_.setup(packet, given, p);
    usb_redir_control_packet_header answer = *header;
    answer.status = reply.stalled ? usb_redir_stall : usb_redir_success;
    const bool to_host = (header->endpoint & 0x80) != 0;
    if (reply.stalled) answer.length = 0;
    if (!to_host || reply.stalled) {
      usbredirparser_send_control_packet(parser(self), id, &answer, nullptr, 0);
      return;
    }
    answer.length = static_cast<std::uint16_t>(reply.data.size());
    usbredirparser_send_control_packet(parser(self), id, &answer, unchanged(reply.data),
                                       static_cast<int>(reply.data.size()));
  }

  static void bulk(void* self, std::uint64_t id, usb_redir_bulk_packet_header* header, std::uint8_t* data, int) {
    const Data owned(self, data);
    RedirPort& p = port(self);
    if (header->endpoint == kStreamingEndpoint && p.device_.configuration() != 0) {
      const std::size_t length = header->length | static_cast<std::size_t>(header->length_high) << 16;
      p.device_.stream().submit(id, length, p);
      return;
    }
    usb_redir_bulk_packet_header answer = *header;
    answer.status = usb_redir_inval;
    answer.length = answer.length_high = 0;
    usbredirparser_send_bulk_packet(parser(self), id, &answer, nullptr, 0);
  }

  static void cancel(void* self, std::uint64_t id) { port(self).device_.stream().cancel(id, port(self)); }

  // Not supported: isochronous and interrupt endpoints, USB 3 streams, buffered bulk.
  template <class Header>
  static void drop(void* self, std::uint64_t, Header*, std::uint8_t* data, int) {
    const Data owned(self, data);
  }
  template <class Header>
  static void refuse_iso(void* self, std::uint64_t id, Header* h) {
    usb_redir_iso_stream_status_header status{};
    status.status = usb_redir_inval;
    status.endpoint = h->endpoint;
    usbredirparser_send_iso_stream_status(parser(self), id, &status);
  }
  template <class Header>
  static void refuse_interrupt(void* self, std::uint64_t id, Header* h) {
    usb_redir_interrupt_receiving_status_header status{};
    status.status = usb_redir_inval;
    status.endpoint = h->endpoint;
    usbredirparser_send_interrupt_receiving_status(parser(self), id, &status);
  }
  template <class Header>
  static void ignore(void*, std::uint64_t, Header*) {}
  static void ignore(void*) {}
  static void filter(void*, usbredirfilter_rule* rules, int) { std::free(rules); }
};

void RedirPort::Destroy::operator()(usbredirparser* parser) const { usbredirparser_destroy(parser); }

RedirPort::RedirPort(Device& device, FileDescriptor socket, bool plugged)
    : device_(device), socket_(std::move(socket)), plugged_(plugged), parser_(usbredirparser_create()) {
  using C = Callbacks;
  usbredirparser& p = *parser_;
  p.priv = this;
  p.log_func = C::log;
  p.read_func = C::read;
  p.write_func = C::write;
  p.hello_func = C::hello;
  p.reset_func = C::reset;
  p.set_configuration_func = C::set_configuration;
  p.get_configuration_func = C::get_configuration;
  p.set_alt_setting_func = C::set_alt_setting;
  p.get_alt_setting_func = C::get_alt_setting;
  p.control_packet_func = C::control;
  p.bulk_packet_func = C::bulk;
  p.iso_packet_func = C::drop;
  p.interrupt_packet_func = C::drop;
  p.buffered_bulk_packet_func = C::drop;
  p.cancel_data_packet_func = C::cancel;
  p.start_iso_stream_func = C::refuse_iso;
  p.stop_iso_stream_func = C::refuse_iso;
  p.start_interrupt_receiving_func = C::refuse_interrupt;
  p.stop_interrupt_receiving_func = C::refuse_interrupt;
  p.alloc_bulk_streams_func = C::ignore;
  p.free_bulk_streams_func = C::ignore;
  p.start_bulk_receiving_func = C::ignore;
  p.stop_bulk_receiving_func = C::ignore;
  p.filter_reject_func = C::ignore;
  p.filter_filter_func = C::filter;
  p.device_disconnect_ack_func = C::ignore;

  std::array<std::uint32_t, USB_REDIR_CAPS_SIZE> capabilities{};
  for (const int capability :
       {usb_redir_cap_connect_device_version, usb_redir_cap_device_disconnect_ack,
        usb_redir_cap_ep_info_max_packet_size, usb_redir_cap_64bits_ids, usb_redir_cap_32bits_bulk_length})
    usbredirparser_caps_set_cap(capabilities.data(), capability);
  usbredirparser_init(parser_.get(), "lightwell-usb-camera", capabilities.data(), USB_REDIR_CAPS_SIZE,
                      usbredirparser_fl_usb_host);
}

RedirPort::~RedirPort() = default;

bool RedirPort::read() {
  may_read_ = kMaxReadBytes;
  return usbredirparser_do_read(parser_.get()) == 0;
}

bool RedirPort::write() {
  return usbredirparser_has_data_to_write(parser_.get()) == 0 || usbredirparser_do_write(parser_.get()) == 0;
}

bool RedirPort::wants_write() const { return usbredirparser_has_data_to_write(parser_.get()) > 0; }

bool RedirPort::wants_read() const {
  return usbredirparser_get_bufferered_output_size(parser_.get()) < kMaxPendingBytes;
}

void RedirPort::plug() {
  plugged_ = true;
  announce();
}

void RedirPort::unplug() {
  plugged_ = false;
  if (announced_) usbredirparser_send_device_disconnect(parser_.get());
  announced_ = false;
}

void RedirPort::describe() {
  usb_redir_interface_info_header interfaces{};
  interfaces.interface_count = 2;
  const std::array<std::uint8_t, 2> numbers = {kControlInterface, kStreamingInterface};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    interfaces.interface[i] = numbers[i];
    interfaces.interface_class[i] = 0x0E;
    interfaces.interface_subclass[i] = static_cast<std::uint8_t>(i + 1);
  }
  usbredirparser_send_interface_info(parser_.get(), &interfaces);

  usb_redir_ep_info_header endpoints{};
  std::memset(endpoints.type, usb_redir_type_invalid, sizeof endpoints.type);
  for (const std::size_t control : {kControlOut, kControlIn}) {
    endpoints.type[control] = usb_redir_type_control;
    endpoints.max_packet_size[control] = kControlPacket;
  }
  endpoints.type[kStreamingIn] = usb_redir_type_bulk;
  endpoints.interface[kStreamingIn] = kStreamingInterface;
  endpoints.max_packet_size[kStreamingIn] = kBulkPacket;
  usbredirparser_send_ep_info(parser_.get(), &endpoints);
}

void RedirPort::announce() {
  if (!plugged_ || !greeted_ || announced_) return;
  announced_ = true;
  describe();
  usb_redir_device_connect_header connect{};
  connect.speed = usb_redir_speed_high;
  connect.device_class = 0xEF;
  connect.device_subclass = 0x02;
  connect.device_protocol = 0x01;
  connect.vendor_id = kVendor;
  connect.product_id = kProduct;
  connect.device_version_bcd = kRelease;
  usbredirparser_send_device_connect(parser_.get(), &connect);
}

void RedirPort::complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) {
  usb_redir_bulk_packet_header header{};
  header.endpoint = kStreamingEndpoint;
  header.status = kWireStatus[static_cast<std::size_t>(status)];
  header.length = static_cast<std::uint16_t>(data.size() & 0xFFFF);
  header.length_high = static_cast<std::uint16_t>(data.size() >> 16);
  usbredirparser_send_bulk_packet(parser_.get(), id, &header, unchanged(data), static_cast<int>(data.size()));
}

}  // namespace lightwell::usb_camera

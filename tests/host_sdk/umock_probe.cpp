#include "host_sdk/umock_probe.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <mutex>
#include <umockdev.h>

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <lightwell/commands.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/text.hpp>
#include <lightwell/usb_ids.hpp>

#include "support/fake_commands.hpp"

namespace lightwell::test {
namespace {

/// A transfer submitted by libusb, which owns both of its buffers.
struct Urb {
  UMockdevIoctlData* urb = nullptr;
  UMockdevIoctlData* buffer = nullptr;
};

void refuse(const char* what, GError* error) {
  std::fprintf(stderr, "umockdev: %s: %s\n", what, error == nullptr ? "" : error->message);
  std::exit(1);
}

/// State of the device from plugging in to unplugging.
struct Device {
  FrameReader reader;
  std::vector<std::byte> frame, answer;
  std::deque<std::vector<std::byte>> to_host;
  std::deque<Urb> reads, done;
  gpointer claimed_by = nullptr;
  bool alive = true;
};

}  // namespace

struct UmockProbe::Port {
  explicit Port(int which) : number(which), node("/dev/bus/usb/001/00" + std::to_string(which + 1)) {}

  const int number;
  const std::string node;
  std::mutex mutex;
  UsbDeviceKind kind;
  std::shared_ptr<Device> device = std::make_shared<Device>();
  FakeCommands commands;
  FrameWriter writer{static_cast<std::uint32_t>(number)};  ///< Of the daemon, which outlives its cable.
  Answering answering = Answering::yes;
  int fail = 0, halts_cleared = 0, interfaces_set = 0, requests = 0;
  bool plugged = false, attached = false;

  static UMockdevTestbed* bed();
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer user);
  [[nodiscard]] std::string sys_path() const { return "/sys/devices/usb1/1-" + std::to_string(number); }
  [[nodiscard]] std::vector<std::uint8_t> descriptors() const;
  void plug_in();
  void unplug();

  // With the lock held; each returns errno, 0 for success.
  int submit(Device& d, UMockdevIoctlData* address);
  int control(const usbdevfs_urb& request, std::span<std::uint8_t> buffer, int& actual) const;
  int reap(Device& d, UMockdevIoctlData* address);
  static int discard(Device& d, UMockdevIoctlData* address);
  void hear(Device& d, std::span<const std::byte> bytes);
};

UMockdevTestbed* UmockProbe::Port::bed() {
  // One per process, never destroyed.
  static UMockdevTestbed* const one = [] {
    UMockdevTestbed* const made = umockdev_testbed_new();
    if (umockdev_in_mock_environment() == FALSE) {
      std::fprintf(stderr, "run this test by ctest, or with LD_PRELOAD=libumockdev-preload.so.0\n");
      std::exit(1);
    }
    return made;
  }();
  return one;
}

std::vector<std::uint8_t> UmockProbe::Port::descriptors() const {
  const auto low = [](unsigned v) { return static_cast<std::uint8_t>(v & 255U); };
  std::vector<std::uint8_t> interfaces;
  const auto add = [&](std::initializer_list<std::uint8_t> bytes) { interfaces.insert(interfaces.end(), bytes); };
  for (int i = 0; i < kind.interfaces_before; ++i) {
    add({9, 4, static_cast<std::uint8_t>(i), 0, 2, 0x0A, 0, 1, 0});
    add({7, 5, 0x86, 2, 0, 2, 0});
    add({7, 5, 0x07, 2, 0, 2, 0});
  }
  add({9, 4, static_cast<std::uint8_t>(kind.interfaces_before), 0, 2, kUsbInterfaceClass, kind.interface_subclass,
       kUsbInterfaceProtocol, 0});
  add({7, 5, kind.out, 2, 0, 2, 0});
  add({7, 5, kind.in, 2, 0, 2, 0});
  std::vector<std::uint8_t> all = {
      18, 1, 0, 2, 0, 0, 0, 64, low(kUsbVendor), low(kUsbVendor >> 8), low(kUsbProduct), low(kUsbProduct >> 8),
      0,  1, 1, 2, 3, 1};
  const auto total = static_cast<unsigned>(9 + interfaces.size());
  all.insert(all.end(), {9, 2, low(total), low(total >> 8), low(static_cast<unsigned>(kind.interfaces_before + 1)), 1,
                         0, 0x80, 50});
  all.insert(all.end(), interfaces.begin(), interfaces.end());
  return all;
}

void UmockProbe::Port::plug_in() {
  if (plugged) return;
  plugged = true;
  if (!attached) {
    attached = true;
    UMockdevIoctlBase* const handler = umockdev_ioctl_base_new();
    g_signal_connect(handler, "handle-ioctl", G_CALLBACK(on_ioctl), this);
    GError* error = nullptr;
    if (umockdev_testbed_attach_ioctl(bed(), node.c_str(), handler, &error) == FALSE) refuse("attach", error);
  }
  {
    const std::lock_guard lock(mutex);
    device = std::make_shared<Device>();
  }
  std::string hex;
  for (const std::uint8_t b : descriptors()) hex += formatted("%02X", b);
  const std::string dev = std::to_string(number + 1);
  const std::string text = "P: /devices/usb1/1-" + std::to_string(number) + "\nN: bus/usb/001/00" + dev + "=" + hex +
                           "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DEVNAME=" + node +
                           "\nE: BUSNUM=001\nE: DEVNUM=00" + dev + "\nA: busnum=1\nA: devnum=" + dev +
                           "\nA: speed=480\nA: bConfigurationValue=1\nA: dev=189:" + std::to_string(number) +
                           "\nH: descriptors=" + hex + "\n";
  GError* error = nullptr;
  if (umockdev_testbed_add_from_string(bed(), text.c_str(), &error) == FALSE) refuse("plug in", error);
}

void UmockProbe::Port::unplug() {
  if (!plugged) return;
  plugged = false;
  {
    const std::lock_guard lock(mutex);
    device->alive = false;
  }
  umockdev_testbed_uevent(bed(), sys_path().c_str(), "remove");
  umockdev_testbed_remove_device(bed(), sys_path().c_str());
}

gboolean UmockProbe::Port::on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer user) {
  Port& port = *static_cast<Port*>(user);
  const auto request = static_cast<unsigned long>(umockdev_ioctl_client_get_request(client));
  UMockdevIoctlData* const address = umockdev_ioctl_client_get_arg(client);
  int failed = 0;
  {
    const std::lock_guard lock(port.mutex);
    // A handle opened before unplugging stays with the old device, even if a new one is plugged in.
    using Opened = std::shared_ptr<Device>;
    auto* opened = static_cast<Opened*>(g_object_get_data(G_OBJECT(client), "lightwell-opened"));
    if (opened == nullptr) {
      opened = new Opened(port.device);
      g_object_set_data_full(G_OBJECT(client), "lightwell-opened", opened,
                             [](gpointer p) { delete static_cast<Opened*>(p); });
    }
    Device& d = **opened;
    switch (request) {
      case USBDEVFS_REAPURBNDELAY:
        failed = port.reap(d, address);
        break;
      case USBDEVFS_DISCARDURB:
        failed = discard(d, address);
        break;
      case USBDEVFS_RELEASEINTERFACE:
        if (d.claimed_by == client) d.claimed_by = nullptr;
        break;
      case USBDEVFS_GET_CAPABILITIES: {
        UMockdevIoctlData* const out = umockdev_ioctl_data_resolve(address, 0, 4, nullptr);
        std::uint32_t capabilities = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                                     USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        umockdev_ioctl_data_update(out, 0, reinterpret_cast<guint8*>(&capabilities), 4);
        g_object_unref(out);
        break;
      }
      case USBDEVFS_CLAIMINTERFACE:
        if (!d.alive)
          failed = ENODEV;
        else if (d.claimed_by != nullptr && d.claimed_by != client)
          failed = EBUSY;
        else
          d.claimed_by = client;
        break;
      case USBDEVFS_SETINTERFACE:
        failed = d.alive ? 0 : ENODEV;
        ++port.interfaces_set;
        d.to_host.clear();
        d.reader.begin_stream();
        break;
      case USBDEVFS_CLEAR_HALT:
        failed = d.alive ? 0 : ENODEV;
        ++port.halts_cleared;
        break;
      case USBDEVFS_SUBMITURB:
        failed = d.alive ? port.submit(d, address) : ENODEV;
        break;
      default:
        failed = ENOTTY;
        break;
    }
  }
  umockdev_ioctl_client_complete(client, failed == 0 ? 0 : -1, failed);
  return TRUE;
}

int UmockProbe::Port::submit(Device& d, UMockdevIoctlData* address) {
  UMockdevIoctlData* const data = umockdev_ioctl_data_resolve(address, 0, sizeof(usbdevfs_urb), nullptr);
  usbdevfs_urb urb{};
  std::memcpy(&urb, data->data, sizeof urb);
  Urb u{data, nullptr};
  if (urb.buffer_length > 0)
    u.buffer = umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer), static_cast<gsize>(urb.buffer_length),
                                           nullptr);
  const std::span buffer(u.buffer == nullptr ? nullptr : u.buffer->data, static_cast<std::size_t>(urb.buffer_length));
  if (urb.type == USBDEVFS_URB_TYPE_BULK && (urb.endpoint & 0x80U) != 0) {
    if (urb.endpoint != kind.in) return ENOENT;
    d.reads.push_back(u);
    return 0;
  }
  urb.status = 0;
  urb.actual_length = urb.buffer_length;
  if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
    urb.status = control(urb, buffer, urb.actual_length);
    if (urb.status == 0)
      umockdev_ioctl_data_update(u.buffer, 0, std::vector<guint8>(buffer.begin(), buffer.end()).data(),
                                 urb.buffer_length);
  } else if (urb.endpoint != kind.out) {
    return ENOENT;
  } else {
    hear(d, std::as_bytes(buffer));
  }
  umockdev_ioctl_data_update(data, 0, reinterpret_cast<guint8*>(&urb), sizeof urb);
  d.done.push_back(u);
  return 0;
}

/// libusb requests only string descriptors; everything else is in /sys.
int UmockProbe::Port::control(const usbdevfs_urb&, std::span<std::uint8_t> buffer, int& actual) const {
  constexpr std::size_t kSetup = 8;
  if (buffer.size() < kSetup || buffer[1] != 6 || buffer[3] != 3) return -EPIPE;
  std::vector<std::uint8_t> text = {0, 3};
  if (buffer[2] == 0) {
    text.insert(text.end(), {9, 4});
  } else {
    for (const char c : buffer[2] == 3 ? kind.serial : "Lightwell") {
      text.push_back(static_cast<std::uint8_t>(c));
      text.push_back(0);
    }
  }
  text[0] = static_cast<std::uint8_t>(text.size());
  const std::size_t n = std::min(text.size(), buffer.size() - kSetup);
  std::copy_n(text.begin(), n, buffer.begin() + kSetup);
  actual = static_cast<int>(n);
  return 0;
}

void UmockProbe::Port::hear(Device& d, std::span<const std::byte> bytes) {
  const FrameReader::FrameCallback take = [&](const LinkFrame& request) {
    ++requests;
    if (answering == Answering::no || !answer_link_request(request.payload, commands, d.answer).ok()) return;
    if (writer.write(FrameKind::response, d.answer, d.frame).ok()) d.to_host.push_back(d.frame);
  };
  d.reader.push(bytes, take);
  d.reader.end_transfer(take);
}

int UmockProbe::Port::reap(Device& d, UMockdevIoctlData* address) {
  if (d.done.empty() && !d.reads.empty() && (!d.alive || fail != 0 || !d.to_host.empty())) {
    const Urb u = d.reads.front();
    d.reads.pop_front();
    usbdevfs_urb urb{};
    std::memcpy(&urb, u.urb->data, sizeof urb);
    urb.actual_length = 0;
    urb.status = !d.alive ? -ESHUTDOWN : std::exchange(fail, 0);
    if (urb.status == 0) {
      std::vector<std::byte>& bytes = d.to_host.front();
      const std::size_t n = std::min(bytes.size(), static_cast<std::size_t>(urb.buffer_length));
      umockdev_ioctl_data_update(u.buffer, 0, reinterpret_cast<guint8*>(bytes.data()), static_cast<gint>(n));
      urb.actual_length = static_cast<int>(n);
      // Longer data continue in the next transfer; data that fill a transfer exactly are followed by an empty one.
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
      if (urb.actual_length < urb.buffer_length) d.to_host.pop_front();
    }
    umockdev_ioctl_data_update(u.urb, 0, reinterpret_cast<guint8*>(&urb), sizeof urb);
    d.done.push_back(u);
  }
  if (d.done.empty()) return d.alive ? EAGAIN : ENODEV;
  const Urb u = d.done.front();
  d.done.pop_front();
  UMockdevIoctlData* const pointer = umockdev_ioctl_data_resolve(address, 0, sizeof(void*), nullptr);
  umockdev_ioctl_data_set_ptr(pointer, 0, u.urb);
  g_object_unref(pointer);
  g_object_unref(u.urb);
  if (u.buffer != nullptr) g_object_unref(u.buffer);
  return 0;
}

int UmockProbe::Port::discard(Device& d, UMockdevIoctlData* address) {
  gulong wanted = 0;
  std::memcpy(&wanted, address->data, sizeof wanted);
  const auto it =
      std::find_if(d.reads.begin(), d.reads.end(), [&](const Urb& u) { return u.urb->client_addr == wanted; });
  if (it == d.reads.end()) return EINVAL;
  usbdevfs_urb urb{};
  std::memcpy(&urb, it->urb->data, sizeof urb);
  urb.status = -ENOENT;
  urb.actual_length = 0;
  umockdev_ioctl_data_update(it->urb, 0, reinterpret_cast<guint8*>(&urb), sizeof urb);
  d.done.push_back(*it);
  d.reads.erase(it);
  return 0;
}

namespace {

template <class Port>
Port& port_of(int number) {
  static Port& first = *new Port(1);
  static Port& second = *new Port(2);
  return number == 1 ? first : second;
}

}  // namespace

UmockProbe::UmockProbe(const UsbDeviceKind& kind, int port) : port_(port_of<Port>(port)) {
  port_.kind = kind;
  port_.answering = Answering::yes;
  port_.fail = port_.halts_cleared = port_.interfaces_set = port_.requests = 0;
  plug_in();
}

UmockProbe::~UmockProbe() { unplug(); }

void UmockProbe::plug_in() { port_.plug_in(); }
void UmockProbe::unplug() { port_.unplug(); }

void UmockProbe::send(const std::string& descriptor) {
  const std::lock_guard lock(port_.mutex);
  Device& d = *port_.device;
  if (port_.writer.write(FrameKind::descriptor, std::as_bytes(std::span(descriptor)), d.frame).ok())
    d.to_host.push_back(d.frame);
}

void UmockProbe::send_bytes(std::vector<std::byte> bytes) {
  const std::lock_guard lock(port_.mutex);
  port_.device->to_host.push_back(std::move(bytes));
}

void UmockProbe::fail_next(int status) {
  const std::lock_guard lock(port_.mutex);
  port_.fail = status;
}
void UmockProbe::set_answering(Answering answering) {
  const std::lock_guard lock(port_.mutex);
  port_.answering = answering;
}
int UmockProbe::halts_cleared() const {
  const std::lock_guard lock(port_.mutex);
  return port_.halts_cleared;
}
int UmockProbe::interfaces_set() const {
  const std::lock_guard lock(port_.mutex);
  return port_.interfaces_set;
}
int UmockProbe::requests() const {
  const std::lock_guard lock(port_.mutex);
  return port_.requests;
}

}  // namespace lightwell::test

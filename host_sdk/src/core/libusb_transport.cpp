#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <libusb.h>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/deleter.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/usb_ids.hpp>

#include "core/usb_transport.hpp"

namespace lightwell::core {
namespace {

/// Largest transfer that libusb passes to the kernel as one URB. It splits larger ones and, if a packet overflows,
/// frees the parts too early (1.0.26). A longer frame fills several transfers and ends within the next.
constexpr std::size_t kTransferBytes = 16 * 1024;
/// Number of queued transfers: buffers for further frames, including one of maximum length, while this process is busy.
constexpr std::size_t kTransfersInFlight = 8;
static_assert(kTransfersInFlight * kTransferBytes > kMaxFrameBytes);
/// Limit of sending a request, which is small.
constexpr unsigned kSendTimeoutMs = 1000;
/// After this many consecutive bus errors without received data, the connection is made again.
constexpr int kMaxErrorsInRow = 5;
constexpr Duration kCloseTimeout{900'000'000};

std::string usb_error_text(int error) { return libusb_strerror(static_cast<libusb_error>(error)); }

/// The probe's interface in a configuration.
struct Interface {
  int number = -1, setting = 0;
  std::uint8_t in = 0, out = 0;  ///< Endpoint addresses, which the device controller chooses.
};

std::optional<Interface> interface_of(const libusb_interface_descriptor& d) {
  if (d.bInterfaceClass != kUsbInterfaceClass || d.bInterfaceSubClass != kUsbInterfaceSubclass ||
      d.bInterfaceProtocol != kUsbInterfaceProtocol)
    return std::nullopt;
  Interface found{d.bInterfaceNumber, d.bAlternateSetting};
  for (int i = 0; i < d.bNumEndpoints; ++i) {
    const libusb_endpoint_descriptor& e = d.endpoint[i];
    if ((e.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    ((e.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0 ? found.in : found.out) = e.bEndpointAddress;
  }
  if (found.in == 0 || found.out == 0) return std::nullopt;
  return found;
}

std::optional<Interface> probe_interface(libusb_device* device) {
  libusb_device_descriptor d{};
  if (libusb_get_device_descriptor(device, &d) != 0 || d.idVendor != kUsbVendor || d.idProduct != kUsbProduct)
    return std::nullopt;
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != 0) return std::nullopt;
  std::optional<Interface> found;
  for (int i = 0; i < config->bNumInterfaces && !found; ++i)
    for (int k = 0; k < config->interface[i].num_altsetting && !found; ++k)
      found = interface_of(config->interface[i].altsetting[k]);
  libusb_free_config_descriptor(config);
  return found;
}

std::string serial_of(libusb_device_handle* handle) {
  libusb_device_descriptor d{};
  std::array<unsigned char, 128> text{};
  if (libusb_get_device_descriptor(libusb_get_device(handle), &d) != 0 || d.iSerialNumber == 0) return {};
  const int n = libusb_get_string_descriptor_ascii(handle, d.iSerialNumber, text.data(), static_cast<int>(text.size()));
  return n <= 0 ? std::string() : std::string(reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(n));
}

using Handle = std::unique_ptr<libusb_device_handle, Deleter<libusb_close>>;

Result<Handle> open_device(libusb_device* device) {
  libusb_device_handle* raw = nullptr;
  const int error = libusb_open(device, &raw);
  if (error == 0) return Handle(raw);
  if (error == LIBUSB_ERROR_ACCESS)
    return Status(StatusCode::failed_precondition,
                  "this user may not open the probe: install 70-lightwell.rules of the SDK (share/lightwell/udev) into "
                  "/etc/udev/rules.d, run `udevadm control --reload`, and plug the probe in again");
  return Status(StatusCode::unavailable, "the probe cannot be opened: " + usb_error_text(error));
}

class LibusbTransport;

/// A transfer with its buffer; both must live until libusb has completed the transfer.
struct Transfer {
  explicit Transfer(LibusbTransport* transport) : usb(libusb_alloc_transfer(0)), owner(transport) {}
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;
  ~Transfer() { libusb_free_transfer(usb); }

  std::vector<std::byte> memory = std::vector<std::byte>(kTransferBytes);
  libusb_transfer* const usb;
  LibusbTransport* const owner;
  bool under_way = false;
};

class LibusbTransport final : public UsbTransport {
 public:
  ~LibusbTransport() override {
    close();
    end_context();
  }

  [[nodiscard]] Status init() {
    const std::lock_guard lock(context_mutex_);
    if (const int error = libusb_init(&context_); error != 0) {
      context_ = nullptr;
      return {StatusCode::unavailable, "libusb cannot be initialised: " + usb_error_text(error)};
    }
    // Without hotplug events, waiting callers poll.
    watching_ = libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) != 0 &&
                libusb_hotplug_register_callback(context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED, 0, kUsbVendor,
                                                 kUsbProduct, LIBUSB_HOTPLUG_MATCH_ANY, on_arrival, this, &watch_) == 0;
    return {};
  }

  Status open(const std::string& serial) override {
    close();
    if (Status found = find(serial); !found.ok() && !(found = rescan(serial, found)).ok()) return found;
    if (const int error = libusb_claim_interface(handle_.get(), interface_.number); error != 0) {
      handle_.reset();
      return error == LIBUSB_ERROR_BUSY
                 ? Status(StatusCode::resource_exhausted,
                          "another program on this machine uses the probe by USB; close it, or use the probe's "
                          "network function, which serves several")
                 : Status(StatusCode::unavailable, "the probe's interface cannot be claimed: " + usb_error_text(error));
    }
    claimed_ = true;
    // SET_INTERFACE tells the probe that a new stream begins, and resets the endpoints on both sides.
    if (const int error = libusb_set_interface_alt_setting(handle_.get(), interface_.number, interface_.setting);
        error != 0)
      return refuse("the probe's interface cannot be set: " + usb_error_text(error));
    for (std::size_t i = 0; i < kTransfersInFlight; ++i) {
      in_.push_back(std::make_unique<Transfer>(this));
      if (!start(*in_.back(), interface_.in, kTransferBytes, 0))
        return refuse("reading from the probe cannot be started");
    }
    return {};
  }

  void close() override {
    const auto cancel = [](Transfer* t) {
      if (t != nullptr && t->under_way) libusb_cancel_transfer(t->usb);
    };
    for (const auto& t : in_) cancel(t.get());
    cancel(out_.get());
    const std::int64_t end = monotonic_now_ns() + kCloseTimeout.ns;
    while (any_under_way() && monotonic_now_ns() < end) handle_events({100'000'000});
    if (any_under_way()) {
      // libusb may still write into this memory, so it is leaked instead of freed.
      for (auto& t : in_) (void)t.release();
      (void)out_.release();
      (void)handle_.release();
      given_up_ = true;
    }
    in_.clear();
    out_.reset();
    ended_.clear();
    reading_ = nullptr;
    errors_in_row_ = 0;
    broken_ = false;
    if (handle_ && claimed_) libusb_release_interface(handle_.get(), interface_.number);
    claimed_ = false;
    handle_.reset();
  }

  Status begin_send(std::span<const std::byte> bytes) override {
    if (!handle_ || (out_ && out_->under_way)) return {StatusCode::unavailable, "not connected"};
    if (!out_) out_ = std::make_unique<Transfer>(this);
    if (bytes.size() > out_->memory.size()) return {StatusCode::internal, "a request larger than a transfer"};
    std::copy(bytes.begin(), bytes.end(), out_->memory.begin());
    if (!start(*out_, interface_.out, bytes.size(), kSendTimeoutMs))
      return {StatusCode::unavailable, "the probe is gone"};
    return {};
  }

  UsbEvent wait(Duration timeout) override {
    // The caller no longer uses the bytes of the last event.
    if (Transfer* const t = std::exchange(reading_, nullptr); t != nullptr && !submit(*t)) broken_ = true;
    // Deliver data received before the loss of the connection first.
    if (ended_.empty() && broken_) return gone();
    if (ended_.empty() && !woken_.exchange(false)) handle_events(timeout);
    if (!ended_.empty()) {
      Transfer& t = *ended_.front();
      ended_.pop_front();
      return &t == out_.get() ? after_sending(t) : after_receiving(t);
    }
    if (std::exchange(arrived_, false)) return {UsbEvent::Kind::arrived, {}, {}, {}};
    return {};
  }

  void wake() override {
    woken_ = true;
    const std::lock_guard lock(context_mutex_);
    if (context_ != nullptr) libusb_interrupt_event_handler(context_);
  }

 private:
  static int LIBUSB_CALL on_arrival(libusb_context*, libusb_device*, libusb_hotplug_event, void* user) {
    static_cast<LibusbTransport*>(user)->arrived_ = true;
    return 0;
  }
  static void LIBUSB_CALL on_ended(libusb_transfer* usb) {
    auto* const t = static_cast<Transfer*>(usb->user_data);
    t->under_way = false;
    t->owner->ended_.push_back(t);
  }

  [[nodiscard]] bool start(Transfer& t, std::uint8_t endpoint, std::size_t bytes, unsigned timeout_ms) {
    libusb_fill_bulk_transfer(t.usb, handle_.get(), endpoint, reinterpret_cast<unsigned char*>(t.memory.data()),
                              static_cast<int>(bytes), on_ended, &t, timeout_ms);
    return submit(t);
  }
  [[nodiscard]] bool submit(Transfer& t) {
    t.under_way = libusb_submit_transfer(t.usb) == 0;
    return t.under_way;
  }
  [[nodiscard]] bool any_under_way() const {
    return (out_ && out_->under_way) || std::any_of(in_.begin(), in_.end(), [](const auto& t) { return t->under_way; });
  }
  void handle_events(Duration timeout) {
    const std::int64_t ns = std::max<std::int64_t>(timeout.ns, 0);
    if (context_ == nullptr) {
      // libusb could not be initialised again: sleep briefly, so that the caller neither spins nor misses the end.
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min<std::int64_t>(ns, 50'000'000)));
      return;
    }
    timeval limit{static_cast<decltype(timeval::tv_sec)>(ns / 1'000'000'000),
                  static_cast<decltype(timeval::tv_usec)>(ns % 1'000'000'000 / 1000)};
    (void)libusb_handle_events_timeout_completed(context_, &limit, nullptr);
  }

  void end_context() {
    const std::lock_guard lock(context_mutex_);
    if (context_ == nullptr) return;
    if (watching_) libusb_hotplug_deregister_callback(context_, watch_);
    watching_ = false;
    libusb_exit(context_);
    context_ = nullptr;
  }

  /// Initialises libusb again. It enumerates the buses only at initialisation and then relies on udev's events; without
  /// udevd (in a container, for example) a probe that is plugged in again would not be detected. `found`: the result of
  /// the last enumeration.
  [[nodiscard]] Status rescan(const std::string& serial, const Status& found) {
    const bool absent = found.code() == StatusCode::not_found || found.code() == StatusCode::unavailable;
    if (!absent || given_up_) return found;
    end_context();
    if (Status initialised = init(); !initialised.ok()) return initialised;
    return find(serial);
  }

  [[nodiscard]] Status refuse(const std::string& why) {
    close();
    return {StatusCode::unavailable, why};
  }
  static UsbEvent gone() { return {UsbEvent::Kind::gone, {}, {}, "the probe is gone"}; }

  UsbEvent after_sending(const Transfer& t) {
    UsbEvent event{UsbEvent::Kind::sent, {}, {}, {}};
    switch (t.usb->status) {
      case LIBUSB_TRANSFER_COMPLETED:
        break;
      case LIBUSB_TRANSFER_NO_DEVICE:
        return gone();
      case LIBUSB_TRANSFER_STALL:
        libusb_clear_halt(handle_.get(), interface_.out);
        event.error = "the probe refused a transfer";
        break;
      case LIBUSB_TRANSFER_TIMED_OUT:
        event.error = "the probe did not take a request in time";
        break;
      default:
        event.error = "a request did not arrive";
        break;
    }
    return event;
  }

  UsbEvent after_receiving(Transfer& t) {
    UsbEvent event{UsbEvent::Kind::received, {}, {}, {}};
    switch (t.usb->status) {
      case LIBUSB_TRANSFER_COMPLETED:
        errors_in_row_ = 0;
        reading_ = &t;
        event.bytes = std::span(t.memory).first(static_cast<std::size_t>(t.usb->actual_length));
        event.transfer_end =
            t.usb->actual_length < t.usb->length ? UsbEvent::TransferEnd::of_transfer : UsbEvent::TransferEnd::none;
        return event;
      case LIBUSB_TRANSFER_NO_DEVICE:
      case LIBUSB_TRANSFER_CANCELLED:
        return gone();
      case LIBUSB_TRANSFER_STALL:
        libusb_clear_halt(handle_.get(), interface_.in);
        event.error = "the probe stalled its endpoint; it was cleared";
        break;
      case LIBUSB_TRANSFER_OVERFLOW:
        event.error = "the probe sent more than a packet holds";
        break;
      default:
        event.error = "a transfer was damaged on the bus";
        break;
    }
    if (++errors_in_row_ > kMaxErrorsInRow || !submit(t)) return gone();
    event.kind = UsbEvent::Kind::failed;
    return event;
  }

  [[nodiscard]] Status find(const std::string& serial) {
    libusb_device** list = nullptr;
    if (context_ == nullptr)
      if (Status initialised = init(); !initialised.ok()) return initialised;
    const ssize_t count = libusb_get_device_list(context_, &list);
    if (count < 0)
      return {StatusCode::unavailable, "USB cannot be enumerated: " + usb_error_text(static_cast<int>(count))};
    std::vector<std::pair<libusb_device*, Interface>> probes;
    for (ssize_t i = 0; i < count; ++i)
      if (const auto found = probe_interface(list[i])) probes.emplace_back(list[i], *found);

    const bool choose = !serial.empty() || probes.size() > 1;
    std::string others;
    Status status(StatusCode::not_found, "no probe is plugged in");
    for (const auto& [device, interface] : probes) {
      Result<Handle> opened = open_device(device);
      if (!opened) {
        status = opened.status();
        continue;
      }
      if (const std::string its = choose ? serial_of(opened->get()) : serial;
          its != serial || (choose && serial.empty())) {
        others += (others.empty() ? "usb:" : ", usb:") + its;
        continue;
      }
      handle_ = std::move(*opened);
      interface_ = interface;
      status = {};
      break;
    }
    libusb_free_device_list(list, 1);
    if (status.ok() || others.empty()) return status;
    if (serial.empty()) return {StatusCode::failed_precondition, "several probes are plugged in, name one: " + others};
    return {StatusCode::not_found,
            "no probe with the serial number '" + serial + "' is plugged in; there is " + others};
  }

  libusb_context* context_ = nullptr;
  std::mutex context_mutex_;  ///< Protects the context: wake() against its replacement.
  libusb_hotplug_callback_handle watch_{};
  bool watching_ = false, arrived_ = false, claimed_ = false;
  bool broken_ = false;    ///< The connection is lost.
  bool given_up_ = false;  ///< The context has transfers that never completed.
  std::atomic<bool> woken_{false};
  Handle handle_;
  Interface interface_;
  std::vector<std::unique_ptr<Transfer>> in_;
  std::unique_ptr<Transfer> out_;
  std::deque<Transfer*> ended_;
  Transfer* reading_ = nullptr;  ///< The transfer whose bytes the last event refers to.
  int errors_in_row_ = 0;
};

}  // namespace

Result<std::vector<std::string>> probes_on_usb() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context); error != 0)
    return Status(StatusCode::unavailable, "libusb cannot be initialised: " + usb_error_text(error));
  std::vector<std::string> serials;
  Status barred;
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  for (ssize_t i = 0; i < count; ++i) {
    if (!probe_interface(list[i])) continue;
    if (const Result<Handle> opened = open_device(list[i]); opened.ok())
      serials.push_back(serial_of(opened->get()));
    else
      barred = opened.status();
  }
  if (count >= 0) libusb_free_device_list(list, 1);
  libusb_exit(context);
  if (count < 0)
    return Status(StatusCode::unavailable, "USB cannot be enumerated: " + usb_error_text(static_cast<int>(count)));
  if (serials.empty() && !barred.ok()) return barred;
  return serials;
}

Result<std::unique_ptr<UsbTransport>> make_libusb_transport() {
  auto transport = std::make_unique<LibusbTransport>();
  if (Status initialised = transport->init(); !initialised.ok()) return initialised;
  return std::unique_ptr<UsbTransport>(std::move(transport));
}

}  // namespace lightwell::core

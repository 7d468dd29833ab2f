#include "link/usb_gadget/ffs_port.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <fcntl.h>
#include <poll.h>
#include <string_view>
#include <unistd.h>

#include <linux/aio_abi.h>
#include <linux/usb/functionfs.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>

#include <lightwell/usb_ids.hpp>

namespace lightwell {
namespace {

Status refused(const std::string& path, int error) {
  const std::string what = path + ": " + std::strerror(error);
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return {StatusCode::not_found, what +
                                         ": no FunctionFS is mounted there; run `lightwell-usb-gadget up` as root, or "
                                         "correct usb_gadget.functionfs_mount"};
    case EACCES:
    case EPERM:
      return {StatusCode::failed_precondition,
              what + ": give this user the mount, with `lightwell-usb-gadget up --user NAME` as root"};
    case EBUSY:
    case ESRCH:
    case EBADFD:
      return {StatusCode::resource_exhausted, what + ": another program uses it; is a second lightwelld running?"};
    default:
      return {StatusCode::unavailable, what};
  }
}

Status write_all(int fd, const std::string& path, const std::vector<std::byte>& bytes) {
  const ssize_t n = ::write(fd, bytes.data(), bytes.size());
  if (n == static_cast<ssize_t>(bytes.size())) return {};
  return refused(path, n < 0 ? errno : EIO);
}

/// The transfer of one direction. The kernel reads the control block while the transfer is in progress.
struct Transfer {
  iocb block{};
  bool in_progress = false;
};

class FfsPort final : public GadgetPort {
 public:
  explicit FfsPort(std::function<Result<FfsFiles>()> open) : open_(std::move(open)) {}
  ~FfsPort() override { close(); }

  Status open() override {
    if (Status s = open_().assign_to(files_); !s.ok()) return s;
    if (::syscall(SYS_io_setup, 2, &context_) != 0) {
      const int error = errno;
      close();
      return {StatusCode::internal, std::string("asynchronous I/O (io_setup): ") + std::strerror(error) +
                                        "; the kernel needs CONFIG_AIO, and fs.aio-max-nr two free requests"};
    }
    return {};
  }

  void close() override {
    // Cancels transfers in progress and waits for their end.
    if (context_ != 0) ::syscall(SYS_io_destroy, context_);
    context_ = 0;
    in_.in_progress = out_.in_progress = false;
    files_ = {};
    events_.clear();
  }

  bool begin_send(std::span<const std::byte> bytes) override {
    return begin(in_, IOCB_CMD_PWRITE, files_.in.get(), const_cast<std::byte*>(bytes.data()), bytes.size());
  }
  bool begin_receive(std::span<std::byte> bytes) override {
    return begin(out_, IOCB_CMD_PREAD, files_.out.get(), bytes.data(), bytes.size());
  }

  PortEvent wait(Duration timeout) override {
    if (events_.empty()) {
      std::array<pollfd, 3> fds{pollfd{files_.control.get(), POLLIN, 0}, pollfd{done_.get(), POLLIN, 0},
                                pollfd{wake_.get(), POLLIN, 0}};
      const timespec limit{timeout.ns / 1'000'000'000, timeout.ns % 1'000'000'000};
      if (::ppoll(fds.data(), fds.size(), timeout.ns < 0 ? nullptr : &limit, nullptr) > 0) {
        // Transfers that ended precede a control event of the same moment.
        if (fds[1].revents != 0) read_completions();
        if (fds[0].revents != 0) read_control_events();
        if (fds[2].revents != 0) {
          eventfd_t ignored = 0;
          (void)::eventfd_read(wake_.get(), &ignored);
          events_.push_back({PortEvent::Kind::woken});
        }
      }
    }
    if (events_.empty()) return {};
    const PortEvent next = events_.front();
    events_.pop_front();
    return next;
  }

  void wake() override { (void)::eventfd_write(wake_.get(), 1); }

 private:
  bool begin(Transfer& transfer, unsigned command, int fd, void* memory, std::size_t bytes) {
    transfer.block = {};
    transfer.block.aio_lio_opcode = static_cast<std::uint16_t>(command);
    transfer.block.aio_fildes = static_cast<std::uint32_t>(fd);
    transfer.block.aio_buf = reinterpret_cast<std::uintptr_t>(memory);
    transfer.block.aio_nbytes = bytes;
    transfer.block.aio_flags = IOCB_FLAG_RESFD;
    transfer.block.aio_resfd = static_cast<std::uint32_t>(done_.get());
    iocb* const list = &transfer.block;
    transfer.in_progress = ::syscall(SYS_io_submit, context_, 1, &list) == 1;
    return transfer.in_progress;
  }

  void read_completions() {
    eventfd_t ignored = 0;
    (void)::eventfd_read(done_.get(), &ignored);
    std::array<io_event, 2> ended{};
    timespec at_once{};
    const long count = ::syscall(SYS_io_getevents, context_, 0, ended.size(), ended.data(), &at_once);
    for (long i = 0; i < count; ++i) {
      const io_event& e = ended[static_cast<std::size_t>(i)];
      const bool sent = e.obj == reinterpret_cast<std::uintptr_t>(&in_.block);
      (sent ? in_ : out_).in_progress = false;
      PortEvent event{sent ? PortEvent::Kind::sent : PortEvent::Kind::received};
      if (e.res >= 0)
        event.bytes = static_cast<std::size_t>(e.res);
      else
        event.error = static_cast<int>(-e.res);
      events_.push_back(event);
    }
  }

  void read_control_events() {
    std::array<usb_functionfs_event, 4> events{};
    const ssize_t bytes = ::read(files_.control.get(), events.data(), sizeof events);
    if (bytes <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(bytes) / sizeof events[0]; ++i) {
      switch (events[i].type) {
        case FUNCTIONFS_ENABLE:
          events_.push_back({PortEvent::Kind::enabled});
          break;
        case FUNCTIONFS_DISABLE:
        case FUNCTIONFS_UNBIND:
          events_.push_back({PortEvent::Kind::disabled});
          break;
        case FUNCTIONFS_SUSPEND:
          events_.push_back({PortEvent::Kind::suspended});
          break;
        case FUNCTIONFS_RESUME:
          events_.push_back({PortEvent::Kind::resumed});
          break;
        case FUNCTIONFS_SETUP:
          stall(events[i].u.setup);
          break;
        default:
          break;  // BIND: the interface is not enabled yet.
      }
    }
  }

  /// Stalls a control request, because the interface defines none: FunctionFS does that when the data stage begins in
  /// the wrong direction.
  void stall(const usb_ctrlrequest& setup) {
    std::byte none{};
    if ((setup.bRequestType & USB_DIR_IN) != 0)
      (void)!::read(files_.control.get(), &none, 0);
    else
      (void)!::write(files_.control.get(), &none, 0);
  }

  const std::function<Result<FfsFiles>()> open_;
  FfsFiles files_;
  aio_context_t context_ = 0;
  FileDescriptor done_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};  ///< Signalled by the kernel when a transfer ends.
  FileDescriptor wake_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  Transfer in_, out_;
  std::deque<PortEvent> events_;
};

/// Serialises little-endian numbers.
class Bytes {
 public:
  Bytes& u8(unsigned v) { return put(v, 1); }
  Bytes& u16(unsigned v) { return put(v, 2); }
  Bytes& u32(std::size_t v) { return put(v, 4); }
  /// With a terminating zero.
  Bytes& text(std::string_view v) {
    for (const char c : v) u8(static_cast<unsigned char>(c));
    return u8(0);
  }
  Bytes& zeros(int count) {
    for (; count > 0; --count) u8(0);
    return *this;
  }
  Bytes& append(const std::vector<std::byte>& v) {
    all_.insert(all_.end(), v.begin(), v.end());
    return *this;
  }
  [[nodiscard]] const std::vector<std::byte>& all() const { return all_; }
  [[nodiscard]] std::size_t size() const { return all_.size(); }

 private:
  Bytes& put(std::size_t v, int bytes) {
    for (int i = 0; i < bytes; ++i) all_.push_back(static_cast<std::byte>(v >> (8 * i) & 255U));
    return *this;
  }
  std::vector<std::byte> all_;
};

constexpr unsigned kIn = USB_DIR_IN | 1U, kOut = USB_DIR_OUT | 2U;

void interface_descriptor(Bytes& out) {
  out.u8(USB_DT_INTERFACE_SIZE).u8(USB_DT_INTERFACE).u8(0).u8(0).u8(2);
  out.u8(kUsbInterfaceClass).u8(kUsbInterfaceSubclass).u8(kUsbInterfaceProtocol).u8(1);
}

void endpoint_descriptor(Bytes& out, unsigned address, unsigned packet_bytes) {
  out.u8(USB_DT_ENDPOINT_SIZE).u8(USB_DT_ENDPOINT).u8(address).u8(USB_ENDPOINT_XFER_BULK).u16(packet_bytes).u8(0);
}

/// The companion descriptor of super speed: no bursts, no streams, because light descriptors are small.
void companion_descriptor(Bytes& out) { out.u8(USB_DT_SS_EP_COMP_SIZE).u8(USB_DT_SS_ENDPOINT_COMP).zeros(4); }

constexpr std::size_t kOsHeaderBytes = sizeof(usb_os_desc_header);

/// "Extended compat ID", index 4: selects the driver that Windows loads.
void compatible_id(Bytes& out) {
  Bytes function;
  function.u8(0).u8(1);  // the first interface; reserved, 1
  function.text("WINUSB").zeros(1).zeros(8).zeros(6);
  out.u8(0).u32(kOsHeaderBytes + function.size()).u16(1).u16(4).u8(1).u8(0).append(function.all());
}

/// "Extended properties", index 5. The kernel turns name and value into UTF-16.
void interface_guid(Bytes& out) {
  constexpr std::string_view kName = "DeviceInterfaceGUID";
  const std::string_view value = kUsbInterfaceGuid;
  constexpr unsigned kText = 1;  // REG_SZ
  Bytes property;
  property.u32(14 + kName.size() + 1 + value.size() + 1).u32(kText);
  property.u16(static_cast<unsigned>(kName.size() + 1)).text(kName).u32(value.size() + 1).text(value);
  out.u8(0).u32(kOsHeaderBytes + property.size()).u16(1).u16(5).u16(1).append(property.all());
}

}  // namespace

std::vector<std::byte> ffs_descriptors() {
  Bytes body;
  body.u32(3).u32(3).u32(5).u32(2);  // Number of descriptors for full, high and super speed, and of Microsoft's.
  for (const unsigned packet_bytes : {64U, 512U}) {
    interface_descriptor(body);
    endpoint_descriptor(body, kIn, packet_bytes);
    endpoint_descriptor(body, kOut, packet_bytes);
  }
  interface_descriptor(body);
  for (const unsigned address : {kIn, kOut}) {
    endpoint_descriptor(body, address, 1024);
    companion_descriptor(body);
  }
  compatible_id(body);
  interface_guid(body);

  Bytes out;
  constexpr unsigned kFlags =
      FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC | FUNCTIONFS_HAS_MS_OS_DESC;
  out.u32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2).u32(12 + body.size()).u32(kFlags).append(body.all());
  return out.all();
}

std::vector<std::byte> ffs_strings() {
  Bytes language;
  language.u16(0x0409).text("Lightwell light probe");
  Bytes out;
  out.u32(FUNCTIONFS_STRINGS_MAGIC).u32(16 + language.size()).u32(1).u32(1).append(language.all());
  return out.all();
}

Result<FfsFiles> open_ffs(const std::string& mount) {
  FfsFiles files;
  const auto open = [&](const char* name, FileDescriptor& file) -> Status {
    const std::string path = mount + "/" + name;
    // Without O_NONBLOCK io_submit() would wait for an endpoint that is not enabled.
    file = FileDescriptor(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
    return file.get() < 0 ? refused(path, errno) : Status();
  };
  if (Status s = open("ep0", files.control); !s.ok()) return s;
  const std::string control = mount + "/ep0";
  if (Status s = write_all(files.control.get(), control, ffs_descriptors()); !s.ok()) return s;
  if (Status s = write_all(files.control.get(), control, ffs_strings()); !s.ok()) return s;
  if (Status s = open("ep1", files.in); !s.ok()) return s;
  if (Status s = open("ep2", files.out); !s.ok()) return s;
  return files;
}

std::unique_ptr<GadgetPort> make_ffs_port(std::function<Result<FfsFiles>()> open) {
  return std::make_unique<FfsPort>(std::move(open));
}

}  // namespace lightwell

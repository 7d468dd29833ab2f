#include "link/usb_gadget/ffs_port.hpp"

#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <deque>
#include <fcntl.h>
#include <poll.h>
#include <span>
#include <type_traits>
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

static_assert(std::endian::native == std::endian::little, "the descriptors are little-endian");

/// The bytes of the objects, or of a vector's elements, one after the other. Those of a string literal include its
/// terminating zero.
template <class... Parts>
std::vector<std::byte> concatenated(const Parts&... parts) {
  std::vector<std::byte> out;
  const auto append = [&out](const auto& part) {
    std::span<const std::byte> bytes;
    if constexpr (std::is_same_v<decltype(part), const std::vector<std::byte>&>)
      bytes = part;
    else
      bytes = std::as_bytes(std::span(&part, 1));
    out.insert(out.end(), bytes.begin(), bytes.end());
  };
  (append(parts), ...);
  return out;
}

using Word = std::uint32_t;

constexpr usb_interface_descriptor kInterface{USB_DT_INTERFACE_SIZE, USB_DT_INTERFACE,      0, 0, 2, kUsbInterfaceClass,
                                              kUsbInterfaceSubclass, kUsbInterfaceProtocol, 1};

constexpr usb_endpoint_descriptor_no_audio endpoint_in(std::uint16_t packet_bytes) {
  return {USB_DT_ENDPOINT_SIZE, USB_DT_ENDPOINT, USB_DIR_IN | 1, USB_ENDPOINT_XFER_BULK, packet_bytes, 0};
}
constexpr usb_endpoint_descriptor_no_audio endpoint_out(std::uint16_t packet_bytes) {
  return {USB_DT_ENDPOINT_SIZE, USB_DT_ENDPOINT, USB_DIR_OUT | 2, USB_ENDPOINT_XFER_BULK, packet_bytes, 0};
}

/// The companion descriptor of super speed: no bursts, no streams, because light descriptors are small.
constexpr usb_ss_ep_comp_descriptor kCompanion{USB_DT_SS_EP_COMP_SIZE, USB_DT_SS_ENDPOINT_COMP, 0, 0, 0};

/// An OS descriptor of Microsoft for the first interface, with one entry.
std::vector<std::byte> os_descriptor(std::uint16_t index, const std::vector<std::byte>& entry) {
  const auto bytes = static_cast<Word>(sizeof(usb_os_desc_header) + entry.size());
  return concatenated(usb_os_desc_header{0, bytes, 1, index, {{1, 0}}}, entry);
}

/// "Extended compat ID", index 4: selects the driver that Windows loads. The first interface; reserved, 1; the
/// identifier in eight bytes; no second identifier; reserved.
std::vector<std::byte> compatible_id() {
  return os_descriptor(4, concatenated(std::uint8_t{0}, std::uint8_t{1}, "WINUSB\0", std::array<std::byte, 8>{},
                                       std::array<std::byte, 6>{}));
}

/// "Extended properties", index 5. The kernel turns name and value into UTF-16.
std::vector<std::byte> interface_guid() {
  constexpr char kName[] = "DeviceInterfaceGUID";
  constexpr Word kText = 1;  // REG_SZ
  const std::vector<std::byte> property =
      concatenated(kText, std::uint16_t{sizeof kName}, kName, Word{sizeof kUsbInterfaceGuid}, kUsbInterfaceGuid);
  return os_descriptor(5, concatenated(static_cast<Word>(sizeof(Word) + property.size()), property));
}

}  // namespace

std::vector<std::byte> ffs_descriptors() {
  // The numbers of descriptors for full, high and super speed, and of Microsoft's.
  const std::vector<std::byte> body =
      concatenated(Word{3}, Word{3}, Word{5}, Word{2}, kInterface, endpoint_in(64), endpoint_out(64), kInterface,
                   endpoint_in(512), endpoint_out(512), kInterface, endpoint_in(1024), kCompanion, endpoint_out(1024),
                   kCompanion, compatible_id(), interface_guid());
  constexpr Word kSets =
      FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC | FUNCTIONFS_HAS_MS_OS_DESC;
  return concatenated(Word{FUNCTIONFS_DESCRIPTORS_MAGIC_V2}, static_cast<Word>(12 + body.size()), kSets, body);
}

std::vector<std::byte> ffs_strings() {
  const std::vector<std::byte> language = concatenated(std::uint16_t{0x0409}, "Lightwell light probe");
  return concatenated(Word{FUNCTIONFS_STRINGS_MAGIC}, static_cast<Word>(16 + language.size()), Word{1}, Word{1},
                      language);
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

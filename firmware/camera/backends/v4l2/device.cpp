#include "camera/backends/v4l2/device.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <poll.h>

#include <sys/ioctl.h>
#include <sys/mman.h>

#include <lightwell/text.hpp>

namespace lightwell::v4l2 {
namespace {

/// ioctl(), repeated if interrupted. Returns 0 or an errno.
int call(const FileDescriptor& fd, unsigned long request, void* argument) {
  while (::ioctl(fd.get(), request, argument) != 0)
    if (errno != EINTR) return errno;
  return 0;
}

template <class T>
T zeroed() {
  T value;
  std::memset(&value, 0, sizeof value);
  return value;
}

v4l2_buffer a_buffer(int index) {
  auto buffer = zeroed<v4l2_buffer>();
  buffer.index = static_cast<std::uint32_t>(index);
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

template <std::size_t N>
std::string text_of(const unsigned char (&field)[N]) {
  const auto* const text = reinterpret_cast<const char*>(field);
  return {text, ::strnlen(text, N)};
}

/// An errno, and what it means for the user.
struct KnownError {
  int error;
  StatusCode code;
  const char* remedy;  ///< Null: as strerror().
};
constexpr std::array kKnownErrors = {
    KnownError{EBUSY, StatusCode::unavailable, "it is in use by another program; stop that one (`fuser -v` names it)"},
    KnownError{EACCES, StatusCode::failed_precondition, "this user may not use it; add the user to the group `video`"},
    KnownError{EPERM, StatusCode::failed_precondition, "this user may not use it; add the user to the group `video`"},
    KnownError{ENODEV, StatusCode::unavailable, "it is away; plug it in again"},
    KnownError{ENXIO, StatusCode::unavailable, "it is away; plug it in again"},
    KnownError{EIO, StatusCode::unavailable, nullptr},
    KnownError{ENOSPC, StatusCode::resource_exhausted,
               "its bus has no room for it; ask for a smaller size or rate, or use another USB port"},
    KnownError{ENOMEM, StatusCode::resource_exhausted, nullptr},
};

/// The first line of a file in sysfs; empty if there is no such file.
std::string attribute(const std::filesystem::path& path) {
  std::string value;
  std::ifstream file(path);
  std::getline(file, value);
  return value;
}

/// Lists the existing devices for messages: "/dev/video0 (UVC Camera), /dev/video2 (...)".
std::string devices_there_are() {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/video4linux", ignored)) {
    const std::string name = attribute(entry.path() / "name");
    found.push_back("/dev/" + entry.path().filename().string() + (name.empty() ? "" : " (" + name + ")"));
  }
  std::ranges::sort(found);
  return found.empty() ? "there is no V4L2 device; is the camera plugged in?" : "there are: " + joined(found);
}

}  // namespace

std::optional<Attachment> attachment_of(const std::string& path) {
  std::error_code failed;
  // Such as /sys/devices/pci0000:00/0000:00:14.0/usb1/1-1/1-1:1.0/video4linux/video0.
  const std::filesystem::path device =
      std::filesystem::canonical("/sys/class/video4linux" / std::filesystem::path(path).filename(), failed);
  if (failed) return std::nullopt;
  const std::filesystem::path parent = device.parent_path().parent_path();
  if (parent.filename() == "virtual") return std::nullopt;
  return Attachment{parent, attribute(device / "index")};
}

std::optional<std::string> node_at(const Attachment& attachment) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(attachment.parent / "video4linux", ignored))
    if (attribute(entry.path() / "index") == attachment.index) return "/dev/" + entry.path().filename().string();
  return std::nullopt;
}

MappedBuffers::~MappedBuffers() {
  for (const Buffer& buffer : buffers_) ::munmap(buffer.memory.data(), buffer.memory.size());
}

Result<Device> Device::open(const std::string& path) {
  FileDescriptor fd(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  Device device(path, std::move(fd));
  if (device.descriptor() < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR)
      return Status(StatusCode::not_found, "v4l2: no device '" + path + "'; " + devices_there_are());
    return device.error("cannot be opened", error);
  }
  if (Status s = device.identify(); !s.ok()) return s;
  return device;
}

Status Device::identify() {
  auto capability = zeroed<v4l2_capability>();
  if (const int failed = call(fd_, VIDIOC_QUERYCAP, &capability); failed != 0) {
    if (failed == ENOTTY || failed == EINVAL)
      return {StatusCode::invalid_argument, "v4l2: '" + path_ + "' is no V4L2 device; " + devices_there_are()};
    return error("does not say what it is", failed);
  }
  card_ = text_of(capability.card);
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    const bool planes = (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
    return {StatusCode::invalid_argument,
            "v4l2: '" + path_ + "' (" + card_ +
                (planes ? ") gives pictures in several planes, which only libcamera's backend reads"
                        : ") is no capture device; many cameras have a second node for metadata") +
                "; " + devices_there_are()};
  }
  if ((can & V4L2_CAP_STREAMING) == 0)
    return {StatusCode::invalid_argument, "v4l2: '" + path_ + "' (" + card_ + ") cannot stream into mapped buffers"};
  return {};
}

std::vector<Mode> Device::modes(const RequestedFormat& wanted) const {
  std::vector<Mode> modes;
  auto format = zeroed<v4l2_fmtdesc>();
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  // Limits the enumeration, in case a faulty driver never ends it.
  constexpr std::uint32_t kMaxEntries = 256;
  for (; format.index < kMaxEntries && call(fd_, VIDIOC_ENUM_FMT, &format) == 0; ++format.index)
    add_modes(format.pixelformat, wanted, modes);
  return modes;
}

void Device::add_modes(std::uint32_t fourcc, const RequestedFormat& wanted, std::vector<Mode>& modes) const {
  constexpr std::uint32_t kMaxEntries = 1024;
  auto size = zeroed<v4l2_frmsizeenum>();
  size.pixel_format = fourcc;
  for (; size.index < kMaxEntries && call(fd_, VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      modes.push_back(
          mode_with_intervals(fourcc, static_cast<int>(size.discrete.width), static_cast<int>(size.discrete.height)));
      continue;
    }
    const auto whole = [](std::uint32_t v) { return static_cast<int>(std::min<std::uint32_t>(v, 1 << 20)); };
    const v4l2_frmsize_stepwise& s = size.stepwise;
    modes.push_back(mode_with_intervals(
        fourcc, nearest_in({whole(s.min_width), whole(s.max_width), whole(s.step_width)}, wanted.width),
        nearest_in({whole(s.min_height), whole(s.max_height), whole(s.step_height)}, wanted.height)));
    return;  // The first entry of a stepwise range is the only one.
  }
  // If the driver does not list sizes, request ours; S_FMT returns the size it chooses.
  if (size.index == 0) modes.push_back({fourcc, wanted.width, wanted.height, {}, false});
}

Mode Device::mode_with_intervals(std::uint32_t fourcc, int width, int height) const {
  constexpr std::uint32_t kMaxEntries = 256;
  Mode mode{fourcc, width, height, {}, false};
  auto interval = zeroed<v4l2_frmivalenum>();
  interval.pixel_format = fourcc;
  interval.width = static_cast<std::uint32_t>(width);
  interval.height = static_cast<std::uint32_t>(height);
  const auto add = [&mode](const v4l2_fract& f) {
    if (f.numerator > 0 && f.denominator > 0) mode.intervals.push_back({f.numerator, f.denominator});
  };
  for (; interval.index < kMaxEntries && call(fd_, VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      add(interval.discrete);
      continue;
    }
    add(interval.stepwise.max);
    add(interval.stepwise.min);
    mode.any_between = true;
    break;
  }
  return mode;
}

Result<NegotiatedFormat> Device::set_mode(const SelectedMode& choice) {
  auto format = zeroed<v4l2_format>();
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_pix_format& pix = format.fmt.pix;
  pix.width = static_cast<std::uint32_t>(choice.mode.width);
  pix.height = static_cast<std::uint32_t>(choice.mode.height);
  pix.pixelformat = choice.mode.fourcc;
  pix.field = V4L2_FIELD_NONE;
  if (const int failed = call(fd_, VIDIOC_S_FMT, &format); failed != 0)
    return error(formatted("refuses %dx%d ", choice.mode.width, choice.mode.height) + fourcc_text(choice.mode.fourcc),
                 failed);
  NegotiatedFormat settled;
  settled.encoding = encoding_of(pix.pixelformat);
  if (settled.encoding == nullptr || pix.width > 1 << 20 || pix.height > 1 << 20)
    return Status(StatusCode::invalid_argument,
                  "v4l2: " + path_ + " gives " + std::to_string(pix.width) + "x" + std::to_string(pix.height) + " " +
                      fourcc_text(pix.pixelformat) + " when asked for " + fourcc_text(choice.mode.fourcc) +
                      ", which cannot be read here; try another format= (" + format_names() + ")");
  if (pix.field != V4L2_FIELD_NONE && pix.field != V4L2_FIELD_ANY)
    return Status(StatusCode::invalid_argument,
                  "v4l2: " + path_ + " gives interlaced pictures; a probe needs progressive ones");
  settled.width = static_cast<int>(pix.width);
  settled.height = static_cast<int>(pix.height);
  settled.bytes_per_line = pix.bytesperline;
  settled.size_image = pix.sizeimage;
  settled.quantization = pix.quantization;
  settled.ycbcr = pix.ycbcr_enc;

  auto parameters = zeroed<v4l2_streamparm>();
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  interval = {choice.interval.numerator, choice.interval.denominator};
  const bool asked = choice.interval.rate() > 0;
  // A driver whose rate cannot be set may still report it.
  if (!asked || call(fd_, VIDIOC_S_PARM, &parameters) != 0)
    if (call(fd_, VIDIOC_G_PARM, &parameters) != 0) interval = {0, 1};
  settled.rate = Fraction{interval.numerator, interval.denominator}.rate();
  return settled;
}

std::optional<Control> Device::control(std::uint32_t id) const {
  constexpr std::uint32_t kCannotBeSet = V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_GRABBED;
  auto query = zeroed<v4l2_queryctrl>();
  query.id = id;
  if (call(fd_, VIDIOC_QUERYCTRL, &query) != 0 || (query.flags & kCannotBeSet) != 0) return std::nullopt;
  return Control{id, {query.minimum, query.maximum, query.step}};
}

int Device::set_control(std::uint32_t id, int value) {
  v4l2_control control{id, value};
  return call(fd_, VIDIOC_S_CTRL, &control);
}

std::optional<int> Device::control_value(std::uint32_t id) const {
  v4l2_control control{id, 0};
  if (call(fd_, VIDIOC_G_CTRL, &control) != 0) return std::nullopt;
  return control.value;
}

Result<MappedBuffers> Device::map_buffers(int count) {
  auto request = zeroed<v4l2_requestbuffers>();
  request.count = static_cast<std::uint32_t>(count);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int failed = call(fd_, VIDIOC_REQBUFS, &request); failed != 0) return error("gives no buffers", failed);
  MappedBuffers mapped;
  // A driver may allocate more buffers than requested.
  for (int i = 0; i < std::min(static_cast<int>(request.count), count); ++i) {
    v4l2_buffer buffer = a_buffer(i);
    if (const int failed = call(fd_, VIDIOC_QUERYBUF, &buffer); failed != 0)
      return error("does not describe its buffers", failed);
    stamps_are_monotonic_ = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    void* const memory = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(),
                                static_cast<off_t>(buffer.m.offset));
    if (memory == MAP_FAILED) return error("does not map its buffers", errno);
    auto exported = zeroed<v4l2_exportbuffer>();
    exported.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    exported.index = static_cast<std::uint32_t>(i);
    exported.flags = O_RDONLY | O_CLOEXEC;
    const bool has_fd = call(fd_, VIDIOC_EXPBUF, &exported) == 0;
    mapped.add({{static_cast<std::byte*>(memory), buffer.length}, FileDescriptor(has_fd ? exported.fd : -1)});
  }
  return mapped;
}

int Device::queue(int index) {
  v4l2_buffer buffer = a_buffer(index);
  return call(fd_, VIDIOC_QBUF, &buffer);
}

int Device::dequeue(v4l2_buffer& buffer) {
  buffer = a_buffer(0);
  return call(fd_, VIDIOC_DQBUF, &buffer);
}

int Device::stream_on() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return call(fd_, VIDIOC_STREAMON, &type);
}

int Device::stream_off() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return call(fd_, VIDIOC_STREAMOFF, &type);
}

Status Device::error(const std::string& doing, int error) const {
  const auto known = std::ranges::find(kKnownErrors, error, &KnownError::error);
  const bool is_known = known != kKnownErrors.end();
  return {is_known ? known->code : StatusCode::internal,
          "v4l2: '" + path_ + "'" + (card_.empty() ? "" : " (" + card_ + ")") + " " + doing + ": " +
              (is_known && known->remedy != nullptr ? known->remedy : std::strerror(error))};
}

PollResult wait_for(const Device* device, int stop, int milliseconds) {
  // poll() ignores negative descriptors.
  std::array<pollfd, 2> watched = {pollfd{stop, POLLIN, 0},
                                   pollfd{device != nullptr ? device->descriptor() : -1, POLLIN, 0}};
  // An interruption counts as a timeout: the caller waits again.
  if (::poll(watched.data(), watched.size(), milliseconds) <= 0) return PollResult::nothing;
  if (watched[0].revents != 0) return PollResult::stopped;
  return (watched[1].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 ? PollResult::broken : PollResult::ready;
}

}  // namespace lightwell::v4l2

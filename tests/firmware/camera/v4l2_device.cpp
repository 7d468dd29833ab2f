#include "firmware/camera/v4l2_device.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <sys/mman.h>

#include "firmware/camera/v4l2_picture.hpp"

namespace lightwell::test {
namespace {

template <std::size_t N>
void put_text(unsigned char (&field)[N], const std::string& text) {
  std::snprintf(reinterpret_cast<char*>(field), N, "%s", text.c_str());
}

int fitted(int v, int least, int most, int step) {
  v = std::clamp(v, least, most);
  return least + (v - least) / std::max(step, 1) * std::max(step, 1);
}

}  // namespace

DeviceKind webcam(std::uint32_t fourcc) {
  DeviceKind kind;
  kind.formats = {{fourcc, {{64, 48}, {32, 24}}, {}, {50, 25}}};
  kind.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  kind.controls = {
      {V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY, false, {1, 3}}},
      {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 1, 100, false, {}}},
      {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {0, 1, 1, 1, false, {}}},
      {V4L2_CID_GAIN, {10, 255, 1, 64, false, {}}},
      {V4L2_CID_AUTO_WHITE_BALANCE, {0, 1, 1, 1, false, {}}},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {2800, 6500, 10, 4000, false, {}}},
      {V4L2_CID_POWER_LINE_FREQUENCY, {0, 2, 1, 2, false, {0, 1, 2}}},
  };
  return kind;
}

V4l2Device::V4l2Device(DeviceKind kind)
    : kind_(std::move(kind)), changed_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), controls_(kind_.controls) {
  sensor_ = std::thread([this] { expose(); });
}

V4l2Device::~V4l2Device() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  sensor_.join();
  for (const std::span<std::byte> old : memory_of_before_) ::munmap(old.data(), old.size());
  if (!memory_.empty()) ::munmap(memory_.data(), memory_.size());
  ::close(changed_);
}

void V4l2Device::plug_in(int file) {
  const std::lock_guard lock(mutex_);
  if (::ftruncate(file, static_cast<off_t>(kMemory)) != 0) std::abort();
  void* const memory = ::mmap(nullptr, kMemory, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) std::abort();
  if (!memory_.empty()) memory_of_before_.push_back(memory_);
  memory_ = {static_cast<std::byte*>(memory), kMemory};
  // Plugging in resets all controls.
  controls_ = kind_.controls;
  drop_buffers();
  held_ = silent_ = false;
  cut_short_ = 0;
  plugged_ = true;
}

void V4l2Device::pull_out() {
  const std::lock_guard lock(mutex_);
  plugged_ = false;
  drop_buffers();
  tell();
}

void V4l2Device::drop_buffers() {
  streaming_ = false;
  slots_.clear();
  queue_.clear();
  done_.clear();
}

void V4l2Device::tell() const { (void)::eventfd_write(changed_, 1); }

short V4l2Device::events() const {
  const std::lock_guard lock(mutex_);
  if (!plugged_) return POLLERR | POLLHUP;
  if (!streaming_) return POLLERR;
  return done_.empty() ? 0 : POLLIN;
}

void V4l2Device::set_busy(bool busy) {
  const std::lock_guard lock(mutex_);
  held_ = busy;
}

void V4l2Device::stop_delivery(bool silent) {
  const std::lock_guard lock(mutex_);
  silent_ = silent;
}

void V4l2Device::damage(int frames, bool marked) {
  const std::lock_guard lock(mutex_);
  cut_short_ = frames;
  cut_is_marked_ = marked;
}

int V4l2Device::exposure_of(std::uint32_t sequence) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(taken_, sequence, &Taken::sequence);
  return found == taken_.end() ? 0 : found->exposure;
}

std::int64_t V4l2Device::middle_ns_of(std::uint32_t sequence) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(taken_, sequence, &Taken::sequence);
  return found == taken_.end() ? 0 : found->middle_ns;
}

int V4l2Device::control(std::uint32_t id) const {
  const std::lock_guard lock(mutex_);
  return controls_.at(id).value;
}

bool V4l2Device::streaming() const {
  const std::lock_guard lock(mutex_);
  return streaming_;
}

int V4l2Device::ioctl(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  if (!plugged_) return ENODEV;
  switch (request) {
    case VIDIOC_QUERYCAP:
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return on_query(request, argument);
    case VIDIOC_S_FMT:
    case VIDIOC_G_FMT:
    case VIDIOC_S_PARM:
    case VIDIOC_G_PARM:
      return on_format(request, argument);
    case VIDIOC_QUERYCTRL:
    case VIDIOC_S_CTRL:
    case VIDIOC_G_CTRL:
      return on_control(request, argument);
    default:
      return on_buffer(request, argument);
  }
}

const DeviceFormat* V4l2Device::format_of(std::uint32_t fourcc) const {
  const auto found = std::ranges::find(kind_.formats, fourcc, &DeviceFormat::fourcc);
  return found == kind_.formats.end() ? nullptr : &*found;
}

int V4l2Device::on_query(unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCAP) {
    auto& c = *static_cast<v4l2_capability*>(argument);
    put_text(c.driver, "test");
    put_text(c.card, kind_.card);
    c.device_caps =
        kind_.capabilities != 0 ? kind_.capabilities : std::uint32_t{V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING};
    // Like a camera with a second node for metadata: capabilities of the whole device, and device_caps of this node.
    c.capabilities = c.device_caps | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_META_CAPTURE | V4L2_CAP_DEVICE_CAPS;
    return 0;
  }
  if (request == VIDIOC_ENUM_FMT) {
    auto& f = *static_cast<v4l2_fmtdesc*>(argument);
    if (f.index >= kind_.formats.size()) return EINVAL;
    f.pixelformat = kind_.formats[f.index].fourcc;
    return 0;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& s = *static_cast<v4l2_frmsizeenum*>(argument);
    const DeviceFormat* const format = format_of(s.pixel_format);
    if (format == nullptr) return EINVAL;
    if (format->sizes.empty()) {
      if (s.index > 0 || format->steps.max_width == 0) return EINVAL;
      const auto u = [](int v) { return static_cast<std::uint32_t>(v); };
      s.type = V4L2_FRMSIZE_TYPE_STEPWISE;
      s.stepwise = {u(format->steps.min_width),  u(format->steps.max_width),  u(format->steps.step_width),
                    u(format->steps.min_height), u(format->steps.max_height), u(format->steps.step_height)};
      return 0;
    }
    if (s.index >= format->sizes.size()) return EINVAL;
    s.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    s.discrete = {static_cast<std::uint32_t>(format->sizes[s.index].width),
                  static_cast<std::uint32_t>(format->sizes[s.index].height)};
    return 0;
  }
  auto& i = *static_cast<v4l2_frmivalenum*>(argument);
  const DeviceFormat* const format = format_of(i.pixel_format);
  if (format == nullptr || i.index >= format->rates.size()) return EINVAL;
  i.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  i.discrete = {1, static_cast<std::uint32_t>(format->rates[i.index])};
  return 0;
}

int V4l2Device::on_format(unsigned long request, void* argument) {
  if (request == VIDIOC_S_PARM || request == VIDIOC_G_PARM) {
    const DeviceFormat* const format = format_of(fourcc_);
    if (format == nullptr || format->rates.empty()) return ENOTTY;
    auto& p = static_cast<v4l2_streamparm*>(argument)->parm.capture;
    if (request == VIDIOC_S_PARM && p.timeperframe.numerator > 0) {
      const double wanted = static_cast<double>(p.timeperframe.denominator) / p.timeperframe.numerator;
      rate_ = *std::ranges::min_element(format->rates,
                                        [wanted](int a, int b) { return std::abs(a - wanted) < std::abs(b - wanted); });
    }
    p.capability = V4L2_CAP_TIMEPERFRAME;
    p.timeperframe = {1, static_cast<std::uint32_t>(rate_)};
    return 0;
  }
  if (held_) return EBUSY;
  auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
  if (request == VIDIOC_S_FMT) {
    const DeviceFormat* format = format_of(pix.pixelformat);
    if (format == nullptr) format = &kind_.formats.front();
    int width = static_cast<int>(pix.width), height = static_cast<int>(pix.height);
    if (kind_.may_shrink) {
      width /= 2;
      height /= 2;
    } else if (!format->sizes.empty()) {
      const auto same = std::ranges::find_if(
          format->sizes, [&](const DeviceFormat::Size& s) { return s.width == width && s.height == height; });
      const DeviceFormat::Size& s = same == format->sizes.end() ? format->sizes.front() : *same;
      width = s.width;
      height = s.height;
    } else if (format->steps.max_width > 0) {
      width = fitted(width, format->steps.min_width, format->steps.max_width, format->steps.step_width);
      height = fitted(height, format->steps.min_height, format->steps.max_height, format->steps.step_height);
    }
    fourcc_ = format->fourcc;
    width_ = width;
    height_ = height;
    if (!format->rates.empty()) rate_ = format->rates.front();
  }
  const std::size_t packed = packed_row_bytes(fourcc_, width_);
  const std::size_t row = packed == 0 ? 0 : packed + kind_.padding;
  const std::size_t bytes = encoded_bytes(fourcc_, row, width_, height_);
  slot_bytes_ = (bytes + kPage - 1) / kPage * kPage;
  pix.width = static_cast<std::uint32_t>(width_);
  pix.height = static_cast<std::uint32_t>(height_);
  pix.pixelformat = fourcc_;
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = static_cast<std::uint32_t>(row);
  pix.sizeimage = static_cast<std::uint32_t>(bytes);
  return 0;
}

int V4l2Device::on_control(unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCTRL) {
    auto& q = *static_cast<v4l2_queryctrl*>(argument);
    const auto found = controls_.find(q.id);
    if (found == controls_.end()) return EINVAL;
    q.type = found->second.menu.empty() ? V4L2_CTRL_TYPE_INTEGER : V4L2_CTRL_TYPE_MENU;
    q.minimum = found->second.min;
    q.maximum = found->second.max;
    q.step = found->second.step;
    q.flags = found->second.read_only ? V4L2_CTRL_FLAG_READ_ONLY : 0;
    put_text(q.name, "control");
    return 0;
  }
  auto& c = *static_cast<v4l2_control*>(argument);
  const auto found = controls_.find(c.id);
  if (found == controls_.end()) return EINVAL;
  DeviceControl& control = found->second;
  if (request == VIDIOC_S_CTRL) {
    if (control.read_only) return EACCES;
    if (!control.menu.empty() && std::ranges::find(control.menu, c.value) == control.menu.end()) return EINVAL;
    // As in UVC, a control cannot be set while its automatic control is on.
    const auto automatic = controls_.find(V4L2_CID_EXPOSURE_AUTO);
    if (c.id == V4L2_CID_EXPOSURE_ABSOLUTE && automatic != controls_.end() &&
        automatic->second.value != V4L2_EXPOSURE_MANUAL)
      return EACCES;
    control.value = fitted(c.value, control.min, control.max, control.step);
  }
  c.value = control.value;
  return 0;
}

}  // namespace lightwell::test

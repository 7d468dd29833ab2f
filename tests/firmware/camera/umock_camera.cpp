#include "firmware/camera/umock_camera.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <poll.h>
#include <set>
#include <umockdev.h>
#include <unistd.h>

#include <linux/ioctl.h>
#include <linux/stat.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>

namespace lightwell::test {
namespace {

/// The testbed of umockdev, of which there is one per process; kept between tests.
struct Bed {
  std::mutex mutex;
  std::shared_ptr<V4l2Device> device;
  std::uintptr_t plugging = 0;    ///< Number of times it was plugged in.
  std::uint64_t inode = 0;        ///< Inode of the current node.
  std::set<std::uint64_t> nodes;  ///< Inodes of all nodes so far.
  UMockdevTestbed* testbed = nullptr;
};

Bed& bed() {
  // Never destroyed: static devices of tests use it when the program ends.
  static Bed& one = *new Bed;
  return one;
}

/// Inode of a descriptor, by the system call without umockdev's wrappers; 0 if there is none.
std::uint64_t inode_of(int fd) {
  struct statx found {};
  if (::syscall(SYS_statx, fd, "", AT_EMPTY_PATH, STATX_INO, &found) != 0) return 0;
  return found.stx_ino;
}

std::filesystem::path in_bed(const std::string& path) {
  gchar* const root = umockdev_testbed_get_root_dir(bed().testbed);
  std::filesystem::path whole = std::string(root) + path;
  g_free(root);
  return whole;
}

gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer) {
  const gulong request = umockdev_ioctl_client_get_request(client);
  std::shared_ptr<V4l2Device> device;
  {
    const std::lock_guard lock(bed().mutex);
    // A descriptor opened before the device was unplugged stays invalid, even after the device is back.
    constexpr const char* kOpened = "lightwell-opened";
    auto opened = reinterpret_cast<std::uintptr_t>(g_object_get_data(G_OBJECT(client), kOpened));
    if (opened == 0) {
      opened = bed().plugging;
      g_object_set_data(G_OBJECT(client), kOpened, reinterpret_cast<gpointer>(opened));
    }
    if (opened == bed().plugging) device = bed().device;
  }
  UMockdevIoctlData* const address = umockdev_ioctl_client_get_arg(client);
  const gsize size = _IOC_SIZE(request);
  UMockdevIoctlData* data = umockdev_ioctl_data_resolve(address, 0, size, nullptr);
  int failed = ENODEV;
  if (data == nullptr) {
    failed = EFAULT;
  } else if (device != nullptr) {
    guint8* bytes = nullptr;
    int length = 0;
    umockdev_ioctl_data_retrieve(data, &bytes, &length);
    failed = device->ioctl(request, bytes);
    if (failed == 0) umockdev_ioctl_data_update(data, 0, bytes, length);
    g_free(bytes);  // The callee has copied them.
  }
  g_clear_object(&data);
  umockdev_ioctl_client_complete(client, failed == 0 ? 0 : -1, failed);
  return TRUE;
}

/// The USB interface of the camera.
const std::string kPort = "/devices/pci0000:00/usb1/1-1/1-1:1.0";

void make_bed() {
  if (bed().testbed != nullptr) return;
  bed().testbed = umockdev_testbed_new();
  if (umockdev_in_mock_environment() == FALSE) {
    std::fprintf(stderr, "run this test by ctest, or with LD_PRELOAD=libumockdev-preload.so.0\n");
    std::exit(1);
  }
  UMockdevIoctlBase* const handler = umockdev_ioctl_base_new();
  g_signal_connect(handler, "handle-ioctl", G_CALLBACK(on_ioctl), nullptr);
  for (const std::string& path : {UmockCamera::path(), UmockCamera::path_renumbered(), UmockCamera::path_by_id()}) {
    GError* error = nullptr;
    if (umockdev_testbed_attach_ioctl(bed().testbed, path.c_str(), handler, &error) != FALSE) continue;
    std::fprintf(stderr, "umockdev: %s\n", error->message);
    std::exit(1);
  }
}

}  // namespace

UmockCamera::UmockCamera(DeviceKind kind) {
  make_bed();
  plug_in(std::move(kind));
}

UmockCamera::~UmockCamera() {
  unplug();
  const std::lock_guard lock(bed().mutex);
  bed().device.reset();
}

std::string UmockCamera::path() { return "/dev/video90"; }
std::string UmockCamera::path_renumbered() { return "/dev/video92"; }
std::string UmockCamera::path_by_id() { return "/dev/v4l/by-id/usb-Test_Camera-video-index0"; }

V4l2Device& UmockCamera::device() { return *bed().device; }

void UmockCamera::plug_in(DeviceKind kind) {
  unplug();
  auto device = std::make_shared<V4l2Device>(std::move(kind));
  {
    const std::lock_guard lock(bed().mutex);
    // The previous device is destroyed after the lock is released, because other threads may still use it.
    bed().device.swap(device);
  }
  plug_in();
}

void UmockCamera::plug_in() { plug_in_as(path()); }

void UmockCamera::plug_in_renumbered() { plug_in_as(path_renumbered()); }

void UmockCamera::plug_in_as(const std::string& path) {
  if (plugged_) return;
  plugged_ = true;
  path_ = path;
  GError* error = nullptr;
  const std::string name = path.substr(std::string("/dev/").size());
  const std::string description =
      "P: " + kPort + "/video4linux/" + name + "\nN: " + name + "=00\nE: SUBSYSTEM=video4linux\nE: DEVNAME=" + path +
      "\nA: dev=81:" + name.substr(std::string("video").size()) + "\nA: index=0\nA: name=Test Camera\n";
  // Open the node by its path in the testbed, so that this does not count as opening the device.
  const std::string node = in_bed(path).string();
  if (umockdev_testbed_add_from_string(bed().testbed, description.c_str(), &error) == FALSE) {
    std::fprintf(stderr, "umockdev: %s\n", error->message);
    std::exit(1);
  }
  const int file = ::open(node.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) {
    std::perror(node.c_str());
    std::exit(1);
  }
  {
    const std::lock_guard lock(bed().mutex);
    bed().inode = inode_of(file);
    bed().nodes.insert(bed().inode);
    ++bed().plugging;
    bed().device->plug_in(file);
  }
  ::close(file);
  const std::filesystem::path link = in_bed(path_by_id());
  std::filesystem::create_directories(link.parent_path());
  std::error_code ignored;
  std::filesystem::remove(link, ignored);
  std::filesystem::create_symlink("../../" + name, link);
}

void UmockCamera::unplug() {
  if (!plugged_) return;
  plugged_ = false;
  umockdev_testbed_remove_device(bed().testbed, ("/sys" + kPort + "/video4linux/" + path_.substr(5)).c_str());
  std::error_code ignored;
  std::filesystem::remove(in_bed(path_), ignored);
  std::filesystem::remove(in_bed(path_by_id()), ignored);
  std::shared_ptr<V4l2Device> device;
  {
    const std::lock_guard lock(bed().mutex);
    bed().inode = 0;
    device = bed().device;
  }
  device->pull_out();
}

int UmockCamera::mappings() {
  std::ifstream maps("/proc/self/maps");
  int count = 0;
  for (std::string line; std::getline(maps, line);)
    if (line.find("/dev/video9") != std::string::npos) ++count;
  return count;
}

int UmockCamera::descriptors() {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) ++count;
  return count;
}

namespace {

/// The device of a descriptor, and whether it is still plugged in.
struct Behind {
  std::shared_ptr<V4l2Device> device;
  bool dead = false;
};

Behind behind(int fd) {
  const std::uint64_t inode = fd < 0 ? 0 : inode_of(fd);
  const std::lock_guard lock(bed().mutex);
  if (inode == 0 || !bed().nodes.contains(inode)) return {};
  return {bed().device, inode != bed().inode};
}

int kernel_poll(pollfd* fds, nfds_t count, int timeout_ms) {
  const timespec limit{timeout_ms / 1000, timeout_ms % 1000 * 1'000'000L};
  return static_cast<int>(
      ::syscall(SYS_ppoll, fds, count, timeout_ms < 0 ? nullptr : &limit, nullptr, sizeof(std::uint64_t)));
}

std::int64_t now_ms() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1000LL + t.tv_nsec / 1'000'000;
}

}  // namespace

/// poll(2) with descriptors of the device replaced by its event descriptors.
int poll_with_devices(pollfd* fds, nfds_t count, int timeout_ms) {
  constexpr nfds_t kMost = 8;
  std::array<Behind, kMost> devices;
  bool any = false;
  for (nfds_t i = 0; count <= kMost && i < count; ++i) {
    devices[i] = behind(fds[i].fd);
    any = any || devices[i].device != nullptr;
  }
  if (!any) return kernel_poll(fds, count, timeout_ms);

  const std::int64_t end = timeout_ms < 0 ? 0 : now_ms() + timeout_ms;
  while (true) {
    std::array<pollfd, kMost> real{};
    int ready = 0;
    for (nfds_t i = 0; i < count; ++i) {
      real[i] = fds[i];
      fds[i].revents = 0;
      if (devices[i].device == nullptr) continue;
      // Clear the event before querying the device; otherwise an event in between would be missed.
      eventfd_t taken = 0;
      (void)::eventfd_read(devices[i].device->event_descriptor(), &taken);
      const short events = devices[i].dead ? POLLERR | POLLHUP : devices[i].device->events();
      fds[i].revents = static_cast<short>(events & (fds[i].events | POLLERR | POLLHUP));
      if (fds[i].revents != 0) ++ready;
      real[i] = {devices[i].device->event_descriptor(), POLLIN, 0};
    }
    const std::int64_t left = timeout_ms < 0 ? -1 : std::max<std::int64_t>(0, end - now_ms());
    const int others = kernel_poll(real.data(), count, ready > 0 ? 0 : static_cast<int>(left));
    if (others < 0) return others;
    for (nfds_t i = 0; i < count; ++i) {
      if (devices[i].device != nullptr) continue;
      fds[i].revents = real[i].revents;
      if (fds[i].revents != 0) ++ready;
    }
    if (ready > 0 || (timeout_ms >= 0 && now_ms() >= end)) return ready;
  }
}

}  // namespace lightwell::test

/// Replaces the C library's function in the whole program.
extern "C" int poll(pollfd* fds, nfds_t count, int timeout_ms) {
  return lightwell::test::poll_with_devices(fds, count, timeout_ms);
}

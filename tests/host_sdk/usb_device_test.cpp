// The SDK's USB connection with the real libusb, on a device simulated by umockdev.
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <lightwell/discover.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/probe.hpp>

#include "host_sdk/scenes.hpp"
#include "host_sdk/umock_probe.hpp"
#include "support/captured_planes.hpp"
#include "support/child.hpp"

namespace lightwell::test {
namespace {

ProbeOptions options() {
  ProbeOptions o;
  o.connect_timeout = Duration::from_seconds(20);
  o.retry_min = {5'000'000};
  o.retry_max = {50'000'000};
  o.silence_limit = Duration::from_seconds(30);
  return o;
}
/// The options of a client that searches at this interval while the probe is missing.
ProbeOptions options_with_retry(Duration interval) {
  ProbeOptions o = options();
  o.retry_min = o.retry_max = interval;
  return o;
}
/// Only an event of the bus begins a search.
ProbeOptions hotplug_alone() { return options_with_retry(Duration::from_seconds(3600)); }

::testing::AssertionResult received(const Probe& probe, std::uint64_t count) {
  return becomes_true(std::to_string(count) + " descriptors are here (" + probe.stats().last_error + ")",
                      [&] { return probe.stats().received >= count; });
}

TEST(UsbDevice, IsOpenedAndDescriptorsAreReceived) {
  UmockProbe device;
  Result<Probe> probe = Probe::connect("usb:", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(probe->info().name, "attic");
  EXPECT_LE(std::abs(probe->info().clock_offset.ns), probe->info().clock_uncertainty.ns);
  device.send(encoded(numbered(5, 1)));
  device.send(encoded(numbered(6, 2)));
  ASSERT_TRUE(received(*probe, 2));
  EXPECT_EQ(probe->latest().descriptor().sequence, 6U);
  EXPECT_EQ(probe->stats().state, LinkState::connected);
  EXPECT_EQ(device.interfaces_set(), 1) << "SET_INTERFACE tells the probe that a new reader is connected";

  EstimatorConfig config;
  config.band = 2;
  const Status set = probe->set_estimator(config);
  EXPECT_TRUE(set.ok()) << set.message();
  ASSERT_TRUE(probe->change_estimator({.max_lights = 3}).ok());
  config.max_lights = 3;
  EXPECT_EQ(*probe->estimator_config(), config);
  const Result<double> scale = probe->report_lux(100, {0, 1, 0});
  ASSERT_TRUE(scale.ok()) << scale.status().message();
  EXPECT_EQ(*scale, 200);
}

TEST(UsbDevice, IsDiscoveredWithVersionAndCalibration) {
  const auto by_usb = [] {
    DiscoverOptions look;
    look.timeout = Duration::from_seconds(5);
    const Result<Discovered> found = discover(look);
    EXPECT_TRUE(found.ok()) << found.status().message();
    std::vector<FoundProbe> out;
    for (const FoundProbe& probe : found->probes)
      if (probe.by == FoundBy::usb) out.push_back(probe);
    return out;
  };
  EXPECT_TRUE(by_usb().empty());
  UmockProbe device;
  const std::vector<FoundProbe> found = by_usb();
  ASSERT_EQ(found.size(), 1U);
  const Result<Probe> probe = Probe::connect("usb:", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(found[0].name, probe->info().name);
  EXPECT_EQ(found[0].version, probe->info().version);
  EXPECT_EQ(found[0].id, probe->info().id);
  EXPECT_EQ(found[0].calibration_id, probe->info().calibration_id);
  EXPECT_EQ(found[0].instance, "LW-1");
  ASSERT_EQ(found[0].links.size(), 1U);
  EXPECT_EQ(found[0].links[0].uri, "usb:LW-1");
}

TEST(UsbDevice, EndpointsAndInterfaceAreReadFromItsDescriptors) {
  UsbDeviceKind kind;
  kind.in = 0x8C;
  kind.out = 0x03;
  kind.interfaces_before = 2;
  UmockProbe device(kind);
  const Result<Probe> probe = Probe::connect("usb:LW-1", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  device.send(encoded(numbered(1, 1)));
  EXPECT_TRUE(received(*probe, 1));
}

TEST(UsbDevice, OtherDevicesWithTheSameNumberAreIgnored) {
  UsbDeviceKind other;
  other.interface_subclass = 0;
  const UmockProbe not_a_probe(other, 2);
  UmockProbe device;
  const Result<Probe> probe = Probe::connect("usb:", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(not_a_probe.interfaces_set(), 0);
}

TEST(UsbDevice, SerialNumberSelectsOneOfSeveral) {
  UsbDeviceKind second;
  second.serial = "LW-2";
  UmockProbe one;
  UmockProbe two(second, 2);
  ProbeOptions quick = options();
  quick.connect_timeout = Duration::from_seconds(1);
  const std::string several = Probe::connect("usb:", quick).status().message();
  EXPECT_NE(several.find("usb:LW-1"), std::string::npos) << several;
  EXPECT_NE(several.find("usb:LW-2"), std::string::npos) << several;
  const Result<Probe> absent = Probe::connect("usb:LW-3", quick);
  ASSERT_FALSE(absent.ok());
  EXPECT_NE(absent.status().message().find("usb:LW-2"), std::string::npos) << absent.status().message();

  const Result<Probe> probe = Probe::connect("usb:LW-2", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(one.interfaces_set(), 0);
  EXPECT_EQ(two.interfaces_set(), 1);
}

TEST(UsbDevice, MissingProbeIsReportedAndFoundWhenPluggedIn) {
  ProbeOptions quick = options();
  quick.connect_timeout = Duration::from_seconds(0.3);
  const Result<Probe> none = Probe::connect("usb:", quick);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.status().code(), StatusCode::unavailable);
  EXPECT_NE(none.status().message().find("no probe is plugged in"), std::string::npos) << none.status().message();

  UmockProbe device;
  const Result<Probe> probe = Probe::connect("usb:", hotplug_alone());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  device.unplug();
  ASSERT_TRUE(becomes_true("the probe is missed", [&] { return probe->stats().state == LinkState::waiting; }));
  device.plug_in();
  EXPECT_TRUE(
      becomes_true("it is found by its event, not by looking again", [&] { return probe->stats().reconnects == 1; }));
}

/// Number of open file descriptors without umockdev's sockets for ioctl: its thread closes them later, and when two
/// threads open and close devices concurrently, its preloaded library leaks a pair of them.
std::ptrdiff_t handles_of_ours() {
  const auto named_by_the_bed = [](int fd, auto name_of) {
    sockaddr_un name{};
    socklen_t size = sizeof name;
    return name_of(fd, reinterpret_cast<sockaddr*>(&name), &size) == 0 && name.sun_family == AF_UNIX &&
           std::string_view(name.sun_path, sizeof name.sun_path).find("umockdev") != std::string_view::npos;
  };
  return std::count_if(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator(),
                       [&](const std::filesystem::directory_entry& entry) {
                         const int fd = std::stoi(entry.path().filename());
                         return !named_by_the_bed(fd, ::getsockname) && !named_by_the_bed(fd, ::getpeername);
                       });
}

TEST(UsbDevice, HundredReplugsLeakNothing) {
  UmockProbe device;
  // A search that finds no probe initialises libusb again. umockdev aborts if a probe is plugged in while libusb closes
  // its socket of events, so that only the event begins a search here.
  const Result<Probe> probe = Probe::connect("usb:", hotplug_alone());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  long threads = 0;
  std::ptrdiff_t files = 0;
  for (std::uint64_t i = 0; i < 100; ++i) {
    device.send(encoded(numbered(i + 1, 1)));
    ASSERT_TRUE(received(*probe, i + 1)) << "after " << i << " replugs";
    if (i == 20) {
      threads = proc_status_number(::getpid(), "Threads");
      files = handles_of_ours();
    }
    device.unplug();
    ASSERT_TRUE(becomes_true("the probe is missed", [&] { return probe->stats().state == LinkState::waiting; }));
    EXPECT_EQ(probe->latest().descriptor().sequence, i + 1) << "the last descriptor is kept";
    device.plug_in();
    ASSERT_TRUE(becomes_true("the link is back (" + probe->stats().last_error + ")",
                             [&] { return probe->stats().reconnects == i + 1; }));
  }
  EXPECT_EQ(probe->stats().gaps, 0U);
  EXPECT_TRUE(becomes_true("as many handles are open as early on", [&] { return handles_of_ours() <= files; }))
      << handles_of_ours() << " instead of " << files;
  EXPECT_LE(proc_status_number(::getpid(), "Threads"), threads);
}

TEST(UsbDevice, SearchesForAMissingProbeLeakNothing) {
  UmockProbe device;
  const Result<Probe> probe = Probe::connect("usb:", options_with_retry(Duration::from_seconds(0.001)));
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  device.unplug();
  ASSERT_TRUE(becomes_true("the probe is missed", [&] { return !probe->stats().last_error.empty(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const std::ptrdiff_t files = handles_of_ours();
  const long threads = proc_status_number(::getpid(), "Threads");
  std::this_thread::sleep_for(std::chrono::seconds(1));
  // A search opens handles and starts a thread of libusb for a while.
  EXPECT_TRUE(becomes_true("as many handles are open as before", [&] { return handles_of_ours() <= files; }));
  EXPECT_TRUE(becomes_true("as many threads run as before",
                           [&] { return proc_status_number(::getpid(), "Threads") <= threads; }));
}

TEST(UsbDevice, StallIsClearedAndBusErrorsAreTolerated) {
  UmockProbe device;
  const Result<Probe> probe = Probe::connect("usb:", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  std::uint64_t sequence = 0;
  for (const int status : {-EPIPE, -EPROTO, -EILSEQ, -EOVERFLOW, -EPIPE}) {
    device.fail_next(status);
    device.send(encoded(numbered(++sequence, 1)));
    ASSERT_TRUE(received(*probe, sequence)) << status;
  }
  EXPECT_EQ(device.halts_cleared(), 2);
  EXPECT_EQ(probe->stats().reconnects, 0U);
  EXPECT_NE(probe->stats().last_error, "");
}

TEST(UsbDevice, ReceivesMessagesOfEverySize) {
  UmockProbe device;
  std::vector<std::string> arrived;
  ProbeOptions o = options();
  o.on_descriptor = [&](const Arrival& a) {
    arrived.emplace_back(reinterpret_cast<const char*>(a.bytes.data()), a.bytes.size());
  };
  const Result<Probe> probe = Probe::connect("usb:", o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  std::vector<std::string> sent;
  // Around the sizes of packets (512) and of transfers (16 KiB), header included, and the largest of all.
  for (const std::size_t frame :
       {480U, 511U, 512U, 513U, 1024U, 16'383U, 16'384U, 16'385U, 32'768U, 49'152U, 65'568U}) {
    const std::string small = encoded(numbered(sent.size() + 1, 1));
    // Field 1000, bytes: what a later version may add.
    std::string filler(frame - 32 - small.size() - 5, 'x');
    const std::size_t n = filler.size();
    const std::string head = {'\xC2', '\x3E', static_cast<char>((n & 127U) | 128U),
                              static_cast<char>((n >> 7 & 127U) | 128U), static_cast<char>(n >> 14)};
    sent.push_back(small + head + filler);
    ASSERT_EQ(sent.back().size(), frame - 32);
    device.send(sent.back());
    ASSERT_TRUE(received(*probe, sent.size())) << frame;
  }
  EXPECT_EQ(arrived, sent);
  EXPECT_EQ(probe->stats().frames_refused, 0U);
}

TEST(UsbDevice, HostileBytesAreRejectedAndCounted) {
  UmockProbe device;
  const Result<Probe> probe = Probe::connect("usb:", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  device.send_bytes({});
  device.send_bytes(std::vector<std::byte>(65 * 1024, std::byte{'L'}));
  device.send_bytes({std::byte{'L'}, std::byte{'W'}, std::byte{'F'}, std::byte{0xA7}, std::byte{9}});
  device.send("no descriptor at all \xFF\xFF");
  device.send(encoded(numbered(3, 1)));
  ASSERT_TRUE(received(*probe, 1));
  const LinkStats stats = probe->stats();
  EXPECT_EQ(stats.undecodable, 1U) << "an intact frame of something else";
  EXPECT_GE(stats.frames_refused, 1U);
  EXPECT_EQ(stats.reconnects, 0U);
  EXPECT_EQ(probe->latest().descriptor().sequence, 3U);
}

/// The simulated probe answers as firmware that knows no planes.
TEST(UsbDevice, OlderFirmwareWithoutPlanesIsReported) {
  UmockProbe device;
  ProbeOptions o = options();
  o.plane = PlaneReception::receive;
  const Result<Probe> probe = Probe::connect("usb:", o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(becomes_true("the error is reported", [&] {
    return probe->stats().last_error.find("sends no planes by USB") != std::string::npos;
  })) << probe->stats().last_error;
  device.send(encoded(numbered(1, 1)));
  ASSERT_TRUE(received(*probe, 1));
  EXPECT_EQ(probe->plane().validity(), Validity::none);
  EXPECT_EQ(probe->stats().reconnects, 0U);
}

TEST(UsbDevice, PlanesThatWereNotRequestedAreRefused) {
  UmockProbe device;
  const Result<Probe> probe = Probe::connect("usb:", options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  PlaneEncoder encoder;
  const auto update = encoder.encode(linear_plane(), {0});
  ASSERT_TRUE(update.ok());
  FrameWriter writer(0xABCD);
  std::vector<std::byte> frame;
  ASSERT_TRUE(writer.write(FrameKind::plane, update->front(), frame).ok());
  device.send_bytes(frame);
  EXPECT_TRUE(becomes_true("it is counted", [&] { return probe->stats().frames_refused == 1; }));
  EXPECT_EQ(probe->plane().validity(), Validity::none);
}

TEST(UsbDevice, OnlyOneProgramCanOpenIt) {
  UmockProbe device;
  ProbeOptions quick = options();
  quick.connect_timeout = Duration::from_seconds(1);
  {
    const Result<Probe> first = Probe::connect("usb:", options());
    ASSERT_TRUE(first.ok()) << first.status().message();
    const Result<Probe> second = Probe::connect("usb:", quick);
    ASSERT_FALSE(second.ok());
    EXPECT_NE(second.status().message().find("another program"), std::string::npos) << second.status().message();
  }
  EXPECT_TRUE(Probe::connect("usb:", options()).ok()) << "free again";
}

TEST(UsbDevice, ReconnectsToAProbeThatHangs) {
  UmockProbe device;
  ProbeOptions o = options();
  o.silence_limit = Duration::from_seconds(2);
  const Result<Probe> probe = Probe::connect("usb:", o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  device.set_answering(UmockProbe::Answering::no);
  ASSERT_TRUE(becomes_true("it is left", [&] { return probe->stats().state != LinkState::connected; }));
  EXPECT_NE(probe->stats().last_error.find("no data"), std::string::npos) << probe->stats().last_error;
  device.set_answering(UmockProbe::Answering::yes);
  EXPECT_TRUE(becomes_true("it is back", [&] { return probe->stats().reconnects >= 1; }));
}

TEST(UsbDevice, ClosesWithinASecondPluggedInOrNot) {
  using Clock = std::chrono::steady_clock;
  UmockProbe device;
  for (int round = 0; round < 2; ++round) {
    Result<Probe> probe = Probe::connect("usb:", options());
    ASSERT_TRUE(probe.ok());
    if (round == 1) device.unplug();
    const auto start = Clock::now();
    { const Probe gone = std::move(*probe); }
    EXPECT_LT(std::chrono::duration<double>(Clock::now() - start).count(), 10) << "ten times the promise";
  }
}

}  // namespace
}  // namespace lightwell::test

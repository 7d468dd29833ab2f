// The checks of `lightwell doctor`, each by itself. Those that need a probe: tests/e2e/doctor_test.cpp.
#include <chrono>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <thread>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doctor/machine_checks.hpp"
#include "doctor/probe_checks.hpp"
#include "host_sdk/scenes.hpp"
#ifdef HAVE_CERTIFICATES
#include "support/certificates.hpp"
#endif
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::tool {
namespace {

using ::testing::AllOf;
using ::testing::Field;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// A finding with this verdict, and a text in what was found or in the remedy.
auto is(Verdict verdict, const std::string& text) {
  return AllOf(Field("verdict", &Finding::verdict, verdict),
               ::testing::ResultOf([](const Finding& f) { return f.found + " -> " + f.remedy; }, HasSubstr(text)));
}

/// Another user for a moment, if this one is root, whom no permission stops.
class AsOrdinaryUser {
 public:
  AsOrdinaryUser() {
    if (geteuid() == 0 && seteuid(65534) != 0) ADD_FAILURE() << "seteuid";
  }
  ~AsOrdinaryUser() {
    if (geteuid() != getuid() && seteuid(getuid()) != 0) ADD_FAILURE() << "seteuid";
  }
};

// --- Running a check ---

TEST(DoctorRun, AFindingIsReturned) {
  bool slow = false;
  const Outcome outcome = run_check([] { return ok("fine"); }, Duration::from_seconds(10), [&] { slow = true; });
  EXPECT_EQ(outcome.finding, ok("fine"));
  EXPECT_EQ(outcome.thread, Outcome::Thread::ended);
  EXPECT_FALSE(slow);
}

TEST(DoctorRun, ACheckThatHangsIsGivenUp) {
  const auto release = std::make_shared<std::atomic<bool>>(false);
  const auto hang = [release] {
    while (!*release) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return ok({});
  };
  const Outcome outcome = run_check(hang, Duration::from_seconds(0.05), [] {});
  *release = true;
  EXPECT_THAT(outcome.finding, is(Verdict::not_checked, "did not end within"));
  EXPECT_EQ(outcome.thread, Outcome::Thread::left_behind);
}

TEST(DoctorRun, ASlowCheckIsReportedOnceAndStillCounts) {
  int slow = 0;
  const auto check = [] {
    std::this_thread::sleep_for(std::chrono::nanoseconds(kQuietTime.ns) + std::chrono::milliseconds(50));
    return ok("late");
  };
  EXPECT_EQ(run_check(check, Duration::from_seconds(60), [&] { ++slow; }).finding, ok("late"));
  EXPECT_EQ(slow, 1);
}

TEST(DoctorRun, AnExceptionIsNoVerdict) {
  const auto check = []() -> Finding { throw std::runtime_error("out of memory"); };
  EXPECT_THAT(run_check(check, Duration::from_seconds(10), [] {}).finding, is(Verdict::not_checked, "out of memory"));
}

// --- This machine ---

TEST(DoctorMachine, NamesTheVersionAndTheLinks) {
  EXPECT_THAT(check_sdk().found, AllOf(HasSubstr(std::string(version())), HasSubstr("grpc://"), HasSubstr("usb:")));
}

TEST(DoctorMachine, TheDateIsPlausible) { EXPECT_NE(check_wall_clock().verdict, Verdict::fault); }

// The sanitizers' runtime cannot be loaded into a second namespace of libraries.
#ifdef LIBRARY_OLDER
TEST(DoctorLibrary, OfThisBuildFits) {
  EXPECT_THAT(check_library(LIGHTWELL_C_LIBRARY), is(Verdict::ok, "the headers of this SDK have ABI"));
}
TEST(DoctorLibrary, AnOlderAndANewerOneAreTold) {
  EXPECT_THAT(check_library(LIBRARY_OLDER), is(Verdict::warning, "ABI 1.0"));
  EXPECT_THAT(check_library(LIBRARY_NEWER), is(Verdict::ok, "newer and compatible"));
  EXPECT_THAT(check_library(LIBRARY_OTHER), is(Verdict::fault, "ABI 2.0"));
}
TEST(DoctorLibrary, AMissingAForeignAndACrashingOneAreNoSuccess) {
  EXPECT_THAT(check_library("/nowhere/liblightwell.so.1"), is(Verdict::not_checked, "/nowhere"));
  EXPECT_THAT(check_library("libm.so.6"), is(Verdict::fault, "no lw_abi_version"));
  EXPECT_THAT(check_library(LIBRARY_CRASHING), is(Verdict::fault, "crashed"));
}
#endif

/// A folder like /sys/bus/usb/devices with one probe, and one like /dev/bus/usb.
class DoctorUsb : public ::testing::Test {
 protected:
  DoctorUsb() {
    // mkdtemp() makes the folder for this user alone.
    fs::permissions(folder_.path(""), fs::perms::group_all | fs::perms::others_all, fs::perm_options::add);
    fs::create_directories(folder_.path("devices/1-2"));
    fs::create_directories(folder_.path("nodes/001"));
    fs::create_directories(folder_.path("rules"));
    attribute("idVendor", "1209");
    attribute("idProduct", "0001");
    attribute("manufacturer", "Lightwell");
    attribute("busnum", "1");
    attribute("devnum", "7");
    folder_.write("nodes/001/007", "");
    paths_.devices = folder_.path("devices");
    paths_.nodes = folder_.path("nodes");
    paths_.udev = folder_.path("nodes");
    paths_.rules = {folder_.path("nowhere"), folder_.path("rules")};
  }
  void attribute(const std::string& name, const std::string& value) {
    folder_.write("devices/1-2/" + name, value + "\n");
  }

  test::TempDir folder_;
  UsbPaths paths_;
};

TEST_F(DoctorUsb, AProbeThatMayBeOpened) {
  EXPECT_THAT(check_usb_devices(paths_), is(Verdict::ok, folder_.path("nodes/001/007")));
}
TEST_F(DoctorUsb, AProbeThatThisUserMayNotOpen) {
  fs::permissions(folder_.path("nodes/001/007"), fs::perms::owner_all);
  const AsOrdinaryUser user;
  if (getuid() != 0) fs::permissions(folder_.path("nodes/001/007"), fs::perms::none);
  EXPECT_THAT(check_usb_devices(paths_), is(Verdict::fault, "70-lightwell.rules"));
}
TEST_F(DoctorUsb, AProbeWithoutADeviceFile) {
  fs::remove(folder_.path("nodes/001/007"));
  EXPECT_THAT(check_usb_devices(paths_), is(Verdict::fault, "container"));
}
TEST_F(DoctorUsb, AnotherDeviceWithThatNumberIsNoProbe) {
  attribute("manufacturer", "Somebody");
  EXPECT_THAT(check_usb_devices(paths_), is(Verdict::not_checked, "no probe is plugged in"));
}
TEST_F(DoctorUsb, ASystemWithoutUsbIsNotChecked) {
  paths_.devices = folder_.path("nowhere");
  EXPECT_THAT(check_usb_devices(paths_), is(Verdict::not_checked, "no USB"));
}
TEST_F(DoctorUsb, TheInstalledRuleIsFound) {
  folder_.write("rules/60-other.rules", R"(ATTR{idVendor}=="1209", ATTR{idProduct}=="0002")");
  {
    const AsOrdinaryUser user;
    EXPECT_THAT(check_usb_rule(paths_), is(Verdict::warning, "udevadm control --reload"));
    paths_.udev = folder_.path("nowhere");
    EXPECT_THAT(check_usb_rule(paths_), is(Verdict::not_checked, "udev does not run"));
  }
  folder_.write("rules/70-lightwell.rules", test::read_file(UDEV_RULE));
  EXPECT_THAT(check_usb_rule(paths_), is(Verdict::ok, "70-lightwell.rules"));
}

#ifdef HAVE_CERTIFICATES
/// A store with one paired probe.
class DoctorStore : public ::testing::Test {
 protected:
  DoctorStore() {
    fs::create_directories(folder_.path("probes/0123"));
    fs::permissions(folder_.path("probes/0123"), fs::perms::owner_all);
    folder_.write("probes/0123/token", "x");
    folder_.write("probes/0123/probe_ca.pem", test::read_file(authority_.sign("probe", kNames, 900).certificate));
    client_expires_in_days(900);
  }
  void client_expires_in_days(int days) {
    folder_.write("probes/0123/client.pem", test::read_file(authority_.sign("client", kNames, days).certificate));
  }
  [[nodiscard]] Finding check() const { return check_credential_store(folder_.path("probes")); }

  static constexpr const char* kNames = "DNS:probe.lightwell.internal";
  test::TempDir folder_;
  test::Authority authority_{"x"};
};

TEST_F(DoctorStore, OfAPairedProbe) { EXPECT_THAT(check(), is(Verdict::ok, "1 paired")); }
TEST_F(DoctorStore, WithoutAProbeIsNotChecked) {
  EXPECT_THAT(check_credential_store(folder_.path("nowhere")), is(Verdict::not_checked, "no probe is paired"));
}
TEST_F(DoctorStore, CertificatesThatExpire) {
  client_expires_in_days(3);
  EXPECT_THAT(check(), is(Verdict::warning, "expires in"));
  client_expires_in_days(-1);
  EXPECT_THAT(check(), is(Verdict::fault, "client.pem has expired"));
}
TEST_F(DoctorStore, AFolderThatOthersMayEnter) {
  fs::permissions(folder_.path("probes/0123"), fs::perms::group_read, fs::perm_options::add);
  EXPECT_THAT(check(), is(Verdict::fault, "chmod -R go= "));
}
TEST_F(DoctorStore, AStoreInWhichOthersMayWrite) {
  fs::permissions(folder_.path("probes"), fs::perms::others_write, fs::perm_options::add);
  EXPECT_THAT(check(), is(Verdict::fault, "may write"));
}
TEST_F(DoctorStore, AFileThatIsNoCertificate) {
  folder_.write("probes/0123/client.pem", "nonsense");
  EXPECT_THAT(check(), is(Verdict::fault, "is no certificate"));
}
#endif

// --- The way to a probe ---

TEST(DoctorNetwork, AddressesOfProbes) {
  const auto grpc = network_address_of("grpcs://[::1]:70");
  ASSERT_TRUE(grpc.ok() && *grpc);
  EXPECT_EQ((*grpc)->host, "::1");
  EXPECT_EQ((*grpc)->port, 70);
  EXPECT_EQ((*grpc)->encryption, Encryption::tls);
  const auto mqtt = network_address_of("mqtt://broker/venue/attic");
  ASSERT_TRUE(mqtt.ok() && *mqtt);
  EXPECT_EQ((*mqtt)->peer, Peer::broker);
  EXPECT_FALSE(*network_address_of("usb:"));
  EXPECT_FALSE(network_address_of("http://x").ok());
}

TEST(DoctorNetwork, AnUnknownName) {
  // RFC 6761: names in .invalid never exist.
  const ResolvedName name = check_name({"nobody.invalid", 7420});
  EXPECT_THAT(name.finding, is(Verdict::fault, "nobody.invalid"));
  EXPECT_TRUE(name.addresses.empty());
  EXPECT_THAT(check_name({"nobody.local", 7420}).finding, is(Verdict::fault, "avahi-daemon"));
}
TEST(DoctorNetwork, ANameAndAnAddress) {
  EXPECT_THAT(check_name({"localhost", 7420}).finding.found, HasSubstr("localhost is "));
  const ResolvedName address = check_name({"127.0.0.1", 7420});
  EXPECT_THAT(address.finding, is(Verdict::not_checked, "is an address"));
  EXPECT_EQ(address.addresses, std::vector<std::string>{"127.0.0.1"});
}
TEST(DoctorNetwork, NothingListens) {
  // Port 1 (tcpmux) answers on no machine that runs tests.
  EXPECT_THAT(check_reachable({"x", 1}, {"127.0.0.1"}, Duration::from_seconds(5)), is(Verdict::fault, "--listen"));
  NetworkAddress broker{"x", 1, Encryption::none, Peer::broker};
  EXPECT_THAT(check_reachable(broker, {"127.0.0.1"}, Duration::from_seconds(5)), is(Verdict::fault, "does the broker"));
}

// --- What a probe reports ---

TEST(DoctorClock, AnOffsetIsNoFaultAndAnUncertaintyIs) {
  ProbeInfo info;
  info.clock_offset = Duration::from_seconds(-86'400);
  info.clock_uncertainty = Duration{200'000};
  EXPECT_THAT(check_clock(info), is(Verdict::ok, "-86400.000 s"));
  info.clock_drift_ppm = -100;
  EXPECT_THAT(check_clock(info), is(Verdict::warning, "drifts by -100 ppm"));
  info.clock_uncertainty = Duration{40'000'000};
  EXPECT_THAT(check_clock(info), is(Verdict::warning, "+-40.00 ms"));
}

TEST(DoctorFrames, NoneSlowAndFresh) {
  ProbeInfo info;
  EXPECT_THAT(check_frames({}, info, Duration::from_seconds(5)), is(Verdict::fault, "is it plugged in"));
  info.counters.frames = 100;
  EXPECT_THAT(check_frames({}, info, Duration::from_seconds(5)), is(Verdict::fault, "counts 100 frames"));
  constexpr double kFreshMs = 20, kOldMs = 260;
  EXPECT_THAT(check_frames({30, 30, kFreshMs, kOldMs}, info, {}), is(Verdict::ok, "30.0 a second"));
  EXPECT_THAT(check_frames({30, 30, kOldMs, kOldMs}, info, {}), is(Verdict::warning, "stale by default"));
}

TEST(DoctorFrames, TheRecorderCountsAndMeasures) {
  ArrivalRecorder recorder;
  EXPECT_EQ(recorder.statistics().count, 0U);
  const Descriptor d;
  for (const std::int64_t i : {0, 1, 2})
    recorder.add({{}, d, HostTime{i * 500'000'000}, HostTime{i * 500'000'000 + 1}, HostTime{i * 500'000'000 + 10 + i}});
  const ArrivalStatistics s = recorder.statistics();
  EXPECT_EQ(s.count, 3U);
  EXPECT_DOUBLE_EQ(s.per_second, 2);
  EXPECT_DOUBLE_EQ(s.age_median_ms, 11e-6);
  EXPECT_DOUBLE_EQ(s.age_max_ms, 12e-6);
}

TEST(DoctorLosses, EachIsNamed) {
  LinkStats stats;
  stats.received = 90;
  EXPECT_THAT(check_losses(stats), is(Verdict::ok, "none of 90"));
  stats.gaps = 10;
  EXPECT_THAT(check_losses(stats), is(Verdict::warning, "10 of 100 descriptors missing"));
  stats.undecodable = 2;
  stats.last_error = "wire_version is 2";
  EXPECT_THAT(check_losses(stats), is(Verdict::warning, "2 messages refused (wire_version is 2)"));
  stats.untimely = 1;
  EXPECT_THAT(check_losses(stats), is(Verdict::warning, "in the probe's name"));
}

TEST(DoctorProbe, EachFaultOfItsStatusIsNamed) {
  ProbeInfo info;
  info.name = "attic";
  EXPECT_THAT(check_probe_status(info), is(Verdict::ok, "'attic'"));
  info.links = {{.name = "web", .fault = true}};
  info.temperature_c = 91.F;
  info.counters.frames = 100;
  info.counters.captures_dropped = 20;
  info.counters.authentication_failures = 3;
  for (const char* part : {"its link web has a fault", "91 degrees", "20 of 100 frames dropped", "3 calls without"})
    EXPECT_THAT(check_probe_status(info), is(Verdict::warning, part));
}

TEST(DoctorVersions, AnotherFirmware) {
  ProbeInfo info;
  info.version = version();
  EXPECT_THAT(check_versions(info), is(Verdict::ok, "messages of version 1"));
  info.version = "0.0.1";
  EXPECT_THAT(check_versions(info), is(Verdict::warning, "probe 0.0.1"));
}

TEST(DoctorLight, DarknessSaturationAndAnUnboundedError) {
  Descriptor d = test::numbered(1, 1);
  d.flags = {};
  d.bound.total = 0.01F;
  EXPECT_THAT(check_light(Lighting::of(d)), is(Verdict::ok, "error at most 1.00 %"));
  d.flags.set(Flag::dark);
  EXPECT_THAT(check_light(Lighting::of(d)), is(Verdict::warning, "covered"));
  d.flags = {};
  d.flags.set(Flag::clipped);
  EXPECT_THAT(check_light(Lighting::of(d)), is(Verdict::warning, "--exposure-s"));
  d.bound.total = std::numeric_limits<float>::infinity();
  EXPECT_THAT(check_light(Lighting::of(d)), is(Verdict::warning, "no bound"));
  EXPECT_THAT(check_light(Lighting()), is(Verdict::not_checked, "no descriptor"));
}

TEST(DoctorConnection, PartsOfAnErrorOfTheSdk) {
  const NetworkAddress tls{"x", 1, Encryption::tls, Peer::probe};
  const ConnectionFindings other = check_connection(tls, {StatusCode::unavailable, "no answer within 2 s"});
  EXPECT_EQ(other.encryption.verdict, Verdict::not_checked);
  EXPECT_EQ(other.access.verdict, Verdict::fault);
  EXPECT_EQ(check_connection(tls, {}).encryption.verdict, Verdict::ok);
  const NetworkAddress plain{"x", 1, Encryption::none, Peer::probe};
  EXPECT_EQ(check_connection(plain, {}).encryption.verdict, Verdict::not_checked);
  EXPECT_THAT(check_connection(plain, {StatusCode::unavailable, ""}).access, is(Verdict::fault, "grpcs://"));
}

}  // namespace
}  // namespace lightwell::tool

// Discovery by mDNS on a network of two simulated machines, and at a broker.
#include <charconv>
#include <cstdlib>

#include <avahi-client/client.h>
#include <avahi-client/publish.h>
#include <avahi-common/simple-watch.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/discover.hpp>
#include <lightwell/text.hpp>

#include "e2e/daemon.hpp"
#include "support/broker.hpp"
#include "support/machine.hpp"
#include "support/mqtt_client.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Exit status and output of the tool.
struct ToolOutput {
  ExitStatus status;
  std::string out, err;
};
ToolOutput run_discover(const Machine& machine, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"discover", "--json", "--timeout", "1.5"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  Child child(tool_command(arguments), {.environment = {machine.environment()}});
  const ExitStatus status = child.wait();
  return {status, child.out(), child.err()};
}

class DiscoverTest : public ::testing::Test {
 protected:
  DiscoverTest() {
    write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x());
    connect(attic_, cellar_);
    attic_.start_avahi();
    cellar_.start_avahi();
  }
  [[nodiscard]] DaemonOptions on(const Machine& machine, const std::string& name,
                                 std::vector<std::string> more = {}) const {
    // Unencrypted, as on a trusted network.
    more.insert(more.end(), {"--announce", "--security", "plain", "--name", name});
    return {.camera = "sim:" + folder_.path("room.exr"),
            .listen = "0.0.0.0:0",
            .more = std::move(more),
            .child = {.environment = {machine.environment()}}};
  }
  /// Repeats discovery until its output contains `what` `times` times; mDNS may take long on a busy machine.
  static ::testing::AssertionResult seen_from(const Machine& machine, const std::string& what, std::size_t times = 1) {
    ToolOutput last;
    const auto result = becomes_true(
        "'" + what + "' is seen from " + machine.name(),
        [&] {
          last = run_discover(machine);
          return occurrences(last.out, what) == times;
        },
        3 * kTestTimeout);
    return result ? result : ::testing::AssertionFailure() << result.message() << "\n" << last.out << last.err;
  }

  TempDir folder_;
  Machine attic_{"attic"}, cellar_{"cellar"};
};

TEST_F(DiscoverTest, AProbeIsSeenFromAnotherMachineWithVersionCalibrationAndLinks) {
  Daemon daemon(on(attic_, "attic window"));
  const std::string uri = daemon.uri();
  const std::string port = uri.substr(uri.rfind(':'));
  ASSERT_TRUE(seen_from(cellar_, "\"name\":\"attic window\""));
  const ToolOutput found = run_discover(cellar_);
  EXPECT_EQ(found.status, (ExitStatus{0, 0})) << found.err;
  const Result<Probe> probe = Probe::connect("grpc://127.0.0.1" + port);
  ASSERT_TRUE(probe.ok());
  const std::string calibration = formatted("%08x", probe->info().calibration_id);
  EXPECT_THAT(found.out,
              AllOf(HasSubstr("\"found_by\":\"mdns\""), HasSubstr("\"version\":\"" + probe->info().version + "\""),
                    HasSubstr("\"calibration_id\":\"" + calibration + "\""), HasSubstr("\"wire_version\":1,"),
                    HasSubstr("\"uri\":\"grpc://attic.local" + port + "\",\"security\":\"none\"")));
  EXPECT_EQ(occurrences(found.out, "\n"), 1U) << "one line per probe, whatever the number of interfaces";
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
  EXPECT_TRUE(seen_from(cellar_, "attic window", 0)) << "a stopped probe withdraws its announcement";
}

TEST_F(DiscoverTest, TheDoctorFindsTheProbeAndAMissingAvahi) {
  Daemon daemon(on(attic_, "attic window"));
  ASSERT_TRUE(seen_from(cellar_, "\"name\":\"attic window\""));
  const auto diagnosis = [&] {
    Child child(tool_command({"doctor", "--json"}), {.environment = {cellar_.environment()}});
    const ExitStatus status = child.wait();
    return ToolOutput{status, child.out(), child.err()};
  };
  ToolOutput found;
  EXPECT_TRUE(becomes_true("the doctor sees the probe", [&] {
    found = diagnosis();
    return found.out.find("attic window") != std::string::npos;
  })) << found.out;
  EXPECT_THAT(found.out, HasSubstr("{\"check\":\"discovery\",\"verdict\":\"ok\""));
  cellar_.stop_avahi();
  EXPECT_THAT(diagnosis().out, AllOf(HasSubstr("{\"check\":\"discovery\",\"verdict\":\"fault\""),
                                     HasSubstr("systemctl start avahi-daemon")));
}

TEST_F(DiscoverTest, TheAnnouncedHostNameLeadsToTheProbe) {
  DaemonOptions options = on(attic_, "attic");
  options.listen = "0.0.0.0:7420";
  Child daemon(attic_.inside(daemon_command(options)), options.child);
  ASSERT_TRUE(seen_from(cellar_, "\"uri\":\"grpc://attic.local:7420\"")) << daemon.err();
  const auto info = [&](const std::string& uri) {
    Child child(cellar_.inside(tool_command({"info", uri, "--json"})), {.environment = {cellar_.environment()}});
    const ExitStatus status = child.wait();
    return ToolOutput{status, child.out(), child.err()};
  };
  for (const char* uri : {"grpc://attic.local", "grpc://ATTIC.local.:7420"}) {
    const ToolOutput answer = info(uri);
    EXPECT_EQ(answer.status, (ExitStatus{0, 0})) << uri << ": " << answer.err;
    EXPECT_THAT(answer.out, HasSubstr("\"name\":\"attic\"")) << uri;
  }
  EXPECT_THAT(info("grpc://nobody.local").err, HasSubstr("is avahi-daemon running"));
  cellar_.stop_avahi();
  EXPECT_THAT(info("grpc://attic.local").err, HasSubstr("is avahi-daemon running"));
}

TEST_F(DiscoverTest, TwoProbesOfOneNameOnOneMachineAreBothSeen) {
  Daemon one(on(attic_, "twin"));
  (void)one.uri();
  ASSERT_TRUE(seen_from(cellar_, "\"instance\":\"twin\""));
  Daemon other(on(attic_, "twin"));
  (void)other.uri();
  ASSERT_TRUE(seen_from(cellar_, "\"instance\":\"twin #2\""));
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"twin\"", 2));
  EXPECT_TRUE(becomes_true("the second probe logs its announced name", [&] {
    return occurrences(other.process().err(), "announced as 'twin #2'") == 1;
  })) << other.process().err();
}

TEST_F(DiscoverTest, TwoProbesOfOneNameOnTwoMachinesAreBothSeen) {
  Daemon one(on(attic_, "twin"));
  (void)one.uri();
  ASSERT_TRUE(seen_from(cellar_, "\"instance\":\"twin\""));
  Daemon other(on(cellar_, "twin"));
  (void)other.uri();
  ASSERT_TRUE(seen_from(attic_, "\"instance\":\"twin #2\""));
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"twin\"", 2));
}

TEST_F(DiscoverTest, SurvivesAbsenceAndRestartOfAvahiAndTheBus) {
  attic_.stop_avahi();
  Daemon daemon(on(attic_, "attic"));
  (void)daemon.uri();
  EXPECT_TRUE(becomes_true("the log says that the probe is not announced",
                           [&] { return occurrences(daemon.process().err(), "discovery: ") > 0; }));
  attic_.start_avahi();
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"attic\""));
  attic_.stop_avahi();
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"attic\"", 0));
  attic_.start_avahi();
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"attic\""));
  attic_.stop_avahi();
  attic_.stop_bus();
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"attic\"", 0));
  attic_.start_bus();
  attic_.start_avahi();
  EXPECT_TRUE(seen_from(cellar_, "\"name\":\"attic\"")) << daemon.process().err();
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
}

TEST_F(DiscoverTest, WithoutAvahiTheToolFailsWithTheReason) {
  cellar_.stop_avahi();
  const ToolOutput found = run_discover(cellar_);
  EXPECT_EQ(found.status, (ExitStatus{3, 0}));
  EXPECT_EQ(found.out, "");
  EXPECT_THAT(found.err, HasSubstr("is avahi-daemon running"));
}

TEST_F(DiscoverTest, WithoutAvahisLibraryTheToolFailsWithTheRemedy) {
  // Found before the system's, and no library.
  folder_.write("libavahi-client.so.3", "");
  Child child(tool_command({"discover", "--timeout", "1.5"}),
              {.environment = {cellar_.environment(), "LD_LIBRARY_PATH=" + folder_.path("")}});
  EXPECT_EQ(child.wait(), (ExitStatus{3, 0}));
  EXPECT_THAT(child.err(), AllOf(HasSubstr("libavahi-client.so.3"), HasSubstr("install libavahi-client3")));
}

TEST_F(DiscoverTest, AnEmptyNetworkIsNoError) {
  const ToolOutput found = run_discover(cellar_);
  EXPECT_EQ(found.status, (ExitStatus{1, 0}));
  EXPECT_THAT(found.err, HasSubstr("no probe was found"));
}

TEST_F(DiscoverTest, AProbeThatListensOnTheLoopbackOnlyAnnouncesItsBroker) {
  Broker broker;
  DaemonOptions options = on(attic_, "attic", {"--mqtt", broker.uri("venue/attic")});
  options.listen = "127.0.0.1:0";
  Daemon daemon(options);
  (void)daemon.uri();
  ASSERT_TRUE(seen_from(cellar_, "\"name\":\"attic\""));
  const ToolOutput found = run_discover(cellar_);
  EXPECT_THAT(found.out, AllOf(HasSubstr("\"uri\":\"" + broker.uri("venue/attic") + "\""), Not(HasSubstr("grpc://"))));
}

/// Announces arbitrary service records.
class Impostor {
 public:
  Impostor(const Machine& machine, const std::string& name, const std::vector<std::string>& txt) {
    ::setenv("DBUS_SYSTEM_BUS_ADDRESS", machine.bus_address().c_str(), 1);
    int error = 0;
    client_ = avahi_client_new(
        avahi_simple_poll_get(poll_), AvahiClientFlags{}, [](auto...) {}, nullptr, &error);
    EXPECT_NE(client_, nullptr);
    group_ = avahi_entry_group_new(
        client_, [](auto...) {}, nullptr);
    AvahiStringList* list = nullptr;
    for (const std::string& entry : txt)
      list = avahi_string_list_add_arbitrary(list, reinterpret_cast<const std::uint8_t*>(entry.data()), entry.size());
    EXPECT_EQ(avahi_entry_group_add_service_strlst(group_, AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, AvahiPublishFlags{},
                                                   name.c_str(), "_lightwell._tcp", nullptr, nullptr, 1, list),
              0);
    avahi_string_list_free(list);
    EXPECT_EQ(avahi_entry_group_commit(group_), 0);
    EXPECT_TRUE(becomes_true(name + " is announced", [&] {
      avahi_simple_poll_iterate(poll_, 1);
      return avahi_entry_group_get_state(group_) == AVAHI_ENTRY_GROUP_ESTABLISHED;
    }));
  }
  Impostor(const Impostor&) = delete;
  Impostor& operator=(const Impostor&) = delete;
  ~Impostor() {
    avahi_client_free(client_);
    avahi_simple_poll_free(poll_);
  }

 private:
  AvahiSimplePoll* poll_ = avahi_simple_poll_new();
  AvahiClient* client_ = nullptr;
  AvahiEntryGroup* group_ = nullptr;
};

TEST_F(DiscoverTest, HostileRecordsAreOmittedCountedAndEscaped) {
  Daemon daemon(on(attic_, "attic"));
  (void)daemon.uri();
  const std::vector<std::string> good = {"txtvers=1", "id=00000001", "name=ok", "version=1", "cal=00000002", "wire=1"};
  const auto with = [&](std::size_t i, const std::string& entry) {
    std::vector<std::string> txt = good;
    txt[i] = entry;
    return txt;
  };
  const Impostor empty(attic_, "empty", {}), escape(attic_, "escape", with(2, "name=\x1b[2Jowned")),
      zero(attic_, "zero", with(2, std::string("name=a\0b", 8))), number(attic_, "number", with(1, "id=99999999999")),
      longest(attic_, "longest", with(3, "version=" + std::string(240, '9'))),
      instance(attic_, "in\x1b[31mstance", good);
  ASSERT_TRUE(seen_from(cellar_, "\"name\":\"attic\""));
  ASSERT_TRUE(seen_from(cellar_, "\"name\":\"ok\""));
  const ToolOutput found = run_discover(cellar_);
  EXPECT_EQ(occurrences(found.out, "\n"), 2U) << found.out;
  EXPECT_EQ(found.out.find('\x1b'), std::string::npos);
  EXPECT_EQ(found.out.find("owned"), std::string::npos);
  EXPECT_THAT(found.out, HasSubstr("in\\\\x1b[31mstance"));
  EXPECT_THAT(found.err, HasSubstr("announcements were malformed"));
}

TEST_F(DiscoverTest, AtABrokerProbesAreListedByTheirRetainedStatus) {
  Broker broker;
  DaemonOptions options{.camera = "sim:" + folder_.path("room.exr"),
                        .more = {"--mqtt", broker.uri("venue/east/attic"), "--name", "attic"}};
  Daemon daemon(options);
  (void)daemon.uri();
  MqttClient mallory(broker.port(), {"venue/east/attic/status"});
  ASSERT_TRUE(mallory.newest("venue/east/attic/status"));
  mallory.publish("venue/gone/status", "gone", MqttClient::Keep::retained);
  mallory.publish("venue/bad/status", "\x1b[2J", MqttClient::Keep::retained);
  mallory.publish("venue//status", "gone", MqttClient::Keep::retained);
  const ToolOutput found =
      run_discover(cellar_, {"--broker", "mqtt://127.0.0.1:" + std::to_string(broker.port()) + "/venue"});
  EXPECT_EQ(found.status, (ExitStatus{0, 0})) << found.err;
  EXPECT_EQ(occurrences(found.out, "\n"), 2U) << found.out;
  EXPECT_THAT(found.out,
              AllOf(HasSubstr("\"found_by\":\"mqtt\",\"name\":\"attic\""),
                    HasSubstr("\"uri\":\"" + broker.uri("venue/east/attic") + "\""), HasSubstr("\"state\":\"gone\"")));
  EXPECT_EQ(found.out.find('\x1b'), std::string::npos);
  EXPECT_THAT(found.err, HasSubstr("2 announcements were malformed"));
  broker.stop();
  EXPECT_THAT(run_discover(cellar_, {"--broker", broker.uri("venue")}).err, HasSubstr("Connection refused"));
}

}  // namespace
}  // namespace lightwell::test

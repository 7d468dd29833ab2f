// `lightwell doctor` against real daemons: which step to a probe fails, its exit code and its remedy.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "e2e/secure_daemon.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Part of an object of `--json`.
std::string check(const std::string& name, const std::string& verdict) {
  return "{\"check\":\"" + name + "\",\"verdict\":\"" + verdict + "\"";
}

/// The address of a link with this scheme, once the daemon prints it; empty if it ends before.
std::string address_of(Child& daemon, const std::string& scheme) {
  std::string out;
  const bool listens = bool{becomes_true("lightwelld listens", [&] {
    out = daemon.out();
    return daemon.exit_status() || out.find(scheme) != std::string::npos;
  })};
  const std::size_t begin = out.find(scheme);
  return listens && begin != std::string::npos ? out.substr(begin, out.find('\n', begin) - begin) : std::string();
}

class DoctorTest : public SecureDaemonTest {
 protected:
  struct Diagnosis {
    int code = -1;
    std::string out, err;
  };
  [[nodiscard]] Diagnosis examine(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "doctor");
    Child child(tool(std::move(arguments)), environment());
    const ExitStatus status = child.wait(3 * kTestTimeout);
    EXPECT_EQ(status.signal, 0);
    return {status.code, child.out(), child.err()};
  }
  /// A copy of the credentials with another token, and without the certificate that would do instead.
  std::string with_wrong_token(const std::string& credentials) {
    const std::string copy = folder_.path("wrong");
    std::filesystem::copy(credentials, copy);
    std::ofstream(copy + "/token") << std::string(43, 'x');
    std::filesystem::remove(copy + "/client.pem");
    std::filesystem::remove(copy + "/client_key.pem");
    return copy;
  }
};

TEST_F(DoctorTest, WithoutAddressItExaminesThisMachine) {
  const Diagnosis found = examine({});
  EXPECT_THAT(found.out, AllOf(HasSubstr("SDK"), HasSubstr("version"), HasSubstr("grpc://"), HasSubstr("library"),
                               HasSubstr("date"), HasSubstr("network"), HasSubstr("pairings"), HasSubstr("USB rule"),
                               HasSubstr("discovery"), HasSubstr("faults")));
  EXPECT_THAT(found.out, Not(HasSubstr("reachable")));
}

TEST_F(DoctorTest, AProbeThatWorks) {
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr"), .more = {"--name", "attic"}});
  const Diagnosis found = examine({daemon.uri(), "--json"});
  EXPECT_EQ(found.code, 0) << found.out << found.err;
  for (const char* name : {"reachable", "access", "versions", "frames", "probe", "light"})
    EXPECT_THAT(found.out, HasSubstr(check(name, "ok")));
  EXPECT_THAT(found.out, AllOf(HasSubstr("'attic'"), HasSubstr(check("TLS", "not checked"))));
}

TEST_F(DoctorTest, APairedProbe) {
  Daemon daemon(options("tls"));
  (void)pair(daemon.uri());
  const Diagnosis found = examine({daemon.uri(), "--json"});
  EXPECT_EQ(found.code, 0) << found.out << found.err;
  for (const char* name : {"pairings", "reachable", "credentials", "TLS", "access", "frames"})
    EXPECT_THAT(found.out, HasSubstr(check(name, "ok")));
}

TEST_F(DoctorTest, ByWebSocketTheSameStepsFail) {
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr"),
                 .more = {"--web", "127.0.0.1:0", "--web-security", "tls", "--keys", keys()}});
  const std::string uri = address_of(daemon.process(), "wss://");
  ASSERT_NE(uri, "") << daemon.process().err();
  const std::string port = std::to_string(port_of(uri));
  PairingMode mode({"--web", "127.0.0.1:" + port, "--web-security", "tls", "--keys", keys()}, port_of(daemon.uri()));
  const std::string folder = pair(mode);
  const Diagnosis works = examine({uri, "--json"});
  EXPECT_EQ(works.code, 0) << works.out << works.err;
  EXPECT_THAT(works.out, AllOf(HasSubstr(check("TLS", "ok")), HasSubstr(check("frames", "ok"))));
  const Diagnosis refused = examine({uri, "--credentials", with_wrong_token(folder), "--json"});
  EXPECT_EQ(refused.code, 4) << refused.out << refused.err;
  EXPECT_THAT(refused.out, AllOf(HasSubstr(check("TLS", "ok")), HasSubstr(check("access", "fault"))));
  const Diagnosis plain = examine({"ws" + uri.substr(std::string("wss").size()), "--json"});
  EXPECT_EQ(plain.code, 3) << plain.out << plain.err;
  EXPECT_THAT(plain.out, HasSubstr("wss:// and pair"));
}

TEST_F(DoctorTest, AnUnpairedClientLacksCredentials) {
  Daemon daemon(options("tls"));
  const Diagnosis found = examine({daemon.uri(), "--json"});
  EXPECT_EQ(found.code, 4) << found.out << found.err;
  EXPECT_THAT(found.out, AllOf(HasSubstr(check("reachable", "ok")), HasSubstr(check("credentials", "fault")),
                               HasSubstr("lightwelld --pair"), HasSubstr(check("TLS", "not checked"))));
}

TEST_F(DoctorTest, AWrongTokenPassesTlsAndIsRefused) {
  Daemon daemon(options("tls"));
  const std::string wrong = with_wrong_token(pair(daemon.uri()));
  const Diagnosis found = examine({daemon.uri(), "--credentials", wrong, "--json"});
  EXPECT_EQ(found.code, 4) << found.out << found.err;
  EXPECT_THAT(found.out, AllOf(HasSubstr(check("TLS", "ok")), HasSubstr(check("access", "fault")),
                               HasSubstr("does not know this client"), HasSubstr(check("frames", "not checked"))));
}

TEST_F(DoctorTest, AnotherProbesCertificateFailsInTheHandshake) {
  Daemon daemon(options("tls"));
  const std::string folder = pair(daemon.uri());
  // New keys, as after a reinstallation of the probe at the same address.
  const std::string listen = daemon.uri().substr(std::string("grpcs://").size());
  (void)daemon.stop();
  std::filesystem::remove_all(keys());
  Daemon other(options("tls", listen));
  const Diagnosis found = examine({other.uri(), "--credentials", folder, "--json"});
  EXPECT_EQ(found.code, 4) << found.out << found.err;
  EXPECT_THAT(found.out, AllOf(HasSubstr(check("TLS", "fault")), HasSubstr("pair again"),
                               HasSubstr(check("access", "not checked"))));
}

TEST_F(DoctorTest, WithoutTlsAtAPortWithTls) {
  Daemon daemon(options("tls"));
  const std::string plain = "grpc" + daemon.uri().substr(std::string("grpcs").size());
  const Diagnosis found = examine({plain, "--json"});
  EXPECT_EQ(found.code, 3) << found.out << found.err;
  EXPECT_THAT(found.out, AllOf(HasSubstr(check("reachable", "ok")), HasSubstr(check("access", "fault")),
                               HasSubstr("use grpcs://")));
}

TEST_F(DoctorTest, NothingListensAndAnUnknownName) {
  // Port 1 (tcpmux) answers on no machine that runs tests; names in .invalid never exist (RFC 6761).
  const Diagnosis refused = examine({"ws://127.0.0.1:1", "--json"});
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.out, AllOf(HasSubstr(check("reachable", "fault")), HasSubstr(check("light", "not checked"))));
  const Diagnosis unknown = examine({"grpcs://nobody.invalid", "--json"});
  EXPECT_EQ(unknown.code, 3);
  EXPECT_THAT(unknown.out, AllOf(HasSubstr(check("name", "fault")), HasSubstr(check("reachable", "not checked"))));
}

TEST_F(DoctorTest, AnAddressOfNoProbeIsMisuse) {
  const Diagnosis found = examine({"http://probe.local"});
  EXPECT_EQ(found.code, 2);
  EXPECT_EQ(found.out, "");
}

TEST_F(DoctorTest, AProbeThatSendsNothing) {
  // A rate at which the first frame comes long after the check.
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr"), .frame_rate = 0.01});
  const Diagnosis found = examine({daemon.uri(), "--json"});
  EXPECT_EQ(found.code, 1) << found.out << found.err;
  EXPECT_THAT(found.out, AllOf(HasSubstr(check("access", "ok")), HasSubstr(check("frames", "fault")),
                               HasSubstr("the probe counts 0 frames")));
}

TEST_F(DoctorTest, TheClockOfAnotherMachineIsMeasured) {
  // Linux time namespaces: the daemon's CLOCK_MONOTONIC is 5000 s ahead.
  std::vector<std::string> command = daemon_command({.camera = "sim:" + folder_.path("room.exr")});
  command.insert(command.begin(), {"/usr/bin/unshare", "--time", "--monotonic", "5000"});
  Child daemon(command);
  const std::string uri = address_of(daemon, "grpc://");
  if (uri.empty()) GTEST_SKIP() << "this system has no time namespaces for this user: " << daemon.err();
  const Diagnosis found = examine({uri, "--json"});
  EXPECT_EQ(found.code, 0) << found.out << found.err;
  EXPECT_THAT(found.out, AllOf(HasSubstr(check("clock", "ok")), HasSubstr("clock is +5000.00")));
  EXPECT_THAT(found.out, HasSubstr(check("frames", "ok"))) << "ages are those of the light, whatever the offset";
}

}  // namespace
}  // namespace lightwell::test

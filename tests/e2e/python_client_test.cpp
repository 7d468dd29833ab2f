// A Python client generated from proto/ alone computes the same light as the SDK.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "e2e/secure_daemon.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

/// A line of the client's output.
struct Line {
  unsigned long long sequence = 0;
  int bands = 0;
  std::size_t lights = 0;
  std::array<double, 3> y00{}, up{};
};

std::vector<Line> lines_of(const std::string& out) {
  std::vector<Line> lines;
  std::istringstream in(out);
  for (std::string text; std::getline(in, text);) {
    Line l;
    const std::size_t numbers = text.find("Y00 ");
    if (numbers == std::string::npos) continue;
    EXPECT_EQ(std::sscanf(text.c_str(), "sequence %llu relative bands %d lights %zu", &l.sequence, &l.bands, &l.lights),
              3)
        << text;
    EXPECT_EQ(std::sscanf(text.c_str() + numbers, "Y00 %lf %lf %lf up %lf %lf %lf", &l.y00[0], &l.y00[1], &l.y00[2],
                          &l.up[0], &l.up[1], &l.up[2]),
              6)
        << text;
    lines.push_back(l);
  }
  return lines;
}

class PythonClientTest : public SecureDaemonTest {
 protected:
  /// Runs it together with a client of the SDK and compares their light.
  void reads_the_same_as(const Observer& observer, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), LIGHTWELL_PYTHON_CLIENT);
    arguments.insert(arguments.end(), {"--count", "10"});
    Child client(arguments);
    ASSERT_EQ(client.wait(), (ExitStatus{0, 0})) << client.err();
    const std::vector<Line> lines = lines_of(client.out());
    ASSERT_EQ(lines.size(), 10U) << client.out();
    int both = 0;
    for (const Line& line : lines)
      for (const Descriptor& d : observer.descriptors()) {
        if (d.sequence != line.sequence) continue;
        ++both;
        EXPECT_EQ(line.lights, d.lights.size());
        const std::array<float, 3> y00 = rgb(d);
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(line.y00[c], static_cast<double>(y00[c]), 1e-6 * std::abs(line.y00[c]));
        EXPECT_GT(line.up[0], 0);
      }
    EXPECT_GE(both, 5) << "descriptors received by both";
  }
  static std::array<float, 3> rgb(const Descriptor& d) {
    return {d.radiance.c[0].r, d.radiance.c[0].g, d.radiance.c[0].b};
  }
};

TEST_F(PythonClientTest, WithoutEncryptionOnTheLoopback) {
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr")});
  const Observer observer(daemon.uri());
  reads_the_same_as(observer, {daemon.uri()});
}

TEST_F(PythonClientTest, OverTlsWithTheTokenOrTheCertificateOfAPairing) {
  Daemon daemon(options("tls"));
  const std::string folder = pair(daemon.uri());
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--certificate"}}) {
    std::vector<std::string> command = {LIGHTWELL_PYTHON_CLIENT, daemon.uri(), "--credentials", folder};
    command.insert(command.end(), more.begin(), more.end());
    Child client(command);
    EXPECT_EQ(client.wait(), (ExitStatus{0, 0})) << client.err();
    EXPECT_EQ(lines_of(client.out()).size(), 5U) << client.out();
  }
}

TEST_F(PythonClientTest, IsRejectedWithoutCredentials) {
  Daemon daemon(options("tls"));
  const std::string folder = pair(daemon.uri());
  folder_.write("token", "no token of this probe's");
  std::filesystem::copy_file(folder_.path("token"), folder + "/token",
                             std::filesystem::copy_options::overwrite_existing);
  Child client({LIGHTWELL_PYTHON_CLIENT, daemon.uri(), "--credentials", folder});
  EXPECT_EQ(client.wait(), (ExitStatus{1, 0}));
  EXPECT_THAT(client.err(), HasSubstr("UNAUTHENTICATED"));
}

}  // namespace
}  // namespace lightwell::test

// Delay, jitter, half-open and broken connections between a probe and its client: the light recovers with the link, and
// outdated light is never reported as valid.
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "e2e/daemon.hpp"
#include "support/impairing_proxy.hpp"
#include "support/panorama_file.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

int port_of(const std::string& uri) { return std::stoi(uri.substr(uri.rfind(':') + 1)); }

/// Queries the light a thousand times a second and counts valid light that is older than max_age by the probe's clock,
/// which is this machine's clock, too.
class FreshnessWatch {
 public:
  FreshnessWatch(const Probe& probe, Duration max_age)
      : thread_([this, &probe, max_age] {
          while (!done_) {
            const std::int64_t before = monotonic_now_ns();
            const Lighting light = probe.latest();
            if (light.validity() == Validity::valid) {
              ++valid_;
              if (before - light.descriptor().time.mid_exposure.ns > max_age.ns) ++violations_;
            } else {
              ++not_valid_;
            }
            std::this_thread::sleep_for(milliseconds(1));
          }
        }) {}
  ~FreshnessWatch() { stop(); }
  void stop() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] int valid() const { return valid_; }
  [[nodiscard]] int not_valid() const { return not_valid_; }
  [[nodiscard]] int violations() const { return violations_; }

 private:
  std::atomic<bool> done_{false};
  std::atomic<int> valid_{0}, not_valid_{0}, violations_{0};
  std::thread thread_;
};

class ImpairedLink : public ::testing::Test {
 protected:
  ImpairedLink()
      : daemon_({.camera = "sim:" + (write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()),
                                     folder_.path("room.exr"))}),
        proxy_(port_of(daemon_.uri())) {}

  [[nodiscard]] Probe connect(Duration max_age) const {
    ProbeOptions options;
    options.max_age = max_age;
    options.connect_timeout = Duration::from_seconds(5);
    Result<Probe> probe = Probe::connect("grpc://127.0.0.1:" + std::to_string(proxy_.port()), options);
    EXPECT_TRUE(probe.ok()) << probe.status().message();
    return std::move(*probe);
  }
  [[nodiscard]] static ::testing::AssertionResult follows(const Probe& probe) {
    const std::uint64_t from = probe.stats().received;
    return becomes_true("valid descriptors arrive", [&] {
      return probe.stats().received > from + 3 && probe.latest().validity() == Validity::valid;
    });
  }

  TempDir folder_;
  Daemon daemon_;
  ImpairingProxy proxy_;
};

constexpr Duration kMaxAge = Lighting::kDefaultMaxAge;

TEST_F(ImpairedLink, TheAgeIncludesADelayOf200Milliseconds) {
  proxy_.impair({.delay = milliseconds(200), .jitter = milliseconds(50)});
  const Probe probe = connect(Duration::from_seconds(2));
  FreshnessWatch watch(probe, Duration::from_seconds(2));
  ASSERT_TRUE(follows(probe));
  for (int i = 0; i < 20; ++i) {
    const Lighting light = probe.latest();
    const Duration truth{monotonic_now_ns() - light.descriptor().time.mid_exposure.ns};
    EXPECT_GE(truth.milliseconds(), 200);
    // The error may be half a round trip, which the stated uncertainty covers.
    EXPECT_NEAR(light.age().milliseconds(), truth.milliseconds(), light.age_uncertainty().milliseconds() + 20);
    EXPECT_LT(light.age_uncertainty().milliseconds(), 320);
    std::this_thread::sleep_for(milliseconds(30));
  }
  watch.stop();
  EXPECT_EQ(watch.violations(), 0);
  EXPECT_EQ(probe.stats().reconnects, 0U);
}

TEST_F(ImpairedLink, OnASilentLinkTheLightBecomesStaleAndRecovers) {
  const Probe probe = connect(kMaxAge);
  ASSERT_TRUE(follows(probe));
  FreshnessWatch watch(probe, kMaxAge);
  // Shorter and longer than the silence after which the client reconnects.
  for (const auto outage : {milliseconds(1000), milliseconds(6000)}) {
    proxy_.hold();
    ASSERT_TRUE(becomes_true("the light is stale", [&] { return probe.latest().validity() == Validity::stale; }));
    EXPECT_FALSE(probe.latest().reason().empty());
    std::this_thread::sleep_for(outage);
    EXPECT_EQ(probe.latest().validity(), Validity::stale);
    proxy_.resume();
    ASSERT_TRUE(follows(probe));
  }
  watch.stop();
  EXPECT_EQ(watch.violations(), 0);
  EXPECT_GT(watch.valid(), 0);
  EXPECT_GT(watch.not_valid(), 1000);
}

TEST_F(ImpairedLink, ReconnectsAfterACut) {
  const Probe probe = connect(kMaxAge);
  ASSERT_TRUE(follows(probe));
  FreshnessWatch watch(probe, kMaxAge);
  for (int i = 0; i < 3; ++i) {
    proxy_.cut();
    ASSERT_TRUE(becomes_true("the light is stale", [&] { return probe.latest().validity() == Validity::stale; }));
    std::this_thread::sleep_for(seconds(1));
    EXPECT_THAT(probe.stats().last_error, ::testing::Not(::testing::IsEmpty()));
    proxy_.restore();
    ASSERT_TRUE(follows(probe));
  }
  watch.stop();
  EXPECT_EQ(watch.violations(), 0);
  EXPECT_EQ(probe.stats().reconnects, 3U);
}

TEST_F(ImpairedLink, WithTooLittleBandwidthOldLightIsStale) {
  const Probe probe = connect(kMaxAge);
  ASSERT_TRUE(follows(probe));
  FreshnessWatch watch(probe, kMaxAge);
  // A quarter of the stream's bandwidth: the backlog grows, and so does the age.
  proxy_.impair({.bytes_per_s = 1500});
  ASSERT_TRUE(becomes_true("it is stale", [&] { return probe.latest().validity() == Validity::stale; }));
  std::this_thread::sleep_for(seconds(3));
  watch.stop();
  EXPECT_EQ(watch.violations(), 0);
}

}  // namespace
}  // namespace lightwell::test

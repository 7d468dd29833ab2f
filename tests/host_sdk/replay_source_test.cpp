// Replay of recordings that the test writes.
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/plane_codec.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/recording.hpp>

#include "host_sdk/scenes.hpp"
#include "support/captured_planes.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using test::encoded;
using test::numbered;

constexpr Duration kTestTimeout{30'000'000'000};
constexpr std::int64_t kMs = 1'000'000;

class ReplaySource : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path() const { return folder_.path("recording"); }

  void record(const std::vector<std::string>& messages, std::int64_t period_ns) const {
    RecordingHeader header;
    header.probe_name = "attic";
    header.version = "0.0.2";
    Result<RecordWriter> writer = RecordWriter::open(path(), header);
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    std::int64_t time = 777'000 * kMs;
    for (const std::string& message : messages) {
      ASSERT_TRUE(writer->append(time, test::as_bytes(message)).ok());
      time += period_ns;
    }
    ASSERT_TRUE(writer->flush().ok());
  }

  /// Descriptors 1 to n, 20 ms apart by the probe's clock.
  static std::vector<std::string> messages(std::uint64_t n) {
    std::vector<std::string> out;
    for (std::uint64_t i = 1; i <= n; ++i)
      out.push_back(encoded(numbered(i, 5'000'000 * kMs + static_cast<std::int64_t>(i) * 20 * kMs)));
    return out;
  }

  static Status play_out(const Probe& probe) {
    std::optional<std::uint64_t> seen;
    for (;;) {
      const Result<Lighting> next = probe.wait_for_next(seen, kTestTimeout);
      if (!next.ok()) return next.status();
      seen = next->descriptor().sequence;
    }
  }

  test::TempDir folder_;
};

TEST_F(ReplaySource, PlaysEveryDescriptorByteForByte) {
  std::vector<std::string> sent = messages(30);
  sent[3] += std::string("\xC0\x3E\x05", 3);  // a field of the future
  record(sent, 20 * kMs);
  std::mutex mutex;
  std::vector<std::string> got;
  ProbeOptions options;
  options.on_descriptor = [&](const Arrival& arrival) {
    const std::lock_guard lock(mutex);
    got.emplace_back(reinterpret_cast<const char*>(arrival.bytes.data()), arrival.bytes.size());
  };
  const Result<Probe> probe = Probe::connect("replay:" + path() + "?speed=0", options);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(play_out(*probe).code(), StatusCode::failed_precondition);
  const std::lock_guard lock(mutex);
  EXPECT_EQ(got, sent);
  EXPECT_EQ(probe->stats().received, 30U);
  EXPECT_EQ(probe->stats().state, LinkState::ended);
}

TEST_F(ReplaySource, ReportsTheRecordedProbe) {
  record(messages(1), 0);
  const Result<Probe> probe = Probe::connect("replay:" + path());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  const ProbeInfo info = probe->info();
  EXPECT_EQ(info.name, "attic");
  EXPECT_EQ(info.version, "0.0.2");
  EXPECT_EQ(info.id, 7U);
  EXPECT_EQ(info.calibration_id, 9U);
}

TEST_F(ReplaySource, PlaysAtTheOriginalSpeed) {
  record(messages(6), 20 * kMs);
  const std::int64_t start = monotonic_now_ns();
  const Result<Probe> probe = Probe::connect("replay:" + path());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(play_out(*probe).code(), StatusCode::failed_precondition);
  EXPECT_GE(monotonic_now_ns() - start, 5 * 20 * kMs) << "earlier than it was recorded";
}

TEST_F(ReplaySource, QueriesInThePastWork) {
  record(messages(6), 20 * kMs);
  const Result<Probe> probe = Probe::connect("replay:" + path());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  (void)play_out(*probe);
  const HostTime newest = probe->latest().mid_exposure();
  // Where a busy machine delayed the first ones, the later ones improved the offset and the moment
  // falls elsewhere than half-way between 5 and 6, but among what was played it falls.
  const Lighting between = probe->at(newest - Duration{10 * kMs});
  EXPECT_NE(between.validity(), Validity::before_history);
  EXPECT_GE(between.radiance({1, 0, 0}, 0).value.r, 1 - 1e-3F);
  EXPECT_LT(between.radiance({1, 0, 0}, 0).value.r, 6);
  EXPECT_EQ(probe->at(newest - Duration{3600'000 * kMs}).validity(), Validity::before_history);
}

TEST_F(ReplaySource, WorldPoseOptionIsUsed) {
  record(messages(1), 0);
  // Rotated by pi about the forward axis: the probe's up is the world's down.
  ProbeOptions hanging;
  hanging.T_world_probe = UncertainPose{{Quat::about({0, 0, -1}, 3.14159265358979), {0, 2, 0}}, {}};
  hanging.T_world_probe->covariance[0][0] = 1e-4;
  const Result<Probe> probe = Probe::connect("replay:" + path() + "?speed=0", hanging);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(probe->wait_for_next(std::nullopt, kTestTimeout).ok());
  EXPECT_NEAR(probe->latest().lights()[0].direction.y, 1, 1e-3);
  const Lighting world = probe->latest_in_world();
  ASSERT_FALSE(world.lights().empty());
  EXPECT_NEAR(world.lights()[0].direction.y, -1, 1e-3);
  const auto& covariance = world.lights()[0].direction_covariance;
  EXPECT_NEAR(covariance[0] + covariance[2], 1e-4, 1e-6) << "a rotation about X moves a direction at -Y";
}

TEST_F(ReplaySource, WithoutAPoseThereIsNoWorldLighting) {
  record(messages(1), 0);
  const Result<Probe> probe = Probe::connect("replay:" + path() + "?speed=0");
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(probe->wait_for_next(std::nullopt, kTestTimeout).ok());
  EXPECT_EQ(probe->latest_in_world().validity(), Validity::invalid_query);
  EXPECT_FALSE(probe->latest_in_world().reason().empty());
  ProbeOptions nowhere;
  nowhere.T_world_probe = UncertainPose{{{0, 0, 0, 0}, {}}, {}};
  const Result<Probe> refused = Probe::connect("replay:" + path(), nowhere);
  EXPECT_EQ(refused.status().code(), StatusCode::invalid_argument);
  EXPECT_NE(refused.status().message().find("T_world_probe"), std::string::npos);
}

TEST_F(ReplaySource, NoDescriptorIsFromTheFuture) {
  record(messages(10), 20 * kMs);
  ProbeOptions options;
  int future = 0;
  options.on_descriptor = [&](const Arrival& arrival) {
    // Each was encoded 3 ms after its exposure.
    if (arrival.mid_exposure + Duration{3 * kMs} > arrival.received) ++future;
  };
  {
    const Result<Probe> probe = Probe::connect("replay:" + path() + "?speed=4", options);
    ASSERT_TRUE(probe.ok()) << probe.status().message();
    (void)play_out(*probe);
  }
  EXPECT_EQ(future, 0);
}

TEST_F(ReplaySource, DamagedRecordsAreCountedAndSkipped) {
  std::vector<std::string> sent = messages(3);
  sent.insert(sent.begin() + 1, "no descriptor");
  sent.insert(sent.begin() + 2, std::string(70'000, 'x'));
  record(sent, 0);
  {
    std::ofstream torn(path(), std::ios::app | std::ios::binary);
    torn << "torn";
  }
  const Result<Probe> probe = Probe::connect("replay:" + path());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  (void)play_out(*probe);
  EXPECT_EQ(probe->stats().received, 3U);
  EXPECT_EQ(probe->stats().undecodable, 1U);
  EXPECT_EQ(probe->stats().oversized, 1U);
  EXPECT_NE(probe->stats().last_error.find("truncated"), std::string::npos);
}

/// Two descriptors, and between them two updates of a plane, `period_ns` apart each.
class ReplayOfPlanes : public ReplaySource {
 protected:
  void record_planes(std::int64_t period_ns) {
    Result<RecordWriter> writer =
        RecordWriter::open(path(), {RecordingKind::descriptors_and_planes, "attic", "0.0.2", {}});
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    PlaneEncoder encoder({.images = ImageRecipients::all_clients});
    CapturedPlane plane = test::linear_plane();
    std::int64_t time = 777'000 * kMs;
    const auto append_update = [&] {
      const auto update = encoder.encode(plane, {time});
      ASSERT_TRUE(update.ok());
      for (const auto& message : *update) {
        sent_.emplace_back(message);
        ASSERT_TRUE(writer->append(time, message, RecordedMessage::plane).ok());
      }
      time += period_ns;
    };
    append_update();
    ASSERT_TRUE(writer->append(time, test::as_bytes(messages(1)[0])).ok());
    time += period_ns;
    for (Radiance& v : plane.texture.radiance) v = v * 2;
    append_update();
    ASSERT_TRUE(writer->append(time, test::as_bytes(messages(2)[1])).ok());
    ASSERT_TRUE(writer->flush().ok());
  }
  [[nodiscard]] Result<Probe> connect(PlaneReception plane) const {
    ProbeOptions options;
    options.plane = plane;
    return Probe::connect("replay:" + path() + "?speed=0", options);
  }

  std::vector<std::vector<std::byte>> sent_;
};

TEST_F(ReplayOfPlanes, PlaysThemBesideDescriptors) {
  ASSERT_NO_FATAL_FAILURE(record_planes(20 * kMs));
  std::vector<std::vector<std::byte>> got;
  {
    ProbeOptions options;
    options.plane = PlaneReception::receive;
    options.on_plane = [&](const PlaneArrival& a) { got.emplace_back(a.bytes.begin(), a.bytes.end()); };
    const Result<Probe> probe = Probe::connect("replay:" + path() + "?speed=0", options);
    ASSERT_TRUE(probe.ok()) << probe.status().message();
    EXPECT_EQ(probe->info().id, 7U) << "the first record is no descriptor";
    (void)play_out(*probe);
    EXPECT_EQ(probe->plane().revision(), 2U);
    EXPECT_EQ(probe->plane().validity(), Validity::valid);
    EXPECT_NEAR(probe->plane().diffuse({}).value.r, 1, 0.003);
    EXPECT_EQ(probe->stats().received, 2U);
    EXPECT_EQ(probe->stats().undecodable, 0U);
  }
  EXPECT_EQ(got, sent_);
  const Result<Probe> without = connect(PlaneReception::none);
  ASSERT_TRUE(without.ok());
  (void)play_out(*without);
  EXPECT_EQ(without->plane().validity(), Validity::none);
  EXPECT_EQ(without->stats().received, 2U);
}

TEST_F(ReplayOfPlanes, PlaysThemAtTheirTime) {
  ASSERT_NO_FATAL_FAILURE(record_planes(60 * kMs));
  std::string order;
  std::vector<std::int64_t> times;
  ProbeOptions options;
  options.plane = PlaneReception::receive;
  options.on_plane = [&](const PlaneArrival& a) {
    order += 'p';
    times.push_back(a.received.ns);
  };
  options.on_descriptor = [&](const Arrival& a) {
    order += 'd';
    times.push_back(a.received.ns);
  };
  const std::int64_t start = monotonic_now_ns();
  {
    const Result<Probe> probe = Probe::connect("replay:" + path(), options);
    ASSERT_TRUE(probe.ok()) << probe.status().message();
    (void)play_out(*probe);
  }
  EXPECT_EQ(order, "pdpd");
  for (std::size_t k = 0; k < times.size(); ++k)
    EXPECT_GE(times[k] - start, static_cast<std::int64_t>(k) * 60 * kMs) << "message " << k << " came early";
}

TEST_F(ReplayOfPlanes, DamageIsReportedAsThatOfDescriptors) {
  ASSERT_NO_FATAL_FAILURE(record_planes(0));
  {
    Result<RecordWriter> writer =
        RecordWriter::open(path(), {RecordingKind::descriptors_and_planes, "attic", "0.0.2", {}});
    ASSERT_TRUE(writer.ok());
    const std::vector<std::byte> garbage(50, std::byte{0xFF}), large(70'000);
    ASSERT_TRUE(writer->append(777'000 * kMs, garbage, RecordedMessage::plane).ok());
    ASSERT_TRUE(writer->append(777'000 * kMs, large, RecordedMessage::plane).ok());
    ASSERT_TRUE(writer->flush().ok());
    std::ofstream torn(path(), std::ios::app | std::ios::binary);
    torn << "torn";
  }
  const Result<Probe> probe = connect(PlaneReception::receive);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  (void)play_out(*probe);
  EXPECT_EQ(probe->plane().revision(), 2U);
  EXPECT_EQ(probe->stats().received, 2U);
  EXPECT_EQ(probe->stats().undecodable, 1U);
  EXPECT_EQ(probe->stats().oversized, 1U);
  EXPECT_NE(probe->stats().last_error.find("truncated"), std::string::npos);
}

TEST_F(ReplaySource, UnplayableFilesAreReported) {
  const Result<Probe> missing = Probe::connect("replay:" + path());
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.status().code(), StatusCode::not_found) << missing.status().message();

  {
    std::ofstream text(path());
    text << "this is no recording, it is a letter to a friend";
  }
  const Result<Probe> letter = Probe::connect("replay:" + path());
  ASSERT_FALSE(letter.ok());
  EXPECT_EQ(letter.status().code(), StatusCode::data_loss) << letter.status().message();
}

TEST_F(ReplaySource, RecordingAcceptsNoCommands) {
  record(messages(1), 0);
  Result<Probe> probe = Probe::connect("replay:" + path());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(probe->set_estimator({}).code(), StatusCode::failed_precondition);
  EXPECT_EQ(probe->change_estimator({.band = 2}).code(), StatusCode::failed_precondition);
  EXPECT_EQ(probe->estimator_config().status().code(), StatusCode::failed_precondition);
  EXPECT_EQ(probe->report_lux(100, {0, 1, 0}).status().code(), StatusCode::failed_precondition);
}

TEST_F(ReplaySource, EmptyRecordingEnds) {
  record({}, 0);
  const Result<Probe> probe = Probe::connect("replay:" + path());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_EQ(play_out(*probe).code(), StatusCode::failed_precondition);
  EXPECT_EQ(probe->latest().validity(), Validity::none);
}

TEST_F(ReplaySource, ClosesDuringALongPause) {
  record(messages(2), 3'600'000 * kMs);
  const std::int64_t start = monotonic_now_ns();
  {
    const Result<Probe> probe = Probe::connect("replay:" + path());
    ASSERT_TRUE(probe.ok()) << probe.status().message();
  }
  EXPECT_LT(monotonic_now_ns() - start, kTestTimeout.ns);
}

}  // namespace
}  // namespace lightwell

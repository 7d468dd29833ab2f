// Nothing is allocated from the camera's push to the encoded bytes, also when the number of lights changes.
#include <array>
#include <memory>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "app/pipeline.hpp"
#include "camera/backends/sim/frame_ring.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "firmware/app/fakes.hpp"
#include "sim/sensor.hpp"
#include "support/allocation_counter.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::AllocationCount;
using test::becomes_true;

constexpr int kMaxLamps = 6;
constexpr int kCaptures = 200;

struct Sensing {
  std::string name;
  PixelFormat format;
  std::vector<double> exposure_s;

  friend void PrintTo(const Sensing& s, std::ostream* out) { *out << s.name; }
};

/// A grey room with the first `lamps` of six lamps of different brightness switched on.
sim::Panorama room_with_lamps(int lamps) {
  return sim::from_function(128, [lamps](Vec3d d) {
    for (int k = 0; k < lamps; ++k) {
      const double phi = k * std::numbers::pi / 3;
      const Vec3d lamp = normalized(Vec3d{std::sin(phi), 0.3, -std::cos(phi)});
      const float l = 300.0F + 50.0F * static_cast<float>(k);
      if (angle_between(d, lamp) < 0.1) return Radiance{l, l, l};
    }
    return Radiance{0.5F, 0.5F, 0.5F};
  });
}

/// Rendered pictures of the room for each number of lamps, as frames.
class Pictures final : public FrameOwner {
 public:
  explicit Pictures(const Sensing& sensing) : sensing_(sensing) {
    Result<RigParameters> rig = sim::make_rig("pair", 160, 120, sensing.format);
    EXPECT_TRUE(rig.ok());
    rig_ = *rig;
    RingPlan plan;
    plan.bracket = plan.cycle = plan.wanted = sensing.exposure_s.size();
    for (int lamps = 0; lamps <= kMaxLamps; ++lamps) {
      const sim::Scene scene(room_with_lamps(lamps));
      RingSource source;
      source.scene = &scene;
      source.rig = &rig_;
      source.sensor = sim::sensor_of(rig_, sensing.format, 1);
      source.exposure_s = sensing.exposure_s;
      rings_[static_cast<std::size_t>(lamps)].render(plan, source, {});
    }
  }
  void release(int /*slot*/) override {}

  [[nodiscard]] const RigParameters& rig() const { return rig_; }

  /// The frames of one capture, pushed as a camera does.
  void push(FrameSink& sink, std::uint64_t capture, int lamps) {
    const std::size_t size = sensing_.exposure_s.size();
    for (std::size_t k = 0; k < size; ++k) {
      Frame frame(*this, 0);
      for (std::size_t lens = 0; lens < rig_.lenses.size(); ++lens) {
        const LensParameters& l = rig_.lenses[lens];
        frame.add_view({static_cast<int>(lens), sensing_.format, l.width, l.height,
                        packed_stride(sensing_.format, l.width),
                        rings_[static_cast<std::size_t>(lamps)].view(k, lens)});
      }
      frame.info.sequence = capture * size + k;
      frame.info.bracket_index = static_cast<int>(k);
      frame.info.bracket_size = static_cast<int>(size);
      frame.info.exposure_s = sensing_.exposure_s[k];
      frame.info.mid_exposure = {static_cast<std::int64_t>(frame.info.sequence) * 33'000'000};
      frame.info.delivered = frame.info.mid_exposure;
      sink.push(std::move(frame));
    }
  }

 private:
  Sensing sensing_;
  RigParameters rig_;
  std::array<FrameRing, kMaxLamps + 1> rings_;
};

/// Number of lamps of a capture: 0 to 6 in an unsorted order.
int lamps_of(std::uint64_t capture) { return static_cast<int>(capture * 4 % (kMaxLamps + 1)); }

class AllocationTest : public ::testing::TestWithParam<Sensing> {
 protected:
  [[nodiscard]] std::unique_ptr<Estimator> estimator(int interleave = 1, int max_bytes = 0) const {
    PanoramaOptions options;
    options.config.panorama.interleave = interleave;
    options.config.panorama.max_bytes = max_bytes;
    // Report all lights, whether the error bound needs them or not, so that their number changes.
    options.config.panorama.epsilon = 0;
    options.config.max_lights = kMaxLamps;
    Result<std::unique_ptr<Estimator>> made = make_panorama_estimator(pictures_.rig(), options);
    EXPECT_TRUE(made.ok()) << made.status().message();
    return std::move(*made);
  }
  Pictures pictures_{GetParam()};
};

TEST_P(AllocationTest, NothingIsAllocatedFromPushToEncodedBytes) {
  const struct { int interleave, max_bytes; } kCases[] = {{1, 0}, {4, 0}, {1, 192}};
  for (const auto& [interleave, max_bytes] : kCases) {
    SCOPED_TRACE(testing::Message() << interleave << " " << max_bytes);
    const std::unique_ptr<Estimator> estimator = this->estimator(interleave, max_bytes);
    BracketSlot slot;
    Bracket bracket;
    Encoder encoder;
    Descriptor descriptor;
    descriptor.lights.reserve(kMaxLights);  // As the pipeline does.
    std::array<bool, kMaxLamps + 1> seen{};
    int failed = 0;
    const auto one = [&](std::uint64_t capture, int lamps) {
      pictures_.push(slot, capture, lamps);
      const bool ok = slot.take(bracket) && estimator->estimate(bracket.frames(), descriptor).ok() &&
                      encoder.encode(descriptor).ok();
      bracket.clear();
      failed += ok ? 0 : 1;
      seen[std::min<std::size_t>(descriptor.lights.size(), kMaxLamps)] = true;
    };
    // Warm up with one lamp: more lights later must not allocate either.
    for (std::uint64_t capture = 0; capture < 5; ++capture) one(capture, 1);
    std::size_t allocated = 0;
    {
      const AllocationCount count;
      for (std::uint64_t capture = 5; capture < 5 + kCaptures; ++capture) one(capture, lamps_of(capture));
      allocated = count.value();
    }
    EXPECT_EQ(allocated, 0U);
    if (allocated > 0) AllocationCount::print_first();
    EXPECT_EQ(failed, 0);
    for (std::size_t lights = 0; lights <= kMaxLamps; ++lights)
      EXPECT_TRUE(seen[lights] || interleave > 1 || max_bytes > 0)
          << "no capture had this number of lights: " << lights;
  }
}

TEST_P(AllocationTest, ThePipelineAllocatesOnlyTheSharedBytes) {
  test::LinkLog log;
  log.published.reserve(2 * kCaptures);
  Pipeline pipeline({}, estimator(), {});
  pipeline.publisher().add(std::make_unique<test::FakeLink>(log));
  ASSERT_TRUE(pipeline.start().ok());
  const auto one = [&](std::uint64_t capture, int lamps) {
    const std::size_t before = log.count();
    pictures_.push(pipeline.sink(), capture, lamps);
    for (int i = 0; i < 100'000 && log.count() == before; ++i)
      std::this_thread::sleep_for(std::chrono::microseconds(100));
  };
  for (std::uint64_t capture = 0; capture < 5; ++capture) one(capture, 1);
  ASSERT_EQ(log.count(), 5U) << "waited 10 s for a frame to be published";
  std::size_t allocated = 0;
  {
    const AllocationCount count;
    for (std::uint64_t capture = 5; capture < 5 + kCaptures; ++capture) one(capture, lamps_of(capture));
    allocated = count.value();
  }
  ASSERT_EQ(log.count(), 5U + kCaptures);
  // After encoding: the vector that all links share, and its control block.
  EXPECT_LE(allocated, 2U * kCaptures);
  pipeline.stop();
}

INSTANTIATE_TEST_SUITE_P(Sensors, AllocationTest,
                         ::testing::Values(Sensing{"ideal", PixelFormat::rgb_f32, {1}},
                                           Sensing{"ideal_bracket", PixelFormat::rgb_f32, {1, 2, 4}},
                                           Sensing{"rgb8", PixelFormat::rgb8, {0.001}},
                                           Sensing{"rgb8_bracket", PixelFormat::rgb8, {0.00002, 0.0005, 0.01}}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace lightwell

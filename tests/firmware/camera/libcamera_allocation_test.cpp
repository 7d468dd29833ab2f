// Tests that no memory is allocated between a camera's completed request and push().
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "camera/backends/libcamera/lens.hpp"
#include "firmware/camera/simulated_lens.hpp"
#include "support/allocation_counter.hpp"

namespace lightwell::libcam {
namespace {

class Counter final : public FrameSink {
 public:
  void push(Frame) override { ++count_; }
  /// False on timeout.
  [[nodiscard]] bool wait_for(int frames) const {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (count_ < frames && std::chrono::steady_clock::now() < limit)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return count_ >= frames;
  }
  [[nodiscard]] int count() const { return count_; }

 private:
  std::atomic<int> count_{0};
};

void expect_no_allocations(int lenses, bool reports_exposure, std::vector<double> exposure_s) {
  auto mailbox = std::make_shared<Mailbox>();
  std::vector<std::unique_ptr<Lens>> cameras;
  LibcameraOptions options;
  options.frame_rate = 200;
  options.capture.exposure_s = std::move(exposure_s);
  for (int l = 0; l < lenses; ++l) {
    SimulatedCameraOptions o;
    o.id = std::to_string(l);
    o.interval = std::chrono::milliseconds(5);
    o.phase = std::chrono::milliseconds(l);
    o.reports_exposure = reports_exposure;
    cameras.push_back(std::make_unique<SimulatedLens>(std::make_shared<SimulatedCamera>(o), l, mailbox));
  }
  const auto backend = make_lens_backend(std::move(options), std::move(cameras), mailbox);
  const Result<CameraInfo> info = backend->open();
  ASSERT_TRUE(info.ok()) << info.status().message();
  Counter sink;
  ASSERT_TRUE(backend->start(sink).ok());
  ASSERT_TRUE(sink.wait_for(10));
  {
    const test::AllocationCount allocations;
    const int before = sink.count();
    EXPECT_TRUE(sink.wait_for(before + 40));
    EXPECT_EQ(allocations.value(), 0U);
    if (allocations.value() > 0) test::AllocationCount::print_first();
  }
  backend->stop();
}

TEST(LibcameraAllocations, AreNoneForFramesOfOneCamera) { expect_no_allocations(1, true, {0.001}); }

TEST(LibcameraAllocations, AreNoneForABracket) {
  expect_no_allocations(1, true, {0.001, 0.003});
  expect_no_allocations(1, false, {0.001, 0.003});
}

TEST(LibcameraAllocations, AreNoneForPairs) { expect_no_allocations(2, true, {0.001}); }

}  // namespace
}  // namespace lightwell::libcam

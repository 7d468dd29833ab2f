// A link on the loopback, with commands that a test can look at.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "firmware/link/client.hpp"
#include "link/grpc/grpc_link.hpp"

namespace lightwell::test {

/// Says who it is and keeps what it is asked.
class FakeCommands final : public Commands {
 public:
  StatusSnapshot status() const override {
    StatusSnapshot s;
    s.probe_name = "attic";
    s.probe_id = 11;
    s.calibration_id = 12;
    s.version = "0.1.0";
    s.camera = "fake camera";
    s.counters.frames = 5;
    s.counters.recording_faults = 3;
    return s;
  }
  EstimatorConfig estimator() const override {
    const std::lock_guard lock(mutex_);
    return config_;
  }
  Status set_estimator(const EstimatorConfig& config) override {
    if (Status s = config.validate(); !s.ok()) return s;
    const std::lock_guard lock(mutex_);
    config_ = config;
    return {};
  }
  Result<double> report_lux(double lux, Vec3d normal) override {
    const std::lock_guard lock(mutex_);
    lux_ = lux;
    normal_ = normal;
    return 2 * lux;
  }

  std::optional<double> lux_;
  Vec3d normal_;

 private:
  mutable std::mutex mutex_;
  EstimatorConfig config_;
};

class GrpcLinkTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(link_->start().ok()); }

  /// Clients that the server knows of.
  [[nodiscard]] ::testing::AssertionResult clients_become(std::uint32_t count) const {
    return comes_true("the link has " + std::to_string(count) + " clients",
                      [&] { return link_->counters().clients == count; });
  }

  FakeCommands commands_;  // first: the link calls it
  std::unique_ptr<Link> link_ = make_grpc_link("127.0.0.1:0", commands_);
};

}  // namespace lightwell::test

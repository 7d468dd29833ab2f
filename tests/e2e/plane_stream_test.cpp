// A captured plane from the firmware's publisher through the gRPC link and the web link to the SDK's Probe, in one
// process.
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include <lightwell/probe.hpp>

#include "link/grpc/grpc_link.hpp"
#include "link/link.hpp"
#include "link/web/web_link.hpp"
#include "support/captured_planes.hpp"
#include "support/fake_commands.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

enum class Via { grpc, web };

class PlaneStreamTest : public ::testing::TestWithParam<Via> {
 protected:
  /// A probe at the same address each time.
  void start_probe(ImageRecipients images) {
    publisher_ = std::make_unique<Publisher>(PlaneEncoderOptions{.images = images});
    WebConfig web;
    web.listen_address = address_;
    publisher_->add(GetParam() == Via::grpc ? make_grpc_link({.listen_address = address_}, "attic", commands_)
                                            : make_web_link(web, {}, "attic", commands_, {}));
    // The port of a server that was stopped may not be free at once.
    ASSERT_TRUE(test::becomes_true("the link starts", [&] { return publisher_->start().ok(); }));
    uri_ = publisher_->links()[0]->address();
    address_ = uri_.substr(uri_.find("://") + 3);
  }
  void stop_probe() { publisher_->stop(); }
  void TearDown() override { stop_probe(); }

  Result<Probe> connect(PlaneReception plane = PlaneReception::receive) {
    ProbeOptions options;
    options.plane = plane;
    return Probe::connect(uri_, options);
  }

  test::FakeCommands commands_;
  std::unique_ptr<Publisher> publisher_;
  std::string address_ = "127.0.0.1:0", uri_;
};

TEST_P(PlaneStreamTest, ProbeHasTheNewestPlane) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients));
  CapturedPlane plane = test::linear_plane(256, 60, 60);
  ASSERT_TRUE(publisher_->publish_plane(plane).ok());
  Result<Probe> probe = connect();
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(test::becomes_true("the plane is there", [&] { return probe->plane().validity() == Validity::valid; }));
  const PlaneAppearance first = probe->plane();
  EXPECT_EQ(first.info().capture, plane.info.capture);
  EXPECT_NEAR(first.radiance({}, {0, 0, 0.5}).value.r, 0.5 + 0.1, 0.003);
  for (Radiance& v : plane.texture.radiance) v = v * 2;
  ASSERT_TRUE(publisher_->publish_plane(plane).ok());
  ASSERT_TRUE(test::becomes_true("the change is there", [&] { return probe->plane().revision() == 2; }));
  EXPECT_NEAR(probe->plane().diffuse({}).value.r, 1, 0.003);
  EXPECT_NEAR(first.diffuse({}).value.r, 0.5, 0.003) << "a snapshot does not change";
  EXPECT_EQ(probe->plane().missing_tiles(), 0U);

  // The probe restarts and captures again; until that has arrived, the former plane stays.
  stop_probe();
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients));
  EXPECT_EQ(probe->plane().revision(), 2U);
  CapturedPlane next = test::linear_plane(32, 10, 10);
  // The worst case: a number that was used before.
  next.info.capture = plane.info.capture;
  ASSERT_TRUE(publisher_->publish_plane(next).ok());
  ASSERT_TRUE(test::becomes_true("the next plane is there", [&] { return probe->plane().texture_edge() == 32; }));
  EXPECT_EQ(probe->plane().validity(), Validity::valid);
}

TEST_P(PlaneStreamTest, WithoutPermissionThereAreNoImages) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::nobody));
  ASSERT_TRUE(publisher_->publish_plane(test::linear_plane()).ok());
  const Result<Probe> probe = connect();
  ASSERT_TRUE(probe.ok());
  ASSERT_TRUE(test::becomes_true("the plane is there", [&] { return probe->plane().validity() == Validity::valid; }));
  EXPECT_EQ(probe->plane().texture_edge(), 0);
  EXPECT_EQ(probe->plane().diffuse({}).validity, Validity::none);
  EXPECT_EQ(probe->plane().specular({0, 0, 1}).validity, Validity::valid);
}

TEST_P(PlaneStreamTest, IsReceivedOnRequestOnly) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients));
  const Result<Probe> without = connect(PlaneReception::none), with = connect();
  ASSERT_TRUE(without.ok() && with.ok());
  EXPECT_EQ(with->plane().validity(), Validity::none);
  ASSERT_TRUE(publisher_->publish_plane(test::linear_plane()).ok());
  ASSERT_TRUE(test::becomes_true("the plane is there", [&] { return with->plane().validity() == Validity::valid; }));
  EXPECT_EQ(without->plane().validity(), Validity::none);
}

/// Updates while another thread renders.
TEST_P(PlaneStreamTest, UpdatesDoNotDisturbQueries) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients));
  const Result<Probe> probe = connect();
  ASSERT_TRUE(probe.ok());
  CapturedPlane plane = test::linear_plane(64, 20, 10);
  std::atomic<bool> done{false};
  std::atomic<int> compared{0}, wrong{0};
  std::thread app([&] {
    while (!done) {
      const PlaneAppearance now = probe->plane();
      if (now.validity() == Validity::none) continue;
      // All texels of one state have the same factor.
      const float a = now.diffuse({-0.05, 0}).value.r / 0.4F, b = now.diffuse({0.05, 0}).value.r / 0.6F;
      // Also true for NaN.
      if (!(std::abs(a - b) <= 0.01F * a)) ++wrong;
      if (a > 0) ++compared;
    }
  });
  for (int k = 0; k < 60; ++k) {
    ASSERT_TRUE(publisher_->publish_plane(plane).ok());
    for (Radiance& v : plane.texture.radiance) v = v * 1.1F;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(test::becomes_true("a late update is there", [&] {
    (void)publisher_->publish_plane(plane);
    return probe->plane().revision() >= 60 && compared > 0;
  }));
  done = true;
  app.join();
  EXPECT_GT(compared, 0);
  EXPECT_EQ(wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Links, PlaneStreamTest, ::testing::Values(Via::grpc, Via::web),
                         [](const auto& param) { return param.param == Via::grpc ? "grpc" : "web"; });

}  // namespace
}  // namespace lightwell

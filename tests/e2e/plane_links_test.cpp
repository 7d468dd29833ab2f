// Captured planes from the firmware's publisher through each live link to the SDK, in one process: all links keep the
// same contract. Recordings: tests/host_sdk/replay_source_test.cpp.
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include <lightwell/probe.hpp>

#include "core/descriptor_receiver.hpp"
#include "core/source.hpp"
#include "e2e/usb_cable.hpp"
#include "link/grpc/grpc_link.hpp"
#include "link/link.hpp"
#include "link/mqtt/mqtt_link.hpp"
#include "link/usb_gadget/usb_gadget_link.hpp"
#include "support/broker.hpp"
#include "support/captured_planes.hpp"
#include "support/fake_commands.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

ProbeOptions options_for(PlaneReception plane) {
  ProbeOptions options;
  options.connect_timeout = Duration::from_seconds(20);
  options.retry_min = {1'000'000};
  options.retry_max = {50'000'000};
  options.plane = plane;
  return options;
}

/// A connected client of the link.
class PlaneClient {
 public:
  virtual ~PlaneClient() = default;
  [[nodiscard]] virtual PlaneAppearance plane() const = 0;
  [[nodiscard]] virtual LinkStats stats() const = 0;
};

/// The link between a probe that can be restarted and its clients.
class PlaneLink {
 public:
  virtual ~PlaneLink() = default;
  /// The probe's end, at the same address each time.
  [[nodiscard]] virtual std::unique_ptr<Link> make_link(Commands& commands) = 0;
  virtual void started(const Link&) {}
  /// Null if the client could not connect.
  [[nodiscard]] virtual std::unique_ptr<PlaneClient> connect(PlaneReception plane) = 0;
  /// Number of the capture after a restart of the probe. The worst case is one that was used before.
  [[nodiscard]] virtual std::uint32_t next_capture() const { return linear_plane().info.capture; }
  /// How many clients the link can have at once.
  [[nodiscard]] virtual int max_clients() const { return 8; }
};

/// A client through Probe::connect().
class ProbeClient final : public PlaneClient {
 public:
  explicit ProbeClient(Probe probe) : probe_(std::move(probe)) {}
  PlaneAppearance plane() const override { return probe_.plane(); }
  LinkStats stats() const override { return probe_.stats(); }

 private:
  Probe probe_;
};

std::unique_ptr<PlaneClient> connected(const std::string& uri, PlaneReception plane) {
  Result<Probe> probe = Probe::connect(uri, options_for(plane));
  EXPECT_TRUE(probe.ok()) << probe.status().message();
  return probe ? std::make_unique<ProbeClient>(std::move(*probe)) : nullptr;
}

class OverGrpc final : public PlaneLink {
 public:
  std::unique_ptr<Link> make_link(Commands& commands) override {
    return make_grpc_link({.listen_address = address_}, "attic", commands);
  }
  void started(const Link& link) override { address_ = link.address().substr(7); }
  std::unique_ptr<PlaneClient> connect(PlaneReception plane) override { return connected("grpc://" + address_, plane); }

 private:
  std::string address_ = "127.0.0.1:0";
};

class OverMqtt final : public PlaneLink {
 public:
  std::unique_ptr<Link> make_link(Commands& commands) override {
    return make_mqtt_link({.uri = broker_.uri("venue/attic")}, "attic", commands);
  }
  std::unique_ptr<PlaneClient> connect(PlaneReception plane) override {
    return connected(broker_.uri("venue/attic"), plane);
  }
  // The same number with lower revisions is a replay, until it has lasted (PlaneReplayProtection).
  std::uint32_t next_capture() const override { return 0xD1FFE7; }

 private:
  Broker broker_;
};

class OverUsb final : public PlaneLink {
 public:
  std::unique_ptr<Link> make_link(Commands& commands) override {
    return make_usb_gadget_link(cable_.probe_end(), ++session_, commands);
  }
  // A daemon that restarts leaves the bus.
  void started(const Link&) override {
    cable_.pull_out();
    cable_.plug_in();
  }
  std::unique_ptr<PlaneClient> connect(PlaneReception plane) override {
    auto client = std::make_unique<Client>(cable_, plane);
    if (!client->receiver.wait_until_described(Duration::from_seconds(20)).ok()) return nullptr;
    return client;
  }
  int max_clients() const override { return 1; }
  UsbCable& cable() { return cable_; }

 private:
  struct Client final : PlaneClient {
    Client(UsbCable& cable, PlaneReception plane)
        : options(options_for(plane)),
          receiver(options),
          source(core::make_usb_source(cable.host_end(), {}, options, receiver)) {}
    PlaneAppearance plane() const override { return receiver.plane({monotonic_now_ns()}); }
    LinkStats stats() const override { return receiver.stats(); }

    const ProbeOptions options;
    core::DescriptorReceiver receiver;
    std::unique_ptr<core::Source> source;
  };

  UsbCable cable_{5};
  std::uint32_t session_ = 40;
};

struct NamedLink {
  const char* name;
  std::function<std::unique_ptr<PlaneLink>()> make;
};

/// A probe and the link to its clients.
class PlaneLinkTest : public ::testing::Test {
 protected:
  explicit PlaneLinkTest(std::unique_ptr<PlaneLink> link) : link_(std::move(link)) {}
  void TearDown() override { stop_probe(); }

  /// The probe publishes its plane every 20 ms, as a daemon does every second; its key interval is 0.2 s.
  void start_probe(ImageRecipients images, CapturedPlane plane) {
    plane_ = std::move(plane);
    publisher_ = std::make_unique<Publisher>(PlaneEncoderOptions{.images = images, .key_interval = {200'000'000}});
    publisher_->add(link_->make_link(commands_));
    // The port of a server that was stopped may not be free at once.
    ASSERT_TRUE(becomes_true("the link starts", [&] { return publisher_->start().ok(); }));
    link_->started(*publisher_->links()[0]);
    publishing_ = true;
    thread_ = std::thread([this] {
      while (publishing_) {
        {
          const std::lock_guard lock(mutex_);
          plane_.info.mid_exposure = {monotonic_now_ns()};
          EXPECT_TRUE(publisher_->publish_plane(plane_).ok());
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
  }
  void stop_probe() {
    publishing_ = false;
    if (thread_.joinable()) thread_.join();
    if (publisher_) publisher_->stop();
  }
  void scale_texture(float factor) {
    const std::lock_guard lock(mutex_);
    for (Radiance& v : plane_.texture.radiance) v = v * factor;
  }
  static ::testing::AssertionResult has_plane(const PlaneClient& client, float diffuse, int edge) {
    return becomes_true("the plane is there; " + client.stats().last_error, [&] {
      const PlaneAppearance plane = client.plane();
      return plane.validity() == Validity::valid && plane.texture_edge() == edge &&
             std::abs(plane.diffuse({}).value.r - diffuse) < 0.006F * diffuse;
    });
  }

  std::unique_ptr<PlaneLink> link_;
  FakeCommands commands_;
  std::mutex mutex_;
  CapturedPlane plane_;
  std::unique_ptr<Publisher> publisher_;
  std::atomic<bool> publishing_{false};
  std::thread thread_;
};

class PlaneOverEveryLink : public PlaneLinkTest, public ::testing::WithParamInterface<NamedLink> {
 protected:
  PlaneOverEveryLink() : PlaneLinkTest(GetParam().make()) {}
};

class PlaneOverUsb : public PlaneLinkTest {
 protected:
  PlaneOverUsb() : PlaneLinkTest(std::make_unique<OverUsb>()) {}
};

TEST_P(PlaneOverEveryLink, ALateClientHasTheWholePlaneAndThenChanges) {
  // Seven messages.
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients, linear_plane(256, 120, 60)));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto client = link_->connect(PlaneReception::receive);
  ASSERT_TRUE(client);
  ASSERT_TRUE(has_plane(*client, 0.5F, 256));
  const PlaneAppearance first = client->plane();
  EXPECT_EQ(first.info().capture, linear_plane().info.capture);
  EXPECT_EQ(first.missing_tiles(), 0U);
  EXPECT_NEAR(first.radiance({}, {0, 0, 0.5}).value.r, 0.5 + 0.1, 0.003);
  scale_texture(2);
  ASSERT_TRUE(has_plane(*client, 1, 256));
  EXPECT_NEAR(first.diffuse({}).value.r, 0.5, 0.003) << "a snapshot does not change";
  EXPECT_EQ(client->stats().undecodable, 0U) << client->stats().last_error;
  EXPECT_EQ(client->stats().untimely, 0U) << client->stats().last_error;
}

TEST_P(PlaneOverEveryLink, WithoutPermissionThereAreNoImages) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::nobody, linear_plane()));
  const auto client = link_->connect(PlaneReception::receive);
  ASSERT_TRUE(client);
  ASSERT_TRUE(becomes_true("the plane is there", [&] { return client->plane().validity() == Validity::valid; }));
  EXPECT_EQ(client->plane().texture_edge(), 0);
  EXPECT_EQ(client->plane().diffuse({}).validity, Validity::none);
  EXPECT_EQ(client->plane().specular({0, 0, 1}).validity, Validity::valid);
}

TEST_P(PlaneOverEveryLink, IsReceivedOnRequestOnly) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients, linear_plane()));
  auto without = link_->connect(PlaneReception::none);
  ASSERT_TRUE(without);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_EQ(without->plane().validity(), Validity::none);
  EXPECT_EQ(without->stats().frames_refused, 0U);
  EXPECT_EQ(without->stats().undecodable, 0U);
  if (link_->max_clients() == 1) without.reset();
  const auto with = link_->connect(PlaneReception::receive);
  ASSERT_TRUE(with);
  EXPECT_TRUE(has_plane(*with, 0.5F, 64));
}

/// Until the next plane has arrived, the former one stays.
TEST_P(PlaneOverEveryLink, ARestartedProbeCapturesAgain) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients, linear_plane()));
  const auto client = link_->connect(PlaneReception::receive);
  ASSERT_TRUE(client);
  ASSERT_TRUE(has_plane(*client, 0.5F, 64));
  stop_probe();
  EXPECT_EQ(client->plane().texture_edge(), 64);
  CapturedPlane next = linear_plane(32, 10, 10);
  next.info.capture = link_->next_capture();
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients, next));
  EXPECT_TRUE(has_plane(*client, 0.5F, 32));
  EXPECT_EQ(client->plane().info().capture, link_->next_capture());
}

/// Messages that are lost come again, requests too, and what the damaged ones hold is never taken.
TEST_F(PlaneOverUsb, APlaneArrivesThroughADamagingCable) {
  ASSERT_NO_FATAL_FAILURE(start_probe(ImageRecipients::all_clients, linear_plane(256, 60, 60)));
  UsbCable& cable = static_cast<OverUsb&>(*link_).cable();
  for (int connection = 0; connection < 8; ++connection) {
    cable.damage(200);
    const auto client = link_->connect(PlaneReception::receive);
    ASSERT_TRUE(client);
    ASSERT_TRUE(has_plane(*client, 0.5F, 256)) << "connection " << connection;
    scale_texture(2);
    ASSERT_TRUE(has_plane(*client, 1, 256)) << "connection " << connection;
    scale_texture(0.5F);
    cable.damage(0);
    EXPECT_EQ(client->stats().undecodable, 0U) << client->stats().last_error;
  }
  EXPECT_GT(cable.to_host().damaged, 0U);
  EXPECT_GT(cable.to_probe().damaged, 0U);
}

INSTANTIATE_TEST_SUITE_P(Links, PlaneOverEveryLink,
                         ::testing::Values(NamedLink{"Grpc", [] { return std::make_unique<OverGrpc>(); }},
                                           NamedLink{"Usb", [] { return std::make_unique<OverUsb>(); }},
                                           NamedLink{"Mqtt", [] { return std::make_unique<OverMqtt>(); }}),
                         [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace lightwell::test
